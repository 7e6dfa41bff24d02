// What waypoints take and put down.
import type { PlanRequest } from '../service/types';

// The names of objects that waypoints take or put down.
export function handledNames({ waypoints }: PlanRequest): string[] {
  return waypoints.flatMap(({ attach = [], detach = [] }) => [...detach, ...attach.map(({ id }) => id)]);
}
