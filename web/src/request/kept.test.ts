import { Quaternion, Vector3 } from 'three';
import { describe, expect, test } from 'vitest';
import type { FreeMotion, Pose, PoseConstraint } from '../service/types';
import { keptMarks } from '../stage/kept';
import { Mesh } from 'three';
import { CONSTRAINTS, firstConstraint, keeping } from './kept';
import { quaternionOf } from './rotations';

const random = (): number => 2 * Math.random() - 1;
const anyPose = (): Pose => ({
  position: [random(), random(), random()],
  orientation: { kind: 'quaternion', xyzw: new Quaternion(random(), random(), random(), random()).normalize().toArray() },
});
const vector = (values: readonly number[]): Vector3 => new Vector3().fromArray(values);
const turnOf = ({ orientation }: Pose): Quaternion => new Quaternion(...quaternionOf(orientation)!);

// By how much a pose is beyond a constraint, rad or m, by three and by the words of the contract.
function beyond(constraint: PoseConstraint, pose: Pose): number {
  const at = vector(pose.position);
  switch (constraint.kind) {
    case 'tool_axis':
      return (
        vector(constraint.axis ?? [0, 0, 1])
          .applyQuaternion(turnOf(pose))
          .angleTo(vector(constraint.direction)) - constraint.angle
      );
    case 'orientation':
      return turnOf(pose).angleTo(new Quaternion(...quaternionOf(constraint.orientation)!)) - constraint.angle;
    case 'plane':
      return Math.abs(at.sub(vector(constraint.point)).dot(vector(constraint.normal).normalize())) - constraint.distance;
    case 'line':
      return at.sub(vector(constraint.point)).cross(vector(constraint.direction).normalize()).length() - constraint.distance;
    case 'half_space':
      return at.dot(vector(constraint.normal).normalize()) - constraint.offset;
    case 'box': {
      const inside = at.sub(vector(constraint.pose.position)).applyQuaternion(turnOf(constraint.pose).invert()).toArray();
      return Math.max(...inside.map((value, axis) => Math.abs(value) - constraint.size[axis]! / 2));
    }
  }
}

describe('a new constraint', () => {
  test.each(CONSTRAINTS)('%s is kept at both ends of the motion, with room', (kind) => {
    for (let k = 0; k < 200; k += 1) {
      const ends = [anyPose(), anyPose()];
      const constraint = firstConstraint(kind, ends);
      if ('angle' in constraint && constraint.angle >= 3.1) continue; // nearly opposite ends leave no room
      for (const end of ends) expect(beyond(constraint, end)).toBeLessThan(-0.04);
    }
  });

  test.each(CONSTRAINTS)('%s begins with values that the service takes, whatever is known of the ends', (kind) => {
    const same = anyPose();
    for (const ends of [[], [same], [same, same], [{ position: [0, 0, 0], orientation: null }]]) {
      const constraint = firstConstraint(kind, ends);
      const numbers = JSON.stringify(constraint).match(/-?\d[\d.e-]*/g)!;
      expect(numbers.every((text) => Number.isFinite(Number(text)))).toBe(true);
      if ('direction' in constraint) expect(vector(constraint.direction).length()).toBeCloseTo(1, 5);
      if ('angle' in constraint) expect(constraint.angle).toBeGreaterThan(0.1);
      if ('size' in constraint) expect(Math.min(...constraint.size)).toBeGreaterThan(0.1);
    }
  });
});

test('a motion that keeps nothing has no field for it', () => {
  const motion: FreeMotion = { kind: 'free', most_checks: 100 };
  const kept = keeping(motion, [firstConstraint('plane', [])]);
  expect(kept.keep).toHaveLength(1);
  expect(keeping(kept, [])).toEqual(motion);
});

// What is drawn is where the constraint ends: a pose there is neither inside nor beyond.
test.each(['box', 'half_space', 'plane', 'line'] as const)('the drawing of a %s is its border', (kind) => {
  for (let k = 0; k < 20; k += 1) {
    const pose = anyPose();
    const drawn: Record<string, PoseConstraint> = {
      box: { kind: 'box', pose, size: [0.2, 0.5, 0.9] },
      half_space: { kind: 'half_space', normal: [random(), random(), random()], offset: random() },
      plane: { kind: 'plane', point: pose.position, normal: [random(), random(), random()], distance: 0.1 },
      line: { kind: 'line', point: pose.position, direction: [random(), random(), random()], distance: 0.1 },
    };
    const constraint = drawn[kind]!;
    const [region] = meshesOf([constraint], [anyPose()]);
    expect(region!.length).toBeGreaterThan(3);
    for (const point of region!) expect(beyond(constraint, { position: point.toArray(), orientation: pose.orientation })).toBeCloseTo(0, 5);
  }
});

test.each([0.2, 1.5, 2.5])('the cones of an angle of %f have it', (angle) => {
  const ends = [anyPose(), anyPose()];
  const constraint: PoseConstraint = { kind: 'tool_axis', direction: [random(), random(), random()], angle };
  const cones = meshesOf([constraint], ends);
  expect(cones).toHaveLength(2);
  cones.forEach((points, index) => {
    const tip = vector(ends[index]!.position);
    const sides = points.map((point) => point.clone().sub(tip)).filter((side) => side.length() > 0.01);
    expect(sides.length).toBeGreaterThan(3);
    for (const side of sides) expect(side.angleTo(vector(constraint.direction))).toBeCloseTo(angle, 4);
  });
});

// The corners of each veil.
function meshesOf(constraints: readonly PoseConstraint[], ends: readonly Pose[]): Vector3[][] {
  return keptMarks({ constraints, ends }, 1.5, 'red').children.flatMap((child) => {
    if (!(child instanceof Mesh)) return [];
    const corners = (child as Mesh).geometry.getAttribute('position');
    return [Array.from({ length: corners.count }, (_, i) => new Vector3().fromBufferAttribute(corners, i))];
  });
}
