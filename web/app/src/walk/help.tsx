/** How to move, in a dialog. */

import { useEffect, useRef } from 'preact/hooks';
import type { JSX } from 'preact';

const KEYS: readonly (readonly [readonly string[], string])[] = [
  [['W', 'A', 'S', 'D'], 'walk; ↑ and ↓ too'],
  [['←', '→'], 'turn'],
  [['Shift'], 'faster'],
  [['E', 'Q'], 'up, down; R and F too'],
  [['G'], 'fly where you look, or land'],
  [['+', '−'], 'pace; the wheel too'],
  [['P'], 'figures, map, overlays'],
  [['X'], 'freeze the cell'],
  [['B'], 'compare with the full model'],
  [['K', 'O'], 'record a path, save a picture'],
  [['H'], 'this help'],
];

export function Help({ close, flying }: { close: () => void; flying: boolean }): JSX.Element {
  const button = useRef<HTMLButtonElement>(null);
  useEffect(() => button.current?.focus(), []);
  return (
    <div class="center shade" onClick={close}>
      <div
        class="card help"
        role="dialog"
        aria-modal="true"
        aria-labelledby="help-title"
        onClick={(event) => event.stopPropagation()}
      >
        <h1 id="help-title">Moving about</h1>
        <dl>
          {KEYS.map(([keys, meaning]) => (
            <div key={meaning}>
              <dt>
                {keys.map((key) => (
                  <kbd key={key}>{key}</kbd>
                ))}
              </dt>
              <dd>{meaning}</dd>
            </div>
          ))}
        </dl>
        <p>
          Click the picture to look with the mouse, <kbd>Esc</kbd> to let go, or drag. On a touch
          screen the left thumb walks and the right thumb looks. Gamepads work too.
        </p>
        <p class="fine">
          {flying ? 'You are flying. ' : ''}The address of the page always leads back to where you
          stand.
        </p>
        <p class="actions">
          <button type="button" ref={button} onClick={close}>
            Walk on
          </button>
        </p>
      </div>
    </div>
  );
}
