// The pose of the tool at a joint position, without three, which the first view does not load.
import { composed, poseOf } from '../request/poses';
import type { Pose, Robot } from '../service/types';

// In the base frame; `tool` is the tool centre point in the tip frame, null: the robot's own.
export function toolPose(robot: Robot, position: readonly number[], tool: Pose | null): Pose {
  return composed(framePose(robot, position, robot.tip_frame), tool ?? poseOf(robot.tool));
}

// The pose of a frame of the model in the base frame; of one that it has not: of the base.
export function framePose(robot: Robot, position: readonly number[], name: string): Pose {
  const placement = robot.placements.find(({ frame }) => frame === name);
  if (!placement) return shift([0, 0, 1], 0);
  const joints = robot.chain.slice(0, placement.after).flatMap((joint, index) => {
    const value = position[index] ?? 0;
    return [poseOf(joint), robot.joints[index]!.kind === 'prismatic' ? shift(joint.axis, value) : turn(joint.axis, value)];
  });
  return [...joints, poseOf(placement)].reduce(composed);
}

export function shift(axis: readonly number[], distance: number): Pose {
  return { position: axis.map((value) => value * distance), orientation: { kind: 'quaternion', xyzw: [0, 0, 0, 1] } };
}

export function turn(axis: readonly number[], angle: number): Pose {
  const sine = Math.sin(angle / 2);
  const xyzw = [...axis.map((value) => value * sine), Math.cos(angle / 2)];
  return { position: [0, 0, 0], orientation: { kind: 'quaternion', xyzw } };
}
