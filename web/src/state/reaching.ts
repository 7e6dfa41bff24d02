// Whether a pose that is dragged can be reached, asked of the service while the hand moves.
import { signal } from '@preact/signals';
import type { Pose, PositionCollision, Solution } from '../service/types';
import { waysTo } from './inverse';
import { request, robot, selected } from './store';

const PAUSE = 40; // ms between two questions

// Where the arm would stand, in how many ways, at how many of them nothing is in the way (null: nobody looked), and what is
// in the way of this one; or how far away the nearest is, m.
export type Reach =
  | { kind: 'reached'; position: readonly number[]; solutions: number; free: number | null; collision: PositionCollision | null }
  | { kind: 'missed'; position: readonly number[]; distance: number };

export const reach = signal<Reach | null>(null);

type Listener = (position: readonly number[]) => void;

let waiting: { pose: Pose; reference: readonly number[]; onReached: Listener } | null = null;
let endings = 0;
let isAsking = false;

// Asks about a pose; of those that come while an answer is awaited, the last is asked about next. The joint position near
// the reference that reaches the pose is handed on.
export function askReach(pose: Pose, reference: readonly number[], onReached: Listener): void {
  waiting = { pose, reference, onReached };
  if (!isAsking) void ask();
}

// Shows one of the ways to stand.
export function showReach({ position, collision }: Solution, all: readonly Solution[]): void {
  reach.value = { kind: 'reached', position, solutions: all.length, free: freeOf(all), collision: collision ?? null };
}

export function endReach(): void {
  waiting = null;
  endings += 1;
  reach.value = null;
}

// The number of ways at which nothing is in the way; null: nobody looked.
export function freeOf(all: readonly Solution[]): number | null {
  const looked = all.filter(({ collision }) => collision !== undefined);
  return looked.length > 0 ? looked.filter(({ collision }) => collision === null).length : null;
}

async function ask(): Promise<void> {
  isAsking = true;
  while (waiting && request.value && robot.value) {
    const { pose, reference, onReached } = waiting;
    waiting = null;
    const begun = endings;
    const { answer } = await waysTo(pose, request.value, selected.value, robot.value, reference);
    const [best] = answer?.solutions ?? [];
    if (begun !== endings) continue; // nobody waits for it any more
    if (answer && best) {
      onReached(best.position);
      showReach(best, answer.solutions);
    } else if (answer?.nearest) {
      reach.value = { kind: 'missed', position: answer.nearest.position, distance: answer.nearest.position_error };
    }
    await new Promise((resolve) => setTimeout(resolve, PAUSE));
  }
  isAsking = false;
}
