// What the page shows, as signals; only the functions of this folder change them.
import { computed, signal } from '@preact/signals';
import type {
  BackendDescription,
  CellAnswer,
  ComparedBackend,
  LinkShape,
  PlanAnswer,
  PlanRequest,
  Problem,
  Robot,
  RobotSummary,
  Waypoint,
} from '../service/types';
import type { History } from '../request/history';
import { NO_HISTORY } from '../request/history';

export interface Planned {
  request: PlanRequest;
  answer: PlanAnswer;
  took: number; // s, as the caller waited
  cell?: CellAnswer; // with the plans of all robots, of which `answer` is that of the robot that is shown
}

export interface Compared extends ComparedBackend {
  took: number | null; // s, of the service's processes
}

export interface Banner {
  text: string;
  link?: string; // to be copied by hand
}

export const robots = signal<readonly RobotSummary[]>([]);
export const backends = signal<readonly BackendDescription[]>([]);
export const request = signal<PlanRequest | null>(null);
export const history = signal<History<PlanRequest>>(NO_HISTORY);
export const robot = signal<Robot | null>(null);
export const links = signal<readonly LinkShape[]>([]); // that can collide: of robots that are drawn by them, and in scenes
export const plan = signal<Planned | null>(null);
export const problem = signal<Problem | null>(null);
export const planning = signal(false);
export const waited = signal(0); // whole seconds since this planning began
export const compared = signal<readonly Compared[] | null>(null);
export const comparing = signal(false);
export const selected = signal(0);
export const chosenObject = signal<string | null>(null); // of the scene: the handles are at it, not at the waypoint
export const draft = signal<Waypoint | null>(null); // the chosen waypoint while it is moved
export const notice = signal(''); // the last thing that happened, for those who listen
export const banner = signal<Banner | null>(null); // what everybody is to see until it is closed

// A plan is shown only for the robot that it was made for.
export const shownPlan = computed(() => (plan.value?.answer.robot === robot.value?.id ? plan.value : null));
// The index of the robot of the cell that a refusal is about; null: none or all of them.
export const refusedRobot = computed(() => {
  const { robot: index, errors } = problem.value ?? {};
  const [, ofField] = /^\/robots\/(\d+)/.exec(errors?.[0]?.pointer ?? '') ?? [];
  return index ?? (ofField === undefined ? null : Number(ofField));
});

// The robots of the cell that touch, in a refusal of two of them; else the one that it is about.
export const refusedRobots = computed((): readonly number[] => {
  const [cell, index] = [request.value?.cell, refusedRobot.value];
  if (index !== null || !cell) return index === null ? [] : [index];
  const names = cell.others.map(({ name }) => name).toSpliced(cell.index, 0, cell.name);
  return (problem.value?.pair ?? []).map((body) => names.indexOf(body.split('/')[0]!)).filter((found) => found >= 0);
});

// The refusal, unless it is about another robot than the one that is shown. Of two that touch, the joint position is that of
// the first, and the point is in the world.
export const ownProblem = computed<Problem | null>(() => {
  const [index, [first]] = [request.value?.cell?.index, refusedRobots.value];
  if (index === undefined || first === undefined) return problem.value;
  if (first !== index || !problem.value) return null;
  return refusedRobot.value === null ? { ...problem.value, point: null } : problem.value;
});

export const isStale = computed(() => plan.value !== null && plan.value.request !== request.value);
