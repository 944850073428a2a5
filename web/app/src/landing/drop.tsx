/** The place to drop a model, and how far its upload has come. */

import type { JSX } from 'preact';
import { useEffect, useRef, useState } from 'preact/hooks';
import { address, tell } from '../api.js';
import { sendModel, type Sending } from '../upload.js';
import { bytes, duration } from '../words.js';

const KINDS = '.glb,.gltf,.obj,.ply,.stl,.zip';

interface Moving extends Sending {
  readonly name: string;
  readonly begun: number;
}

export function Drop(): JSX.Element {
  const [moving, setMoving] = useState<Moving | undefined>(undefined);
  const [problem, setProblem] = useState('');
  const [over, setOver] = useState(false);
  const stop = useRef(new AbortController());

  const send = (file: File): void => {
    const begun = performance.now();
    stop.current = new AbortController();
    setProblem('');
    setMoving({ name: file.name, begun, sent: 0, total: file.size, arrived: false });
    const progress = (sending: Sending): void => setMoving({ name: file.name, begun, ...sending });
    sendModel(file, progress, stop.current.signal).then(
      (scene) => location.assign(address(`scene/${scene}`)),
      (error: unknown) => {
        setMoving(undefined);
        setProblem(error instanceof DOMException ? '' : tell(error));
      },
    );
  };

  useEffect(() => {
    // a file dropped beside the field must not replace the page
    const keep = (event: DragEvent): void => event.preventDefault();
    const dropped = (event: DragEvent): void => {
      event.preventDefault();
      setOver(false);
      const files = event.dataTransfer?.files;
      if (files === undefined || files.length === 0) return;
      if (files.length > 1) {
        setProblem('Drop one file; a model with its textures goes into one zip.');
        return;
      }
      send(files[0]);
    };
    window.addEventListener('dragover', keep);
    window.addEventListener('drop', dropped);
    return () => {
      window.removeEventListener('dragover', keep);
      window.removeEventListener('drop', dropped);
    };
  }, []);

  if (moving !== undefined) {
    const share = moving.total === 0 ? 1 : moving.sent / moving.total;
    const pace = moving.sent / Math.max(0.001, performance.now() - moving.begun);
    const left = (moving.total - moving.sent) / Math.max(pace, 1e-9) / 1000;
    return (
      <div class="drop sending">
        <strong>{moving.name}</strong>
        <progress aria-label="Upload" max={1} value={share} />
        <span>
          {moving.arrived
            ? 'Received; looking into it …'
            : `${bytes(moving.sent)} of ${bytes(moving.total)}` +
              (share > 0.02 && left > 2 ? `, ${duration(left)} left` : '')}
        </span>
        {moving.arrived ? null : (
          <button type="button" onClick={() => stop.current.abort()}>
            Stop
          </button>
        )}
      </div>
    );
  }
  return (
    <label
      class={over ? 'drop over' : 'drop'}
      onDragEnter={() => setOver(true)}
      onDragLeave={() => setOver(false)}
    >
      <input
        type="file"
        accept={KINDS}
        aria-label="Model file"
        onChange={(event) => {
          const file = event.currentTarget.files?.[0];
          if (file !== undefined) send(file);
        }}
      />
      <strong>
        <span class="with-mouse">Drop a model here</span>
        <span class="with-finger">Choose a model</span>
      </strong>
      <span>
        <span class="with-mouse">or choose a file: </span>GLB, glTF, OBJ, PLY, STL, or a zip with
        its textures
      </span>
      {problem === '' ? null : <em role="alert">{problem}</em>}
    </label>
  );
}
