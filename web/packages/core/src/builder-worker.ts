/** The worker's side of `WorkerBuilder`. */

import { answer, type BuildRequest } from './builder.js';

interface WorkerScope {
  onmessage: ((event: MessageEvent<BuildRequest>) => void) | null;
  postMessage(message: unknown, transfer: Transferable[]): void;
}

const scope = globalThis as unknown as WorkerScope;

scope.onmessage = ({ data }) => {
  const { reply, transfer } = answer(data);
  scope.postMessage(reply, transfer);
};
