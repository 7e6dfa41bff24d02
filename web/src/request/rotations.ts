// Orientations in the forms of the contract. Angles in rad, quaternions as x, y, z, w.
import type { Pose } from '../service/types';

export type Vector = [number, number, number];
export type Quaternion = [number, number, number, number];

// The quaternion of roll, pitch and yaw about the fixed axes x, then y, then z: R = Rz(yaw) Ry(pitch) Rx(roll).
export function quaternionOfRpy([roll, pitch, yaw]: Vector): Quaternion {
  const [cr, sr] = [Math.cos(roll / 2), Math.sin(roll / 2)];
  const [cp, sp] = [Math.cos(pitch / 2), Math.sin(pitch / 2)];
  const [cy, sy] = [Math.cos(yaw / 2), Math.sin(yaw / 2)];
  return [sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy];
}

// Roll, pitch and yaw of a quaternion of norm 1; the pitch is in [-pi/2, pi/2].
export function rpyOfQuaternion([x, y, z, w]: Quaternion): Vector {
  const sine = Math.min(1, Math.max(-1, 2 * (w * y - z * x)));
  if (Math.abs(sine) > 1 - 1e-12) return [0, Math.sign(sine) * (Math.PI / 2), -2 * Math.sign(sine) * Math.atan2(x, w)];
  return [
    Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
    Math.asin(sine),
    Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
  ];
}

function quaternionOfMatrix(rows: number[][]): Quaternion {
  const at = (i: number, j: number): number => rows[i]![j]!;
  const candidates: Quaternion[] = [
    [1 + at(0, 0) - at(1, 1) - at(2, 2), at(0, 1) + at(1, 0), at(0, 2) + at(2, 0), at(2, 1) - at(1, 2)],
    [at(0, 1) + at(1, 0), 1 - at(0, 0) + at(1, 1) - at(2, 2), at(1, 2) + at(2, 1), at(0, 2) - at(2, 0)],
    [at(0, 2) + at(2, 0), at(1, 2) + at(2, 1), 1 - at(0, 0) - at(1, 1) + at(2, 2), at(1, 0) - at(0, 1)],
    [at(2, 1) - at(1, 2), at(0, 2) - at(2, 0), at(1, 0) - at(0, 1), 1 + at(0, 0) + at(1, 1) + at(2, 2)],
  ];
  const largest = candidates.reduce((best, next) => (Math.hypot(...next) > Math.hypot(...best) ? next : best));
  return normalised(largest);
}

function normalised(q: Quaternion): Quaternion {
  const norm = Math.hypot(...q);
  return q.map((value) => value / norm) as Quaternion;
}

// The quaternion of an orientation in any of its forms; null: any orientation.
export function quaternionOf(orientation: Pose['orientation']): Quaternion | null {
  if (!orientation) return null;
  switch (orientation.kind) {
    case 'quaternion':
      return normalised(orientation.xyzw as Quaternion);
    case 'rpy':
      return quaternionOfRpy(orientation.rpy as Vector);
    case 'matrix':
      return quaternionOfMatrix(orientation.matrix);
  }
}
