// Edits of a request: each returns a new one and leaves the old one as it is, so that undo is a list of requests.
import type { JointWaypoint, PlanRequest, Pose, Remedy, Waypoint } from '../service/types';

export function withWaypoint(request: PlanRequest, index: number, changes: object): PlanRequest {
  const waypoints = request.waypoints.map((waypoint, i) => (i === index ? withoutEmpty({ ...waypoint, ...changes }) : waypoint));
  return { ...request, waypoints };
}

// Fields that are undefined go: they are what the service takes by default.
export function withoutEmpty<T extends object>(edited: T): T {
  return Object.fromEntries(Object.entries(edited).filter(([, value]) => value !== undefined)) as T;
}

export function inserted(request: PlanRequest, after: number, waypoint: Waypoint): PlanRequest {
  return reordered(request, indices(request).toSpliced(after + 1, 0, waypoint));
}

// A plan needs two waypoints: the last two stay.
export function removed(request: PlanRequest, index: number): PlanRequest {
  if (request.waypoints.length <= 2) return request;
  return reordered(request, indices(request).toSpliced(index, 1));
}

export function moved(request: PlanRequest, from: number, to: number): PlanRequest {
  if (to < 0 || to >= request.waypoints.length) return request;
  return reordered(request, indices(request).toSpliced(from, 1).toSpliced(to, 0, from));
}

function indices({ waypoints }: PlanRequest): (number | Waypoint)[] {
  return waypoints.map((_, index) => index);
}

// Puts waypoints in another order, by their indices or new; actions at a waypoint go with it.
export function reordered(request: PlanRequest, order: readonly (number | Waypoint)[]): PlanRequest {
  const waypoints = order.map((one) => (typeof one === 'number' ? request.waypoints[one]! : one));
  const actions = request.actions?.flatMap((action) => {
    const { waypoint } = action.at;
    if (waypoint === undefined || waypoint === null) return [action];
    const to = order.indexOf(waypoint);
    return to < 0 ? [] : [{ ...action, at: { ...action.at, waypoint: to } }];
  });
  return { ...request, waypoints, ...(actions && { actions }) };
}

export function jointWaypoint(position: readonly number[]): JointWaypoint {
  return { kind: 'joint', position: position.map((value) => Number(value.toFixed(6))) };
}

export function poseWaypoint(pose: Pose): Waypoint {
  return { kind: 'pose', pose };
}

// Applies remedies that belong together; `change` is a JSON pointer (RFC 6901) into the request.
export function remedied<T>(request: T, remedies: readonly Remedy[]): T {
  const changed = structuredClone(request);
  for (const { change, value } of remedies) setAt(changed, change, value);
  return changed;
}

// Sets the value at a JSON pointer; false: there is no such place, as under a number or a text.
export function setAt(document: unknown, pointer: string, value: unknown): boolean {
  const keys = pointer
    .split('/')
    .slice(1)
    .map((key) => key.replaceAll('~1', '/').replaceAll('~0', '~'));
  const last = keys.pop();
  if (last === undefined) throw new Error('the document itself is not replaced');
  let node: unknown = document;
  for (const key of keys) {
    if (!isWritable(node, key)) return false;
    node[key] ??= {};
    node = node[key];
  }
  if (!isWritable(node, last)) return false;
  node[last] = value;
  return true;
}

// Whether a value can have a field of this name; a list has no other than its indices and the next one.
function isWritable(node: unknown, key: string): node is Record<string, unknown> {
  if (typeof node !== 'object' || node === null || key === '__proto__') return false;
  return !Array.isArray(node) || (/^(0|[1-9]\d*)$/.test(key) && Number(key) <= node.length);
}

export interface Way {
  kind: 'durations' | 'limits' | 'payload' | 'other';
  remedies: Remedy[];
}

// Longer durations, wider limits and a lighter payload are each a way by itself, whose changes belong together.
export function waysOf(remedies: readonly Remedy[]): Way[] {
  const ways: Way[] = [];
  for (const remedy of remedies) {
    const kind = kindOf(remedy.change);
    const same = kind === 'other' ? undefined : ways.find((way) => way.kind === kind);
    if (same) same.remedies.push(remedy);
    else ways.push({ kind, remedies: [remedy] });
  }
  return ways;
}

function kindOf(pointer: string): Way['kind'] {
  if (/(^|\/)(minimum_)?duration$/.test(pointer)) return 'durations';
  if (pointer.includes('/limits')) return 'limits';
  return pointer.includes('/payload') ? 'payload' : 'other';
}
