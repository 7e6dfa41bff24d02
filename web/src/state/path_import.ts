// A path in a person's file: it is read by the service and shown on the stage before it is added to the request.
import { batch, computed, signal } from '@preact/signals';
import { poseInFrame } from '../request/frames';
import { PATH_FRAME, placesOf, withPath } from '../request/paths';
import { toolPose } from '../robot/tool_pose';
import { client, outcome } from '../service/client';
import type { PathFileRequest, Pose, Problem, Waypoint } from '../service/types';
import { show } from './actions';
import { jointPosition } from './jointPosition';
import { select } from './selection';
import { request, robot } from './store';

type Options = Required<Pick<PathFileRequest, 'units' | 'angle' | 'blend' | 'lift'>> & { at: Pose }; // `at`: of the path's frame, in the world

interface Read {
  waypoints: readonly Waypoint[];
  notes: readonly string[];
}

export const pathFile = signal<{ name: string; text: string } | null>(null);
export const pathOptions = signal<Options>({ units: null, angle: 'deg', blend: null, lift: 0.05, at: { position: [0, 0, 0] } });
export const pathProblem = signal<Problem | null>(null);
export const missed = signal<readonly number[] | null>(null); // waypoints that the tool cannot reach; null: nobody knows yet
export const isReading = signal(false);
const read = signal<Read | null>(null);

// What is shown of the file: its waypoints, and where they are in the base frame.
export const shownPath = computed(() => {
  const [found, shown, arm] = [read.value, request.value, robot.value];
  if (!found || !shown || !arm) return null;
  const placed = withPath(shown, found.waypoints, pathOptions.value.at, false);
  return { ...found, ...placesOf(placed, found.waypoints, arm), missed: missed.value ?? [] };
});

// The axes of the path are those of the base, and its origin is where the tool is.
export async function openPath(file: File): Promise<void> {
  const [shown, arm] = [request.value, robot.value];
  if (!shown || !arm) return;
  const { position } = toolPose(arm, jointPosition.value, shown.tool ?? null);
  const rounded = position.map((value) => Number(value.toFixed(3)));
  const pose: Pose = { position: rounded, orientation: { kind: 'quaternion', xyzw: [0, 0, 0, 1] } };
  const at = shown.frames?.[PATH_FRAME] ?? poseInFrame(pose, 'world', shown, arm);
  const text = await file.text();
  batch(() => {
    pathFile.value = { name: file.name, text };
    pathOptions.value = { ...pathOptions.value, at };
  });
  await readPath();
}

export async function setPathOptions(changes: Partial<Options>): Promise<void> {
  pathOptions.value = { ...pathOptions.value, ...changes };
  await readPath();
}

let questions = 0;

async function readPath(): Promise<void> {
  const [file, arm] = [pathFile.value, robot.value];
  if (!file || !arm) return;
  const asked = (questions += 1);
  const { units, angle, blend, lift } = pathOptions.value;
  isReading.value = true;
  const name = file.name.replace(/\.\w+$/, (suffix) => suffix.toLowerCase()).slice(-MOST_NAME);
  const body = { robot: arm.id, name, text: file.text, units, angle, blend, lift, frame: PATH_FRAME, tool_axis: [0, 0, -1] };
  const found = await outcome(client.POST('/v1/paths/read', { body }));
  if (asked !== questions) return; // a later question has taken its place
  batch(() => {
    isReading.value = false;
    missed.value = null;
    pathProblem.value = found.problem ?? null;
    read.value = found.answer ? { waypoints: found.answer.waypoints as unknown as Waypoint[], notes: found.answer.notes } : null;
  });
  await askReached(asked);
}

const MOST_NAME = 200; // characters that the service takes

async function askReached(asked: number): Promise<void> {
  const [path, shown, arm] = [shownPath.value, request.value, robot.value];
  if (!path || !shown || !arm || path.waypoints.some(({ kind }) => kind !== 'pose')) return;
  const { position } = jointPosition.value.length ? { position: [...jointPosition.value] } : { position: undefined };
  const body = { robot: arm.id, poses: path.poses, solutions: 'best' as const, reference: position, tool: shown.tool };
  const found = await outcome(client.POST('/v1/kinematics/inverse', { body }));
  if (asked !== questions || !found.answer) return;
  missed.value = found.answer.results.flatMap(({ status }, index) => (status === 'solved' ? [] : [index]));
}

// Adds the path behind the waypoints of the request, or in their place.
export function takePath(isAdded: boolean): void {
  const [path, shown] = [read.value, request.value];
  if (!path || !shown) return;
  const first = isAdded ? shown.waypoints.length : 0;
  const next = withPath(shown, path.waypoints, pathOptions.value.at, isAdded);
  closePath();
  show(next);
  select(first);
}

export function closePath(): void {
  questions += 1;
  batch(() => {
    isReading.value = false;
    pathFile.value = read.value = pathProblem.value = missed.value = null;
  });
}
