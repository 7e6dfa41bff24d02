// What the tool keeps on a free motion: each constraint begins with values that both ends of the motion keep.
import type { FreeMotion, Pose, PoseConstraint } from '../service/types';
import { withoutEmpty } from './edits';
import { rotated } from './poses';
import { quaternionOf } from './rotations';
import type { Quaternion, Vector } from './rotations';

export const CONSTRAINTS = ['tool_axis', 'orientation', 'box', 'half_space', 'plane', 'line'] as const;
export const MOST_CONSTRAINTS = 4; // of the service

const LEAST_ANGLE = 0.2; // rad, of a new constraint
const MOST_ANGLE = 3.1; // rad: the service takes angles below a half turn
const ROOM = 0.05; // rad or m beyond the ends: a detour needs some
const SIDE = 0.1; // m around a box and under a border, where detours need more
const NONE: Quaternion = [0, 0, 0, 1];
const UP: Vector = [0, 0, 1];

// The motion with these constraints; without any the field goes.
export function keeping(motion: FreeMotion, keep: readonly PoseConstraint[]): FreeMotion {
  return withoutEmpty({ ...motion, keep: keep.length > 0 ? [...keep] : undefined });
}

// A constraint that the tool keeps at both ends of the motion, poses in the base frame; fewer: as far as they are known.
export function firstConstraint(kind: PoseConstraint['kind'], ends: readonly Pose[]): PoseConstraint {
  const points = ends.length > 0 ? ends.map(({ position }) => position) : [[0, 0, 0]];
  const turns = ends.length > 0 ? ends.map(({ orientation }) => quaternionOf(orientation) ?? NONE) : [NONE];
  const heights = points.map((point) => point[2]!);
  const [from, to] = [points[0]!, points.at(-1)!];
  switch (kind) {
    case 'tool_axis': {
      const axes = turns.map((turn) => rotated(turn, UP));
      const mean = unit(axes.reduce((sum, axis) => plus(sum, axis)));
      return { kind, direction: mean.map(figure), angle: roomy(Math.max(...axes.map((axis) => between(axis, mean)))) };
    }
    case 'orientation': {
      const [first, last] = [turns[0]!, turns.at(-1)!];
      const cosine = Math.abs(first.reduce((sum, value, i) => sum + value * last[i]!, 0));
      return { kind, orientation: { kind: 'quaternion', xyzw: last.map(figure) }, angle: roomy(2 * Math.acos(Math.min(1, cosine))) };
    }
    case 'plane':
      return { kind, point: from.map(figure), normal: [...UP], distance: figure(Math.abs(to[2]! - from[2]!) + ROOM) };
    case 'line': {
      const along = to.map((value, axis) => value - from[axis]!) as Vector;
      return { kind, point: from.map(figure), direction: unit(along).map(figure), distance: ROOM };
    }
    case 'box': {
      const position = from.map((value, axis) => figure((value + to[axis]!) / 2));
      const size = from.map((value, axis) => figure(Math.abs(to[axis]! - value) + 2 * SIDE));
      return { kind, pose: { position, orientation: { kind: 'rpy', rpy: [0, 0, 0] } }, size };
    }
    case 'half_space':
      return { kind, normal: [...UP], offset: figure(Math.max(...heights) + SIDE) };
  }
}

function roomy(angle: number): number {
  return figure(Math.min(Math.max(LEAST_ANGLE, angle + ROOM), MOST_ANGLE));
}

// Without the last digits, which nobody wants to read.
function figure(value: number): number {
  return Number(value.toFixed(6)) + 0;
}

function plus(a: Vector, b: Vector): Vector {
  return a.map((value, axis) => value + b[axis]!) as Vector;
}

// A vector of length 1; of none it is the upward one.
export function unit(vector: readonly number[]): Vector {
  const length = Math.hypot(...vector);
  return length > 1e-9 ? (vector.map((value) => value / length) as Vector) : UP;
}

function between(a: Vector, b: Vector): number {
  return Math.acos(Math.min(1, Math.max(-1, a[0] * b[0] + a[1] * b[1] + a[2] * b[2])));
}
