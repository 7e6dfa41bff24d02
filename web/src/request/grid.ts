// A grid of requests: fields that take one value after the other, in every combination.
import type { Grid, PlanRequest } from '../service/types';
import { alone } from './cells';
import { setAt } from './edits';

export interface Varied {
  pointer: string; // JSON pointer into the request
  values: string; // as a person writes them: JSON values with commas between, with or without brackets
}

// The values of a field; null: they cannot be read, or there are none.
export function valuesOf(text: string): unknown[] | null {
  const list = text.trim().startsWith('[') ? text : `[${text}]`;
  try {
    const values: unknown = JSON.parse(list);
    return Array.isArray(values) && values.length > 0 ? values : null;
  } catch {
    const words = text.split(',').map((word) => word.trim());
    return words.every((word) => /^[A-Za-z_]\w*$/.test(word)) ? words : null;
  }
}

// How many requests a grid has; null: a row of it cannot be read.
export function sizeOf(rows: readonly Varied[]): number | null {
  let size = 1;
  for (const { pointer, values } of rows) {
    const count = valuesOf(values)?.length;
    if (!/^(\/[^/]*)+$/.test(pointer) || count === undefined) return null;
    size *= count;
  }
  return size;
}

// The grid as the service takes it: in its template the fields are there already, with their first values. A pointer that
// leads nowhere is returned instead.
export function gridOf(
  request: PlanRequest,
  rows: readonly Varied[],
): { grid: Grid; wrong?: undefined } | { grid?: undefined; wrong: string } {
  const vary = rows.map(({ pointer, values }) => ({ pointer, values: valuesOf(values) ?? [] }));
  const template = structuredClone(alone(request));
  for (const { pointer, values } of vary) if (!setAt(template, pointer, values[0])) return { wrong: pointer };
  return { grid: { template, vary } };
}
