// What the tool keeps on the way to a waypoint: boxes, borders, slabs and tubes where they are, cones at both ends of the motion.
import {
  BoxGeometry,
  CylinderGeometry,
  DoubleSide,
  EdgesGeometry,
  Group,
  LatheGeometry,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  PlaneGeometry,
  Quaternion,
  Vector2,
  Vector3,
} from 'three';
import type { BufferGeometry, ColorRepresentation } from 'three';
import { rotated } from '../request/poses';
import { quaternionOf } from '../request/rotations';
import type { Quaternion as Turn, Vector } from '../request/rotations';
import { matrixOfPose } from '../scene/objects';
import type { PoseConstraint } from '../service/types';
import type { Kept } from '../state/ends';

const SIDES = 48; // of what is round
const CONE = 0.14; // length of a cone's side, as a share of the robot's extent
const SMALL_CONE = 0.09; // of the three that stand for an orientation
const BORDER = 1.2; // side of a plane, as a share of the extent
const POINTER = 0.08; // of the line that shows which side of a border is allowed
const EDGE = 20; // degrees, from which on an edge is drawn
const AXES: readonly Vector[] = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];

export function keptMarks({ constraints, ends }: Kept, extent: number, colour: string): Group {
  const group = new Group();
  const near = new Vector3().fromArray(ends[0]?.position ?? [0, 0, 0]);
  for (const constraint of constraints) {
    const parts = regionOf(constraint, near, extent) ?? ends.flatMap(({ position }) => conesOf(constraint, position, extent));
    for (const part of parts) group.add(...drawn(part, colour));
  }
  return group;
}

// The region of the tool's position; null: the constraint is on its orientation.
function regionOf(constraint: PoseConstraint, near: Vector3, extent: number): BufferGeometry[] | null {
  switch (constraint.kind) {
    case 'box':
      return [new BoxGeometry(...(constraint.size as Vector)).applyMatrix4(matrixOfPose(constraint.pose))];
    case 'half_space': {
      const out = new Vector3().fromArray(constraint.normal).normalize();
      const foot = footOf(near, out, out.clone().multiplyScalar(constraint.offset));
      return [square(foot, out, extent), pointer(foot, out, extent)];
    }
    case 'plane': {
      const out = new Vector3().fromArray(constraint.normal).normalize();
      const foot = footOf(near, out, new Vector3().fromArray(constraint.point));
      return [1, -1].map((side) => square(foot.clone().addScaledVector(out, side * constraint.distance), out, extent));
    }
    case 'line': {
      const along = new Vector3().fromArray(constraint.direction).normalize();
      const point = new Vector3().fromArray(constraint.point);
      const middle = point.addScaledVector(along, near.clone().sub(point).dot(along));
      const tube = new CylinderGeometry(constraint.distance, constraint.distance, 2 * BORDER * extent, SIDES, 1, true);
      return [tube.applyMatrix4(turnedTo(along, middle))];
    }
    default:
      return null;
  }
}

// The point of a plane that is nearest to another.
function footOf(near: Vector3, out: Vector3, point: Vector3): Vector3 {
  return near.clone().addScaledVector(out, point.clone().sub(near).dot(out));
}

function square(middle: Vector3, out: Vector3, extent: number): BufferGeometry {
  const geometry = new PlaneGeometry(BORDER * extent, BORDER * extent).lookAt(out);
  return geometry.translate(middle.x, middle.y, middle.z);
}

// A small cone from a border into what is allowed.
function pointer(foot: Vector3, out: Vector3, extent: number): BufferGeometry {
  const tip = foot.clone().addScaledVector(out, -POINTER * extent);
  return cone(tip, out, Math.PI / 12, POINTER * extent);
}

// Where an axis of the tool may point, from the tool on: of an orientation, each of its three axes.
function conesOf(constraint: PoseConstraint, position: readonly number[], extent: number): BufferGeometry[] {
  const at = new Vector3().fromArray(position);
  if (constraint.kind === 'tool_axis')
    return [cone(at, new Vector3().fromArray(constraint.direction).normalize(), constraint.angle, CONE * extent)];
  if (constraint.kind !== 'orientation') return [];
  const turn = quaternionOf(constraint.orientation) as Turn;
  return AXES.map((axis) => cone(at, new Vector3(...rotated(turn, axis)), constraint.angle, SMALL_CONE * extent));
}

// All directions within an angle of one; from a right angle on it opens backwards.
function cone(tip: Vector3, along: Vector3, angle: number, side: number): BufferGeometry {
  const rim = new Vector2(side * Math.sin(angle), side * Math.cos(angle));
  return new LatheGeometry([new Vector2(0, 0), rim], SIDES).applyMatrix4(turnedTo(along, tip));
}

// The y axis turned to a direction, at a place.
function turnedTo(along: Vector3, at: Vector3): Matrix4 {
  return new Matrix4().compose(at, new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), along), new Vector3(1, 1, 1));
}

function drawn(geometry: BufferGeometry, color: ColorRepresentation): [Mesh, LineSegments] {
  const veil = new MeshBasicMaterial({ color, side: DoubleSide, transparent: true, opacity: 0.14, depthWrite: false });
  const edges = new LineSegments(new EdgesGeometry(geometry, EDGE), new LineBasicMaterial({ color, transparent: true, opacity: 0.8 }));
  return [new Mesh(geometry, veil), edges];
}
