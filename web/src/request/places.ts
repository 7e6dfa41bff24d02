// Where poses of waypoints are in the base frame: in a frame of the request, or on a moving object.
import type { PlanRequest, Pose, PoseWaypoint, Robot, SceneObject } from '../service/types';
import { frameInBase, transformed } from './frames';
import { inverted } from './poses';
import { objectInBase } from './scenes';

// The pose of a waypoint, with any orientation if it asks for none; null: its frame is unknown. An object is where it is at
// a time, s.
export function poseInBase(waypoint: PoseWaypoint, request: PlanRequest, robot: Robot, time = 0): Pose | null {
  const found = frameOf(waypoint, request, robot, time);
  return found && transformed(found, waypoint.pose);
}

// A pose in the base frame as a waypoint has it; unchanged where its frame is unknown.
export function poseAsGiven(pose: Pose, waypoint: PoseWaypoint, request: PlanRequest, robot: Robot, time = 0): Pose {
  if (!waypoint.on && !waypoint.frame) return pose;
  const found = frameOf(waypoint, request, robot, time);
  return found ? transformed(inverted(found), pose) : pose;
}

function frameOf({ frame, on }: PoseWaypoint, request: PlanRequest, robot: Robot, time: number): Pose | null {
  if (!on) return frameInBase(frame, request, robot);
  const objects = typeof request.scene === 'object' ? request.scene?.objects : undefined;
  const object = objects?.find(({ id }) => id === on);
  return object ? objectInBase(movedTo(object, time), request, robot) : null;
}

function movedTo(object: SceneObject, time: number): SceneObject {
  const { pose, motion } = object;
  if (motion?.kind !== 'linear') return object;
  const now = Math.min(time, motion.end ?? Infinity);
  const position = (pose?.position ?? [0, 0, 0]).map((value, axis) => value + now * motion.velocity[axis]!);
  return { ...object, pose: { ...pose, position } };
}
