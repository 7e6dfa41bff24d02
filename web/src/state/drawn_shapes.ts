// The shapes that are drawn of the robot. It computes with three: the stage loads it, the first view does not.
import { computed } from '@preact/signals';
import { linkShapes, shapesOf } from '../robot/shapes';
import type { Shape } from '../robot/shapes';
import { visualShapes } from '../robot/visuals';
import { hasVisuals, showsSolids, visuals } from './shapes';
import { links, robot } from './store';

const shownVisuals = computed(() =>
  visuals.value && visuals.value.of === robot.value ? visualShapes(visuals.value.of, visuals.value.file) : [],
);

export const shownShapes = computed<readonly Shape[]>(() => {
  if (!robot.value) return [];
  if (showsSolids.value && hasVisuals.value && links.value.length > 0) return linkShapes(links.value);
  return shapesOf(robot.value, links.value, shownVisuals.value);
});
