// The other robots of the cell, as they are drawn. It computes with three: the stage loads it, the first view does not.
import { computed } from '@preact/signals';
import type { Matrix4 } from 'three';
import { positionAt } from '../plan/samples';
import { linkShapes, shapesOf } from '../robot/shapes';
import type { Shape } from '../robot/shapes';
import { visualShapes } from '../robot/visuals';
import { mountingOf } from '../scene/objects';
import type { Setting } from '../scene/objects';
import type { PlanRequest, Robot } from '../service/types';
import { others } from './cells';
import type { RobotOfCell } from './cells';
import { described } from './described';
import { firstPosition } from './jointPosition';
import { time } from './playback';
import { showsSolids } from './shapes';

export interface OtherRobot {
  robot: Robot;
  shapes: readonly Shape[];
  base: Matrix4; // in the world
}

const shapes = computed(
  () =>
    new Map(
      [...described.value].map(([id, { robot, links, visuals }]): [string, readonly Shape[]] => {
        const isSolid = showsSolids.value && links.length > 0;
        return [id, isSolid ? linkShapes(links) : shapesOf(robot, links, visuals ? visualShapes(robot, visuals) : [])];
      }),
    ),
);

interface Drawn extends RobotOfCell, OtherRobot {}

// In the order of the cell.
export const otherRobots = computed((): readonly Drawn[] =>
  others.value.flatMap((other) => {
    const robot = described.value.get(other.request.robot)?.robot;
    return robot ? [{ ...other, robot, shapes: shapes.value.get(robot.id)!, base: mountingOf(baseOf(other.request), robot) }] : [];
  }),
);

// Where their joints are at the time that is shown.
export const otherPositions = computed(() =>
  otherRobots.value.map(({ request, answer, robot }) => (answer ? positionAt(answer, time.value) : firstPosition(request, robot))),
);

// Where one stands, seen from the robot that is shown.
export function seenFrom(shown: Robot, request: PlanRequest, { base }: OtherRobot): Matrix4 {
  return mountingOf(baseOf(request), shown).invert().multiply(base);
}

function baseOf({ mounting }: PlanRequest): Setting {
  return { mounting };
}
