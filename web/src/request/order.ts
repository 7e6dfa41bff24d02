// Waypoints in any order: the runs of waypoints that stay together, as tasks of POST /v1/tasks/order.
import type { OrderRequest, PlanRequest, Waypoint } from '../service/types';
import { alone } from './cells';
import { reordered } from './edits';

// The fields of a plan request without a meaning in another order, or without a place in a request of tasks.
// The time budget of an optimisation is none for the order.
export const LEFT_OUT = [
  'waypoints',
  'duration',
  'optimise',
  'time_budget',
  'optimise_iterates',
  'warm_start',
  'actions',
  'picture',
  'repeat',
] as const;

export interface Runs {
  start: number[];
  tasks: number[][];
  end: number[];
}

// The indices of waypoints that stay together: a tool motion or a relative move leads on from the waypoint before. The
// start stays first, and a last waypoint without such a motion stays last.
export function runsOf({ waypoints }: PlanRequest): Runs {
  const runs: number[][] = [];
  waypoints.forEach((waypoint, index) => (index > 0 && leadsOn(waypoint) ? runs.at(-1)!.push(index) : runs.push([index])));
  const [start, ...tasks] = runs as [number[], ...number[][]];
  const end = tasks.length > 0 && tasks.at(-1)!.length === 1 ? tasks.pop()! : [];
  return { start, tasks, end };
}

function leadsOn({ kind, motion }: Waypoint): boolean {
  return kind === 'relative' || !['joint', 'free'].includes(motion?.kind ?? 'joint');
}

export function orderRequest(request: PlanRequest): OrderRequest {
  const { start, tasks, end } = runsOf(request);
  const rest = Object.fromEntries(Object.entries(alone(request)).filter(([name]) => !(LEFT_OUT as readonly string[]).includes(name)));
  const at = (index: number): Waypoint => request.waypoints[index]!;
  const travel = tasks.map(([first]) => at(first!).motion).find((motion) => motion?.kind === 'free') ?? { kind: 'joint' };
  return {
    ...rest,
    start: at(start.at(-1)!),
    ...(end.length > 0 && { end: at(end[0]!) }),
    tasks: tasks.map((run) => ({ waypoints: run.map((index, k) => (k === 0 ? { ...at(index), motion: undefined } : at(index))) })),
    travel,
  } as OrderRequest;
}

// The request with its tasks in another order.
export function inOrder(request: PlanRequest, order: readonly number[]): PlanRequest {
  const { start, tasks, end } = runsOf(request);
  return reordered(request, [...start, ...order.flatMap((task) => tasks[task]!), ...end]);
}
