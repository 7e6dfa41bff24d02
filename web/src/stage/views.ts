// From where the stage is looked at, and what is seen from there.
import { Box3, Vector3 } from 'three';
import type { Object3D, PerspectiveCamera, Vector3Tuple } from 'three';

export type View = 'home' | 'front' | 'side' | 'top';

export const DIRECTIONS: Record<View, Vector3Tuple> = {
  home: [1, -1.05, 0.75],
  front: [1, 0, 0.02],
  side: [0, -1, 0.02],
  top: [0.001, 0, 1],
};

// Whether all of an object is in the view.
export function isSeen(object: Object3D, camera: PerspectiveCamera): boolean {
  object.updateWorldMatrix(true, true);
  camera.updateMatrixWorld();
  const { min, max } = new Box3().expandByObject(object);
  const corners = [min, max].flatMap(({ x }) => [min, max].flatMap(({ y }) => [min, max].map(({ z }) => new Vector3(x, y, z))));
  return corners.every((corner) =>
    corner
      .project(camera)
      .toArray()
      .every((part) => Math.abs(part) <= 1),
  );
}
