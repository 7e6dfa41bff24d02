// Poses in frames of others.
import type { Placement, Pose } from '../service/types';
import { quaternionOf } from './rotations';
import type { Quaternion, Vector } from './rotations';

const NONE: Quaternion = [0, 0, 0, 1];

// A pose in the frame that the first pose is in; without an orientation axes are those of the frame.
export function composed(frame: Pose, pose: Pose): Pose {
  const turn = quaternionOf(frame.orientation) ?? NONE;
  const shift = rotated(turn, pose.position as Vector);
  return {
    position: frame.position.map((value, axis) => value + shift[axis]!),
    orientation: { kind: 'quaternion', xyzw: product(turn, quaternionOf(pose.orientation) ?? NONE) },
  };
}

// The frame that undoes a pose.
export function inverted({ position, orientation }: Pose): Pose {
  const [x, y, z, w] = quaternionOf(orientation) ?? NONE;
  const back: Quaternion = [-x, -y, -z, w];
  return { position: rotated(back, position as Vector).map((value) => -value), orientation: { kind: 'quaternion', xyzw: back } };
}

export function poseOf({ position, quaternion_xyzw }: Placement): Pose {
  return { position, orientation: { kind: 'quaternion', xyzw: quaternion_xyzw } };
}

function product([ax, ay, az, aw]: Quaternion, [bx, by, bz, bw]: Quaternion): Quaternion {
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

export function rotated(turn: Quaternion, [x, y, z]: Vector): Vector {
  const [tx, ty, tz, tw] = turn;
  const [rx, ry, rz] = product(product(turn, [x, y, z, 0]), [-tx, -ty, -tz, tw]);
  return [rx, ry, rz];
}
