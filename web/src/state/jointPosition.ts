// The joint position that a person set with the sliders; null: the robot follows the plan.
import { computed, effect, signal } from '@preact/signals';
import { positionAt } from '../plan/samples';
import type { PlanRequest, Robot } from '../service/types';
import { playing, time } from './playback';
import { draft, plan, request, robot, shownPlan } from './store';

const posed = signal<readonly number[] | null>(null);

// Playing, another time, plan or robot lead back to the plan, but not while a waypoint is moved.
effect(() => {
  playing.value;
  time.value;
  plan.value;
  robot.value;
  if (!draft.peek()) posed.value = null;
});

export const isPosed = computed(() => posed.value !== null);

// Puts the robot where a person wants it.
export function pose(position: readonly number[]): void {
  playing.value = false;
  posed.value = position;
}

// Where the robot stands.
export function shownPosition(arm: Robot): readonly number[] {
  if (posed.value) return posed.value;
  return shownPlan.value ? positionAt(shownPlan.value.answer, time.value) : firstPosition(request.value, arm);
}

export const jointPosition = computed(() => (robot.value ? shownPosition(robot.value) : []));

// Where the robot stands while there is no plan: at the first waypoint if that says so, else at zero.
export function firstPosition(shown: PlanRequest | null, arm: Robot): readonly number[] {
  const first = shown?.waypoints[0];
  const isOfArm = first?.kind === 'joint' && first.position.length === arm.joints.length;
  return isOfArm ? first.position : arm.joints.map(() => 0);
}
