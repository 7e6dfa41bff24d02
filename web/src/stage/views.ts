// From where the stage is looked at, and what is seen from there.
import { Box3, Vector3 } from 'three';
import type { Object3D, PerspectiveCamera, Sphere, Vector3Tuple, WebGLRenderer } from 'three';

export type View = 'home' | 'front' | 'side' | 'top';

export const DIRECTIONS: Record<View, Vector3Tuple> = {
  home: [1, -1.05, 0.75],
  front: [1, 0, 0.02],
  side: [0, -1, 0.02],
  top: [0.001, 0, 1],
};

export const NEAR = 0.76; // of the distance at which a ball is in view: what it holds seldom fills it

export const SHARES = [NEAR, 0.85, 0.95, 1.05, 1.2, 1.5]; // which are tried until all is in view

// Puts the camera in a direction from a ball, at a share of the distance at which all of it is in view.
export function standBack(camera: PerspectiveCamera, { center, radius }: Sphere, from: Vector3, share: number): void {
  const half = (camera.fov * Math.PI) / 360;
  const narrow = Math.atan(Math.tan(half) * Math.min(1, camera.aspect));
  camera.position.copy(center).addScaledVector(from.normalize(), (radius / Math.sin(narrow)) * share);
}

// Whether all of an object is in the view.
export function isSeen(object: Object3D, camera: PerspectiveCamera): boolean {
  object.updateWorldMatrix(true, true);
  return arePointsSeen(cornersOfBox(new Box3().expandByObject(object)), camera);
}

// Whether all of some objects, and points in the world, are in the view.
export function areSeen(objects: readonly (Object3D | undefined)[], points: readonly Vector3[], camera: PerspectiveCamera): boolean {
  return objects.every((object) => !object || isSeen(object, camera)) && arePointsSeen(points, camera);
}

function arePointsSeen(points: readonly Vector3[], camera: PerspectiveCamera): boolean {
  camera.updateMatrixWorld();
  const isInside = (part: number): boolean => Math.abs(part) <= 1;
  return points.every((point) => point.clone().project(camera).toArray().every(isInside));
}

export function cornersOfBox({ min, max }: Box3): Vector3[] {
  return [min, max].flatMap(({ x }) => [min, max].flatMap(({ y }) => [min, max].map(({ z }) => new Vector3(x, y, z))));
}

// Gives the picture the size of its canvas; false: that has none.
export function fillCanvas({ clientWidth, clientHeight }: HTMLCanvasElement, renderer: WebGLRenderer, camera: PerspectiveCamera): boolean {
  if (clientWidth === 0 || clientHeight === 0) return false;
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  renderer.setSize(clientWidth, clientHeight, false);
  camera.aspect = clientWidth / clientHeight;
  camera.updateProjectionMatrix();
  return true;
}
