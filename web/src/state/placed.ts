// Where things around the robot are as it is shown. It computes with three: the stage loads it, the first view does not.
import { computed } from '@preact/signals';
import { handledNames } from '../request/handled';
import { placedAt, stretchesOf } from '../scene/carried';
import { placedOf } from '../scene/objects';
import type { Placed } from '../scene/objects';
import { time } from './playback';
import { robot, shownPlan } from './store';
import { nearest, setting } from './surroundings';

const placed = computed(() => (robot.value ? placedOf(setting.value, robot.value) : []));

// The names of what is taken or put down on the way, as a text that is equal while they are.
const handled = computed(() => JSON.stringify(shownPlan.value ? handledNames(shownPlan.value.request) : []));

// What stands still at all times, and what moves by itself, or with the robot at some.
const parted = computed(() => {
  const names = JSON.parse(handled.value) as string[];
  const isMovable = ({ id, after, at }: Placed): boolean => after !== null || at !== undefined || names.includes(id);
  return { standing: placed.value.filter((one) => !isMovable(one)), movable: placed.value.filter(isMovable) };
});

export const standing = computed(() => parted.value.standing);

const stretches = computed(() => {
  const { request, answer } = shownPlan.value ?? {};
  return robot.value ? stretchesOf(parted.value.movable, request, answer, robot.value) : [];
});

// Where what moves is at the time that is shown.
export const movable = computed(() => placedAt(stretches.value, time.value));

// Where things are when that pair comes nearest.
export const placedAtPair = computed(() => [...standing.value, ...placedAt(stretches.value, nearest.value?.clearance.time ?? 0)]);
