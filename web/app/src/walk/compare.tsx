/** The divider between the walk and the full model. */

import { useRef, useState } from 'preact/hooks';
import type { JSX } from 'preact';
import type { Session } from './session.js';

const COUNT = new Intl.NumberFormat('en', { maximumFractionDigits: 0 });

export function Compare({ session, close }: { session: Session; close: () => void }): JSX.Element {
  const { comparison } = session;
  const [at, setAt] = useState(comparison.divider);
  const held = useRef(false);
  const move = (share: number): void => {
    comparison.divider = Math.min(0.98, Math.max(0.02, share));
    setAt(comparison.divider);
  };
  if (comparison.state !== 'ready') {
    return (
      <div class={comparison.state === 'failed' ? 'center' : 'center quiet'} role="status">
        {comparison.state === 'failed' ? (
          <div class="card" role="alert">
            <h1>The full model can’t be shown</h1>
            <p>{comparison.error?.message}</p>
            <p class="actions">
              <button type="button" onClick={close}>
                Back to the walk
              </button>
            </p>
          </div>
        ) : (
          <p class="waiting">
            <span class="spinner" aria-hidden="true" />
            Loading the full model…
          </p>
        )}
      </div>
    );
  }
  return (
    <div class="divider" style={{ left: `${100 * at}%` }}>
      <p class="side left">Walk</p>
      <p class="side right">Full model, {COUNT.format(comparison.triangles)} triangles</p>
      <div
        class="handle"
        role="slider"
        tabIndex={0}
        aria-label="Divider between the walk and the full model"
        aria-valuemin={0}
        aria-valuemax={100}
        aria-valuenow={Math.round(100 * at)}
        onPointerDown={(event) => {
          held.current = true;
          event.currentTarget.setPointerCapture(event.pointerId);
        }}
        onPointerMove={(event) => {
          if (held.current) move(event.clientX / window.innerWidth);
        }}
        onPointerUp={() => (held.current = false)}
        onPointerCancel={() => (held.current = false)}
        onKeyDown={(event) => {
          const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
          if (step === undefined) return;
          event.stopPropagation();
          event.preventDefault();
          move(at + step);
        }}
      >
        <span aria-hidden="true">⟺</span>
      </div>
    </div>
  );
}
