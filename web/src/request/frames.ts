// Frames of a request in the base frame of its robot.
import type { PlanRequest, Pose, Robot } from '../service/types';
import { composed, inverted, poseOf } from './poses';

const BASE: Pose = { position: [0, 0, 0], orientation: { kind: 'quaternion', xyzw: [0, 0, 0, 1] } };

// The frame of that name; null: the request has none.
export function frameInBase(name: string | null | undefined, { frames, mounting }: PlanRequest, robot: Robot): Pose | null {
  if (!name || name === 'base') return BASE;
  const world = inverted(mounting ?? (robot.mounting ? poseOf(robot.mounting) : BASE));
  if (name === 'world') return world;
  const frame = frames?.[name];
  return frame ? composed(world, frame) : null;
}

// A pose in the base frame as the frame of a waypoint has it.
export function poseInFrame(pose: Pose, frame: string | null | undefined, request: PlanRequest, robot: Robot): Pose {
  return transformed(inverted(frameInBase(frame, request, robot) ?? BASE), pose);
}

export function transformed(frame: Pose, pose: Pose): Pose {
  const { position, orientation } = composed(frame, pose);
  return { position, orientation: pose.orientation ? orientation : null };
}
