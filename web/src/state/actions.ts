// What people do: each changes the request, and a changed request is planned.
import { batch } from '@preact/signals';
import type { LinkShape, PlanRequest, Pose, Robot, Waypoint } from '../service/types';
import { inserted, jointWaypoint, poseWaypoint, withoutEmpty } from '../request/edits';
import type { Example } from '../request/examples';
import { edited, redone, undone } from '../request/history';
import { toolAt } from '../plan/tools';
import { client, isAway, outcome } from '../service/client';
import { describe } from './described';
import { backendOf, forgetOptions, keepOptions } from './options';
import { planSoon, stopPlanning } from './planning';
import { isAnchored, playing, time } from './playback';
import { addExampleRobot } from './robots';
import { select } from './selection';
import { linksOf, showLinks } from './shapes';
import { banner, compared, history, links, notice, problem, request, robot, selected } from './store';
import { texts } from '../texts';

// Shows another request; what was shown before can be had back.
export function show(next: PlanRequest, said = ''): void {
  const before = request.value;
  if (before === next) return;
  batch(() => {
    if (before) history.value = edited(history.value, before);
    request.value = next;
    compared.value = null;
    notice.value = said;
  });
  void settle();
}

export function undo(): void {
  step(undone, texts.said.undone);
}

export function redo(): void {
  step(redone, texts.said.redone);
}

function step(turn: typeof undone, said: string): void {
  if (!request.value) return;
  const [turned, next] = turn(history.value, request.value);
  if (next === request.value) return;
  batch(() => {
    history.value = turned;
    request.value = next;
    compared.value = null;
    notice.value = said;
  });
  void settle();
}

// Makes what is shown fit the request: its robot, a waypoint that there is, a plan. A robot that there is not is not shown.
export async function settle(): Promise<void> {
  const shown = request.value;
  if (!shown) return;
  stopPlanning();
  selected.value = Math.min(selected.value, shown.waypoints.length - 1);
  const arm = robot.value?.id === shown.robot ? robot.value : await loadRobot(shown);
  if (!arm || request.value !== shown) return;
  await describe(shown.cell?.others.map((other) => other.robot) ?? []);
  if (request.value !== shown) return;
  planSoon();
  if (shown.scene && links.value.length === 0) await showLinks(arm);
}

// Shows the robot of a request; null: there is none, or another request has taken its place.
async function loadRobot(shown: PlanRequest): Promise<Robot | null> {
  const found = await outcome(client.GET('/v1/robots/{id}', { params: { path: { id: shown.robot } } }));
  const shapes = found.answer ? await shapesOf(found.answer) : [];
  if (request.value !== shown) return null;
  batch(() => {
    playing.value = false;
    if (robot.value) time.value = 0;
    robot.value = found.answer ?? null;
    links.value = shapes;
    if (found.problem) problem.value = found.problem;
  });
  return found.answer ?? null;
}

// The shapes that can collide, of a robot that has none to look at; without any it is drawn as sticks.
async function shapesOf(arm: Robot): Promise<readonly LinkShape[]> {
  return arm.geometry?.length ? [] : linksOf(arm);
}

let chosenExample = '';

// Shows an example; a robot that only its request knows is added to the service first.
export async function chooseExample(example: Example): Promise<void> {
  chosenExample = example.name;
  const loaded = await example.load().catch(() => null);
  if (!loaded) {
    isAway.value = true; // examples are files of the service
    return;
  }
  const added = await addExampleRobot(loaded.robot);
  if (chosenExample !== example.name) return;
  openRequest(structuredClone(loaded), texts.said.example(example.name.replaceAll('_', ' ')));
  if (added)
    banner.value = { text: added === 'added' ? texts.said.robotAdded(loaded.robot) : texts.said.robotNotAdded(loaded.robot, added.detail) };
}

// Shows a request that is no edit of the one before.
export function openRequest(next: PlanRequest, said = '', from = 0): void {
  forgetOptions();
  batch(() => {
    playing.value = false;
    selected.value = 0;
    isAnchored.value = false;
    time.value = from;
  });
  show(next, said);
}

let chosenRobot = '';

// Another robot gets a first motion of its own: from its middle, with each joint a little further.
export async function chooseRobot(id: string): Promise<void> {
  chosenRobot = id;
  const found = await outcome(client.GET('/v1/robots/{id}', { params: { path: { id } } }));
  if (chosenRobot !== id) return;
  if (!found.answer) {
    problem.value = found.problem;
    return;
  }
  playing.value = false;
  time.value = 0;
  const before = request.value;
  const { mounting, scene, frames, deadline, cell } = before?.cell ? before : {}; // a robot of a cell has the place of the one before
  const place = { mounting, scene, frames, deadline, cell };
  const next = { robot: id, waypoints: firstMotion(found.answer), backend: before?.backend, ...place };
  show(withoutEmpty(next), texts.said.robot(id));
}

export function firstMotion(arm: Robot): Waypoint[] {
  const middle = arm.joints.map(({ lower, upper }) => (lower === null || upper === null ? 0 : (lower + upper) / 2));
  const home = Object.values(arm.named_positions)[0] ?? middle;
  const away = arm.joints.map(({ kind, lower, upper }, joint) => {
    const step = kind === 'prismatic' ? 0.1 : 0.5;
    const next = home[joint]! + (joint % 2 === 0 ? step : -step);
    return Math.min(Math.max(next, lower ?? -Infinity), upper ?? Infinity);
  });
  return [jointWaypoint(home), jointWaypoint(away)];
}

export function chooseBackend(kind: string): void {
  if (!request.value) return;
  keepOptions();
  show({ ...request.value, backend: backendOf(kind) });
}

export function insert(waypoint: Waypoint): void {
  if (!request.value) return;
  const at = selected.value + 1;
  show(inserted(request.value, at - 1, waypoint));
  select(at);
}

// Inserts the pose that the tool has where the robot stands: the tool that is in force there. External axes stay where they
// are.
export async function insertPose(position: readonly number[]): Promise<void> {
  const [shown, arm] = [request.value, robot.value];
  if (!shown || !arm) return;
  const body = { robot: arm.id, positions: [[...position]], tool: toolAt(shown, selected.value) };
  const found = await outcome(client.POST('/v1/kinematics/forward', { body }));
  if (request.value !== shown) return;
  if (!found.answer) {
    problem.value = found.problem;
    return;
  }
  const external = arm.external_axes.map((name): [string, number] => [name, position[arm.joint_names.indexOf(name)]!]);
  const pose = poseWaypoint(found.answer.poses[0] as Pose);
  insert(external.length > 0 ? ({ ...pose, external: Object.fromEntries(external) } as Waypoint) : pose);
}
