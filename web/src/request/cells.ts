// Cells: two to four robots in one world. The page shows one of them as a request by itself, which carries the rest of the cell
// along: what edits that request edits the cell.
import type { CellMember, CellRequest, CellRules, PlanRequest, Remedy, Scene } from '../service/types';
import { remedied, withoutEmpty } from './edits';

export const MOST_ROBOTS = 4; // of the service

const BESIDE = 1.5; // m, from the base of a robot to that of the next one

// What the service plans: the cell of a robot in one, else the request.
export function documentOf(request: PlanRequest): PlanRequest | CellRequest {
  return cellOf(request) ?? request;
}

// The request without the other robots.
export function alone(request: PlanRequest): PlanRequest {
  return withoutEmpty({ ...request, cell: undefined });
}

// The cell that a request is a robot of; null: it is by itself.
export function cellOf(request: PlanRequest): CellRequest | null {
  const { cell, scene, frames, deadline, ...own } = request;
  if (!cell) return null;
  const { attached, allowed_pairs, ...around } = typeof scene === 'object' && scene ? scene : ({ ...cell.held } as Scene);
  const member = withoutEmpty({ name: cell.name, ...own, picture: undefined, repeat: undefined, attached, allowed_pairs }) as CellMember;
  const common = typeof scene === 'string' ? scene : Object.keys(withoutEmpty(around)).length > 0 ? around : undefined;
  return withoutEmpty({ robots: cell.others.toSpliced(cell.index, 0, member), scene: common, frames, deadline, ...cell.rules });
}

// The request of a robot by itself with its waits, which plans its trajectory in the cell. Waits are at waypoints where it stops.
export function withWaits(request: PlanRequest, waits: readonly number[]): PlanRequest {
  const waypoints = request.waypoints.map((waypoint, index) => {
    const wait = waits[index] ?? 0;
    if (wait === 0 || waypoint.kind === 'any_of') return waypoint;
    return { ...waypoint, dwell: (waypoint.dwell ?? 0) + wait };
  });
  return { ...alone(request), waypoints };
}

// A robot of a cell as the request that is shown.
export function shownOf({ robots, scene, frames, deadline, ...rules }: CellRequest, index: number): PlanRequest {
  const { name, attached, allowed_pairs, ...own } = robots[index]!;
  const held = withoutEmpty({ attached, allowed_pairs });
  const isKept = typeof scene === 'string';
  const around = isKept ? scene : withoutEmpty({ ...scene, ...held });
  return withoutEmpty({
    ...own,
    scene: isKept || scene || Object.keys(held).length > 0 ? around : undefined,
    frames,
    deadline,
    cell: { name, index, others: robots.toSpliced(index, 1), ...(isKept && { held }), rules },
  });
}

// Applies remedies, whose pointers lead into the cell.
export function remediedCell(request: PlanRequest, remedies: readonly Remedy[]): PlanRequest {
  const cell = cellOf(request);
  return cell ? shownOf(remedied(cell, remedies), request.cell!.index) : remedied(request, remedies);
}

// The requests of all robots of a cell, in its order; of a request by itself, that one.
export function robotsOf(request: PlanRequest): PlanRequest[] {
  const cell = cellOf(request);
  return cell ? cell.robots.map((_, index) => shownOf(cell, index)) : [request];
}

// The same cell with another of its robots shown.
export function showing(request: PlanRequest, index: number): PlanRequest {
  const cell = cellOf(request);
  return cell?.robots[index] ? shownOf(cell, index) : request;
}

export function nameOf({ cell, robot }: PlanRequest): string {
  return cell?.name ?? robot;
}

// The cell with one more robot, which is shown: like another request, with its base beside that of the last robot.
export function withRobot(request: PlanRequest, like: PlanRequest = request): PlanRequest {
  const cell = cellOf(request) ?? { ...bare(request), robots: [memberOf(request, [])] };
  const [x = 0, y = 0, z = 0] = cell.robots.at(-1)!.mounting?.position ?? [];
  const mounting = { ...(like.mounting ?? { orientation: UPRIGHT }), position: [x + BESIDE, y, z] };
  const added = memberOf(
    { ...like, mounting },
    cell.robots.map(({ name }) => name),
  );
  return shownOf({ ...cell, robots: [...cell.robots, added] }, cell.robots.length);
}

const UPRIGHT = { kind: 'quaternion' as const, xyzw: [0, 0, 0, 1] };

// What is common to all robots of a cell that begins with a request.
function bare({ scene, frames, deadline }: PlanRequest): Partial<CellRequest> {
  if (!scene || typeof scene === 'string') return withoutEmpty({ scene, frames, deadline });
  return withoutEmpty({ scene: withoutEmpty({ ...scene, attached: undefined, allowed_pairs: undefined }), frames, deadline });
}

function memberOf(request: PlanRequest, taken: readonly string[]): CellMember {
  let [name, number] = [request.robot, 2];
  while (taken.includes(name)) name = `${request.robot}_${number++}`;
  const single = alone(request);
  return cellOf({ ...single, cell: { name, index: 0, others: [], rules: {} } })!.robots[0]!;
}

// The cell without the robot that is shown; the last one is by itself.
export function withoutRobot(request: PlanRequest): PlanRequest {
  const cell = cellOf(request);
  if (!cell) return request;
  const rest = { ...cell, robots: cell.robots.toSpliced(request.cell!.index, 1) };
  const next = shownOf(rest, Math.max(0, request.cell!.index - 1));
  return rest.robots.length > 1 ? next : alone(next);
}

export function withRules(request: PlanRequest, changes: CellRules): PlanRequest {
  return request.cell ? { ...request, cell: { ...request.cell, rules: withoutEmpty({ ...request.cell.rules, ...changes }) } } : request;
}

// Another name for the robot that is shown, also in pairs that may touch; null: another robot has it.
export function withName(request: PlanRequest, name: string): PlanRequest | null {
  const { cell } = request;
  if (!cell || name === '' || cell.others.some((other) => other.name === name)) return null;
  const swap = (body: string): string => (body.startsWith(`${cell.name}/`) ? name + body.slice(cell.name.length) : body);
  const allowed_pairs = cell.rules.allowed_pairs?.map((pair) => pair.map(swap));
  return { ...request, cell: { ...cell, name, rules: withoutEmpty({ ...cell.rules, allowed_pairs }) } };
}

// The names of waypoints that several robots have, in the order of the first robot with each.
export function sharedNames(request: PlanRequest): string[] {
  const lists = robotsOf(request).map(({ waypoints }) => [...new Set(waypoints.flatMap(({ name }) => name ?? []))]);
  const all = [...new Set(lists.flat())];
  return all.filter((name) => lists.filter((names) => names.includes(name)).length > 1);
}

// The cell in which robots meet, or no longer meet, at waypoints of a name.
export function withMeeting(request: PlanRequest, name: string, meets: boolean): PlanRequest {
  const before = request.cell?.rules.meetings ?? [];
  const others = before.filter((other) => other !== name);
  const order = sharedNames(request);
  const meetings = meets ? [...others, name].sort((a, b) => order.indexOf(a) - order.indexOf(b)) : others;
  return withRules(request, { meetings: meetings.length > 0 ? meetings : undefined });
}
