// A batch: sent as a grid of the request that is shown, or opened by its id; followed by server-sent events.
import { batch as together, signal } from '@preact/signals';
import { gridOf } from '../request/grid';
import type { Varied } from '../request/grid';
import { client, outcome } from '../service/client';
import { listen } from '../service/events';
import type { Batch, BatchEntry, Problem } from '../service/types';
import { request } from './store';

export const shownBatch = signal<Batch | null>(null);
export const batchProblem = signal<Problem | null>(null);
export const batches = signal<readonly BatchEntry[]>([]);
export const reasons = signal<Readonly<Record<string, string>>>({}); // what one problem of each code says

let following = new AbortController();

export async function sendGrid(rows: readonly Varied[]): Promise<void> {
  if (!request.value) return;
  const { grid } = gridOf(request.value, rows);
  if (!grid) return;
  const found = await outcome(client.POST('/v1/batches', { body: { grid } }));
  if (found.answer) await openBatch(found.answer.id);
  else batchProblem.value = found.problem;
}

export async function openBatch(id: string): Promise<void> {
  following.abort();
  following = new AbortController();
  const { signal: stop } = following;
  reasons.value = {};
  const found = await lookedAt(id, stop);
  if (!found) return;
  void listBatches();
  void explain(found);
  const refused = await listen(`/v1/batches/${encodeURIComponent(id)}/events`, stop, ({ name, data }) => {
    const now = JSON.parse(data) as Batch;
    shownBatch.value = now;
    void explain(now);
    if (name === 'end') void listBatches();
    return name !== 'end';
  });
  if (refused) await lookedAt(id, stop); // a service that was restarted may not know it any more
}

// Shows the batch, or why it cannot be shown.
async function lookedAt(id: string, stop: AbortSignal): Promise<Batch | null> {
  const found = await outcome(client.GET('/v1/batches/{id}', { params: { path: { id } } }));
  if (stop.aborted) return null;
  together(() => {
    batchProblem.value = found.problem ?? null;
    shownBatch.value = found.answer ?? null;
  });
  return found.answer ?? null;
}

export async function cancelBatch(id: string): Promise<void> {
  const call = client.DELETE('/v1/batches/{id}', { params: { path: { id } } });
  const found = await outcome(call.then(({ error, response }) => ({ data: response.ok || undefined, error })));
  if (found.problem) batchProblem.value = found.problem;
}

// The files that there are of a batch, by the ends of their paths.
export type BatchFile = 'report' | 'results.zip';

// A file of a batch, for those who send an API key, as no link does; null: the service refused it.
export async function fileOf(id: string, file: BatchFile): Promise<Blob | null> {
  const path = `/v1/batches/{id}/${file}` as '/v1/batches/{id}/report';
  const call = client.GET(path, { params: { path: { id } }, parseAs: 'blob' });
  const found = await outcome(call as unknown as Promise<{ data?: Blob; error?: unknown }>);
  batchProblem.value = found.problem ?? null;
  return found.answer ?? null;
}

export async function listBatches(): Promise<void> {
  const found = await outcome(client.GET('/v1/batches', { params: { query: { limit: 20 } } }));
  if (found.answer) batches.value = found.answer.batches;
}

// Asks for one problem of each code, once.
async function explain({ id, summary }: Batch): Promise<void> {
  for (const { code, example } of summary.refusals) {
    if (code in reasons.value) continue;
    reasons.value = { ...reasons.value, [code]: '' };
    const query = { limit: 1, ...(example > 0 ? { cursor: String(example - 1) } : {}) };
    const found = await outcome(client.GET('/v1/batches/{id}/results', { params: { path: { id }, query } }));
    const result = found.answer?.results[0];
    if (shownBatch.value?.id !== id) return;
    if (result?.problem) reasons.value = { ...reasons.value, [code]: result.problem.detail };
    else reasons.value = Object.fromEntries(Object.entries(reasons.value).filter(([known]) => known !== code)); // not there yet
  }
}
