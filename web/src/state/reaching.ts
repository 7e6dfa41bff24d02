// Whether a pose that is dragged can be reached, asked of the service while the hand moves.
import { signal } from '@preact/signals';
import { plannedWaypoint } from '../plan/samples';
import { toolAt } from '../plan/tools';
import type { Pose } from '../service/types';
import { client, outcome } from '../service/client';
import { request, robot, selected, shownPlan } from './store';

const PAUSE = 40; // ms between two questions

// Where the arm would stand, in how many ways; or how far away the nearest is, m.
export type Reach =
  | { kind: 'reached'; position: readonly number[]; solutions: number }
  | { kind: 'missed'; position: readonly number[]; distance: number };

export const reach = signal<Reach | null>(null);

let waiting: Pose | null = null;
let isAsking = false;

// Asks about a pose; of those that come while an answer is awaited, the last is asked about next.
export function askReach(pose: Pose): void {
  waiting = pose;
  if (!isAsking) void ask();
}

// Shows one of so many ways to stand.
export function showReach(position: readonly number[], solutions: number): void {
  reach.value = { kind: 'reached', position, solutions };
}

export function endReach(): void {
  waiting = null;
  reach.value = null;
}

async function ask(): Promise<void> {
  isAsking = true;
  while (waiting && robot.value) {
    const pose = waiting;
    waiting = null;
    const reference = shownPlan.value ? plannedWaypoint(shownPlan.value.answer, selected.value)?.position : undefined;
    const tool = request.value && toolAt(request.value, selected.value);
    const body = { robot: robot.value.id, poses: [pose], solutions: 'all' as const, reference, tool };
    const { answer } = await outcome(client.POST('/v1/kinematics/inverse', { body }));
    const result = answer?.results[0];
    const [best] = result?.solutions ?? [];
    if (result && best) reach.value = { kind: 'reached', position: best.position, solutions: result.solutions.length };
    else if (result?.nearest) {
      reach.value = { kind: 'missed', position: result.nearest.position, distance: result.nearest.position_error };
    }
    await new Promise((resolve) => setTimeout(resolve, PAUSE));
  }
  isAsking = false;
}
