/** Where a server asks for keys: the field to enter one. */

import type { JSX } from 'preact';
import { useState } from 'preact/hooks';
import { ApiError, post, tell } from './api.js';

/** Whether a failure means that a key is needed. */
export function needsKey(error: unknown): boolean {
  return error instanceof ApiError && error.status === 401;
}

export function KeyForm(): JSX.Element {
  const [key, setKey] = useState('');
  const [problem, setProblem] = useState('');
  const enter = (event: Event): void => {
    event.preventDefault();
    post('session', { key: key.trim() }).then(
      () => location.reload(),
      (error: unknown) => setProblem(tell(error)),
    );
  };
  return (
    <form class="sheet" onSubmit={enter}>
      <label>
        This server asks for a key
        <input
          type="password"
          autocomplete="current-password"
          value={key}
          onInput={(event) => setKey(event.currentTarget.value)}
        />
      </label>
      <button class="main" disabled={key.trim() === ''}>
        Enter
      </button>
      {problem === '' ? null : <p role="alert">{problem}</p>}
    </form>
  );
}
