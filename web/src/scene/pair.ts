// The pair of things that a clearance or a refusal is about: where they are nearest, as far as that can be drawn.
import { Matrix4, Vector3 } from 'three';
import type { LinkShape, Robot } from '../service/types';
import { jointMatrices, matrixOf } from '../robot/chain';
import type { Placed } from './objects';
import { nearestOf, nearestToHalfSpace, supportOf } from './nearest';
import type { Support } from './nearest';

export interface Pair {
  names: readonly string[];
  position: readonly number[]; // of the joints, when they are nearest
}

// The nearest points of a pair in the frame that stands still; null: one of them is not convex, or nothing to be drawn.
export function pointsOf(
  { names, position }: Pair,
  robot: Robot,
  links: readonly LinkShape[],
  placed: readonly Placed[],
): [Vector3, Vector3] | null {
  const joints = jointMatrices(robot, position);
  const [first, second] = names.map((name) => supportsOf(name, joints, links, placed));
  const ground = placed.find(({ id, shape }) => names.includes(id) && shape.kind === 'half_space');
  const found: [Vector3, Vector3][] = [];
  for (const one of first ?? []) {
    if (ground?.shape.kind === 'half_space')
      found.push(nearestToHalfSpace(one, ground.shape.normal, ground.shape.offset ?? 0, ground.matrix));
    for (const other of second ?? []) found.push(nearestOf(one, other));
  }
  return found.reduce<[Vector3, Vector3] | null>((best, next) => (best && length(best) <= length(next) ? best : next), null);
}

function length([from, to]: [Vector3, Vector3]): number {
  return from.distanceTo(to);
}

function supportsOf(name: string, joints: readonly Matrix4[], links: readonly LinkShape[], placed: readonly Placed[]): Support[] {
  const ofLink = links
    .filter(({ link }) => link === name)
    .map((link) => supportOf(link.shape, joints[link.after]!.clone().multiply(matrixOf(link))));
  const ofThings = placed
    .filter(({ id }) => id === name)
    .map(({ shape, matrix, after }) => supportOf(shape, after === null ? matrix : joints[after]!.clone().multiply(matrix)));
  return [...ofLink, ...ofThings].filter((support) => support !== null);
}
