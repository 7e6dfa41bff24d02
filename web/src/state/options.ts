// The options of back ends: each back end keeps its own while another one is chosen.
import type { Backend } from '../service/types';
import { request } from './store';

const kept = new Map<string, Backend>();

// Returns the back end of a kind with the options that the request has, or had, for it.
export function backendOf(kind: string): Backend {
  const shown = request.value?.backend;
  return shown?.kind === kind ? shown : (kept.get(kind) ?? ({ kind } as Backend));
}

export function keepOptions(): void {
  const shown = request.value?.backend;
  if (shown) kept.set(shown.kind, shown);
}

// Another request has its own options.
export function forgetOptions(): void {
  kept.clear();
}
