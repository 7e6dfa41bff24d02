// What people do: each changes the request, and a changed request is planned.
import { batch } from '@preact/signals';
import type { LinkShape, PlanRequest, Robot, Waypoint } from '../service/types';
import { jointWaypoint } from '../request/edits';
import type { Example } from '../request/examples';
import { edited, redone, undone } from '../request/history';
import { client, outcome } from '../service/client';
import { compared, history, links, notice, problem, request, robot, selected } from './store';
import { planSoon } from './planning';
import { playing, time } from './playback';
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

// Makes what is shown fit the request: its robot, a waypoint that there is, a plan.
export async function settle(): Promise<void> {
  const shown = request.value;
  if (!shown) return;
  selected.value = Math.min(selected.value, shown.waypoints.length - 1);
  if (robot.value?.id !== shown.robot) {
    const found = await outcome(client.GET('/v1/robots/{id}', { params: { path: { id: shown.robot } } }));
    if (request.value !== shown) return;
    if (!found.answer) {
      problem.value = found.problem;
      return;
    }
    const shapes = await shapesOf(found.answer);
    if (request.value !== shown) return;
    batch(() => {
      playing.value = false;
      if (robot.value) time.value = 0;
      robot.value = found.answer;
      links.value = shapes;
    });
  }
  planSoon();
  if (shown.scene && links.value.length === 0) links.value = await linksOf(robot.value!);
}

// The shapes that can collide, of a robot that has none to look at; without any it is drawn as sticks.
async function shapesOf(arm: Robot): Promise<readonly LinkShape[]> {
  return arm.geometry?.length ? [] : linksOf(arm);
}

async function linksOf(arm: Robot): Promise<readonly LinkShape[]> {
  const found = await outcome(client.GET('/v1/robots/{id}/geometry', { params: { path: { id: arm.id } } }));
  return typeof found.answer === 'object' ? found.answer.shapes : []; // it could be glTF, had we asked for it
}

export async function chooseExample(example: Example): Promise<void> {
  const loaded = await example.load();
  batch(() => {
    playing.value = false;
    selected.value = 0;
    time.value = 0;
  });
  show(structuredClone(loaded), texts.said.example(example.name.replaceAll('_', ' ')));
}

// Another robot gets a first motion of its own: from its middle, with each joint a little further.
export async function chooseRobot(id: string): Promise<void> {
  const found = await outcome(client.GET('/v1/robots/{id}', { params: { path: { id } } }));
  if (!found.answer) {
    problem.value = found.problem;
    return;
  }
  playing.value = false;
  time.value = 0;
  show({ robot: id, waypoints: firstMotion(found.answer), backend: request.value?.backend }, texts.said.robot(id));
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
