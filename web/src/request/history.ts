// Undo and redo: the requests before and after the one that is shown.
export interface History<T> {
  past: readonly T[];
  future: readonly T[];
}

const LONGEST = 200;

export const NO_HISTORY: History<never> = { past: [], future: [] };

export function edited<T>(history: History<T>, before: T): History<T> {
  return { past: [...history.past, before].slice(-LONGEST), future: [] };
}

export function undone<T>(history: History<T>, shown: T): [History<T>, T] {
  const before = history.past.at(-1);
  if (before === undefined) return [history, shown];
  return [{ past: history.past.slice(0, -1), future: [shown, ...history.future] }, before];
}

export function redone<T>(history: History<T>, shown: T): [History<T>, T] {
  const after = history.future[0];
  if (after === undefined) return [history, shown];
  return [{ past: [...history.past, shown], future: history.future.slice(1) }, after];
}
