/** What a bake would come to, asked anew while it changes. */

import { useEffect, useState } from 'preact/hooks';
import { post, tell, type Plan, type Wanted } from '../api.js';

/** Milliseconds of rest before asking, so that a drag does not queue up questions. */
const REST = 60;

export interface Planned {
  readonly plan: Plan | undefined;
  readonly problem: string;
}

const NOTHING: Planned = { plan: undefined, problem: '' };

export function usePlan(wanted: Wanted | undefined): Planned {
  const [planned, setPlanned] = useState<Planned>(NOTHING);
  const asked = wanted === undefined ? '' : JSON.stringify(wanted);
  useEffect(() => {
    if (asked === '') {
      setPlanned(NOTHING);
      return;
    }
    const stop = new AbortController();
    const timer = window.setTimeout(() => {
      post<Plan>('plans', JSON.parse(asked), stop.signal).then(
        (plan) => setPlanned({ plan, problem: '' }),
        (error: unknown) => {
          if (!stop.signal.aborted) setPlanned({ plan: undefined, problem: tell(error) });
        },
      );
    }, REST);
    return () => {
      clearTimeout(timer);
      stop.abort();
    };
  }, [asked]);
  return planned;
}
