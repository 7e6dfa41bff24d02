// The nearest points of two convex things, for a line between them on the stage. What is proved comes from the service.
import { Matrix4, Vector3 } from 'three';
import type { SceneShape } from '../service/types';
import type { Form } from '../robot/shapes';

// The point of a convex thing that is farthest along a direction.
export type Support = (direction: Vector3) => Vector3;

const STEPS = 2000;
const ACCURACY = 1e-4; // m, of the distance

// The support of a shape that stands at `matrix`; null: it is not convex.
export function supportOf(shape: Form | SceneShape, matrix: Matrix4): Support | null {
  const local = localSupport(shape);
  if (!local) return null;
  const back = matrix.clone().invert();
  return (direction) => local(direction.clone().transformDirection(back)).applyMatrix4(matrix);
}

function localSupport(shape: Form | SceneShape): Support | null {
  switch (shape.kind) {
    case 'box':
      return ({ x, y, z }) => new Vector3().fromArray(shape.size.map((side, axis) => (Math.sign([x, y, z][axis]!) * side) / 2));
    case 'sphere':
      return (direction) => direction.clone().setLength(shape.radius);
    case 'capsule':
      return (direction) =>
        direction
          .clone()
          .setLength(shape.radius)
          .add(new Vector3(0, 0, (Math.sign(direction.z) * shape.length) / 2));
    case 'cylinder':
      return ({ x, y, z }) => new Vector3(x, y, 0).setLength(x === 0 && y === 0 ? 0 : shape.radius).setZ((Math.sign(z) * shape.length) / 2);
    case 'convex': {
      const corners = shape.vertices.map((corner) => new Vector3().fromArray(corner));
      return (direction) => corners.reduce((best, corner) => (corner.dot(direction) > best.dot(direction) ? corner : best)).clone();
    }
    default:
      return null;
  }
}

// The nearest points of two convex things, which do not overlap (Gilbert, SIAM Journal on Control 4, 1966): the
// difference's point that is nearest to 0 is drawn towards the one that is farthest against it, until that gains nothing;
// which is so near, a few mm, that a line on the stage shows no more.
export function nearestOf(first: Support, second: Support): [Vector3, Vector3] {
  const against = new Vector3(1, 0, 0);
  const [a, b] = [first(against.clone().negate()), second(against)];
  for (let step = 0; step < STEPS; step += 1) {
    const between = a.clone().sub(b);
    const distance = between.length();
    if (distance < ACCURACY) break;
    const [next, other] = [first(between.clone().negate()), second(between)];
    const gain = between.clone().sub(next).add(other);
    if (gain.dot(between) < ACCURACY * distance) break;
    const share = Math.min(1, gain.dot(between) / gain.lengthSq());
    a.lerp(next, share);
    b.lerp(other, share);
  }
  return [a, b];
}

// The nearest points of something convex and a half space.
export function nearestToHalfSpace(near: Support, normal: readonly number[], offset: number, matrix: Matrix4): [Vector3, Vector3] {
  const outwards = new Vector3().fromArray(normal).normalize();
  const at = outwards.clone().multiplyScalar(offset).applyMatrix4(matrix);
  outwards.transformDirection(matrix);
  const lowest = near(outwards.clone().negate());
  return [lowest, lowest.clone().addScaledVector(outwards, -lowest.clone().sub(at).dot(outwards))];
}
