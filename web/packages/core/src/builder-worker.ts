/** The worker's side of `WorkerBuilder`. */

import { Answerer, type BuildRequest } from './builder.js';

interface WorkerScope {
  onmessage: ((event: MessageEvent<BuildRequest>) => void) | null;
  postMessage(message: unknown, transfer: Transferable[]): void;
}

const scope = globalThis as unknown as WorkerScope;

const answerer = new Answerer();

scope.onmessage = ({ data }) => {
  const { reply, transfer } = answerer.answer(data);
  scope.postMessage(reply, transfer);
};
