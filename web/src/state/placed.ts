// Where things around the robot are as it is shown. It computes with three: the stage loads it, the first view does not.
import { computed } from '@preact/signals';
import { Matrix4 } from 'three';
import { nameOf } from '../request/cells';
import { handledNames } from '../request/handled';
import { placedAt, stretchesOf } from '../scene/carried';
import type { Carrier } from '../scene/carried';
import { placedOf } from '../scene/objects';
import type { Placed } from '../scene/objects';
import type { PlanRequest } from '../service/types';
import { meetingsOf } from './cells';
import { otherRobots, seenFrom } from './others';
import { time } from './playback';
import { robot, shownPlan } from './store';
import { nearest, setting } from './surroundings';

// What other robots of the cell carry from the start on is numbered with their numbers.
const placed = computed(() => {
  if (!robot.value) return [];
  const held = otherRobots.value.flatMap((other, i) => {
    const { scene: around, tool, mounting } = other.request;
    const attached = typeof around === 'object' ? around?.attached : undefined;
    return attached ? placedOf({ scene: { attached }, tool, mounting }, other.robot, i + 1) : [];
  });
  return [...placedOf(setting.value, robot.value), ...held];
});

const carriers = computed((): readonly Carrier[] => {
  const [shown, arm] = [shownPlan.value, robot.value];
  if (!shown || !arm) return [];
  const meetings = (request: PlanRequest): ReadonlyMap<number, number> => meetingsOf(shown.cell, nameOf(request));
  const own = { ...shown, robot: arm, base: new Matrix4(), meetings: meetings(shown.request) };
  const others = otherRobots.value.flatMap((other) => {
    const { request, answer, robot } = other;
    return answer ? [{ request, answer, robot, base: seenFrom(arm, shown.request, other), meetings: meetings(request) }] : [];
  });
  return [own, ...others];
});

// The names of what is taken or put down on the way, as a text that is equal while they are.
const handled = computed(() => JSON.stringify(carriers.value.flatMap(({ request }) => handledNames(request))));

// What stands still at all times, and what moves by itself, or with the robot at some.
const parted = computed(() => {
  const names = JSON.parse(handled.value) as string[];
  const isMovable = ({ id, after, at }: Placed): boolean => after !== null || at !== undefined || names.includes(id);
  return { standing: placed.value.filter((one) => !isMovable(one)), movable: placed.value.filter(isMovable) };
});

export const standing = computed(() => parted.value.standing);

const stretches = computed(() => stretchesOf(parted.value.movable, carriers.value));

// Where what moves is at the time that is shown.
export const movable = computed(() => placedAt(stretches.value, time.value));

// Where things are when that pair comes nearest.
export const placedAtPair = computed(() => [...standing.value, ...placedAt(stretches.value, nearest.value?.clearance.time ?? 0)]);
