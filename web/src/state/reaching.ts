// Whether a pose that is dragged can be reached, asked of the service while the hand moves.
import { signal } from '@preact/signals';
import type { Pose, PositionCollision, Solution } from '../service/types';
import { hindranceAt, waysTo } from './inverse';
import { request, robot, selected } from './store';

const PAUSE = 40; // ms between two questions

// Where the arm would stand, in how many ways, at how many of them nothing is in the way (null: nobody looked), and what is
// in the way of this one; or how far away the nearest is, m. A robot moved joint by joint needs no way.
export type Reach =
  | { kind: 'reached'; position: readonly number[]; solutions: number; free: number | null; collision: PositionCollision | null }
  | { kind: 'hindered'; position: readonly number[]; collision: PositionCollision }
  | { kind: 'missed'; position: readonly number[]; distance: number };

export const reach = signal<Reach | null>(null);

type Listener = (position: readonly number[]) => void;
type Choose = (all: readonly Solution[], reference: readonly number[]) => Solution | undefined;

let waiting: (() => Promise<Reach | null>) | null = null;
let isRunning = false;
let endings = 0;

// Asks about a pose. The joint position that reaches it is handed on: the first, unless another is chosen.
export function askReach(pose: Pose, reference: readonly number[], onReached: Listener, choose: Choose = ([first]) => first): void {
  ask(async () => {
    const [shown, arm, begun] = [request.value, robot.value, endings];
    if (!shown || !arm) return null;
    const { answer } = await waysTo(pose, shown, selected.value, arm, reference);
    if (begun !== endings || !answer) return null;
    const best = choose(answer.solutions, reference);
    if (best) onReached(best.position);
    if (best) return reached(best, answer.solutions);
    const { nearest } = answer;
    return nearest ? { kind: 'missed', position: nearest.position, distance: nearest.position_error } : null;
  });
}

// Asks what is in the way at a joint position, where the request has it looked at.
export function askHindrance(position: readonly number[]): void {
  ask(async () => {
    const [shown, arm] = [request.value, robot.value];
    if (!shown || !arm || !(shown.scene ?? shown.self_collision)) return null;
    const collision = await hindranceAt(position, shown, selected.value, arm);
    return collision && { kind: 'hindered', position, collision };
  });
}

// Of the questions that come while an answer is awaited, the last is asked next.
function ask(question: () => Promise<Reach | null>): void {
  waiting = question;
  if (!isRunning) void run();
}

async function run(): Promise<void> {
  isRunning = true;
  while (waiting) {
    const [question, begun] = [waiting, endings];
    waiting = null;
    const found = await question();
    if (begun !== endings) continue; // nobody waits for it any more
    reach.value = found;
    await new Promise((resolve) => setTimeout(resolve, PAUSE));
  }
  isRunning = false;
}

export function isAsking(): boolean {
  return isRunning;
}

// Shows one of the ways to stand.
export function showReach(solution: Solution, all: readonly Solution[]): void {
  reach.value = reached(solution, all);
}

function reached({ position, collision }: Solution, all: readonly Solution[]): Reach {
  return { kind: 'reached', position, solutions: all.length, free: freeOf(all), collision: collision ?? null };
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
