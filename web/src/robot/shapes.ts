// The shapes that a robot is drawn with: those of its model, those that can collide, or sticks from joint to joint.
import { Color, Matrix4, Quaternion, SRGBColorSpace, Vector3 } from 'three';
import type { LinkShape, Robot } from '../service/types';
import { quaternionOfRpy } from '../request/rotations';
import type { Vector } from '../request/rotations';
import { matrixOf } from './chain';

export type Form =
  | { kind: 'box'; size: Vector }
  | { kind: 'cylinder'; radius: number; length: number }
  | { kind: 'capsule'; radius: number; length: number }
  | { kind: 'sphere'; radius: number }
  | { kind: 'convex'; vertices: number[][]; faces: number[][] }
  | { kind: 'triangles'; vertices: Float32Array; faces: Uint32Array };

// A shape behind so many joints, with its pose there; lengths are along z.
export interface Shape {
  after: number;
  matrix: Matrix4;
  form: Form;
  colour?: readonly [number, number, number, number]; // red, green, blue (linear) and opacity, from 0 to 1
}

// The visual mesh of a link, with the link's name.
export type VisualShape = Shape & { link: string };

const ONE = new Vector3(1, 1, 1);
const THICKNESS = 0.045; // of a stick, as a share of the arm's length
const SHORTEST = 1e-6; // m; nearer joints are one

// `links` are the shapes that can collide, of robots, or of links beside visual meshes, that have none to look at.
export function shapesOf(robot: Robot, links: readonly LinkShape[] = [], visuals: readonly VisualShape[] = []): Shape[] {
  const given = (robot.geometry ?? []).map((shape) => shapeOf(robot, shape as Record<string, unknown>));
  const drawn = given.filter((shape) => shape !== null);
  if (visuals.length > 0) {
    const seen = new Set([
      ...visuals.map(({ link }) => link),
      ...(robot.geometry ?? []).map((shape) => (shape as { frame: string }).frame),
    ]);
    return [...drawn, ...visuals, ...linkShapes(links.filter(({ link }) => !seen.has(link)))];
  }
  if (drawn.length > 0) return drawn;
  if (links.length === 0) return sticks(robot);
  return linkShapes(links);
}

export function linkShapes(links: readonly LinkShape[]): Shape[] {
  return links.map((link) => ({ after: link.after, matrix: matrixOf(link), form: link.shape as Form }));
}

function shapeOf(robot: Robot, shape: Record<string, unknown>): Shape | null {
  const frame = robot.placements.find((placement) => placement.frame === shape.frame);
  const form = formOf(shape);
  if (!frame || !form) return null;
  const [x, y, z, w] = quaternionOfRpy(shape.rpy as Vector);
  const local = new Matrix4().compose(new Vector3().fromArray(shape.position as Vector), new Quaternion(x, y, z, w), ONE);
  return { after: frame.after, matrix: matrixOf(frame).multiply(local), form, colour: colourOf(shape.colour) };
}

// URDF has colours in sRGB.
function colourOf(given: unknown): Shape['colour'] {
  if (!Array.isArray(given)) return undefined;
  const [red, green, blue, opacity] = given as [number, number, number, number];
  return [...new Color().setRGB(red, green, blue, SRGBColorSpace).toArray(), opacity] as [number, number, number, number];
}

function formOf(shape: Record<string, unknown>): Form | null {
  switch (shape.kind) {
    case 'box':
      return { kind: 'box', size: shape.size as Vector };
    case 'cylinder':
    case 'capsule':
      return { kind: shape.kind, radius: shape.radius as number, length: shape.length as number };
    case 'sphere':
      return { kind: 'sphere', radius: shape.radius as number };
    default:
      return null;
  }
}

// A stick leads from each joint to the next and from the last to the tip; a ball sits at each joint.
export function sticks(robot: Robot): Shape[] {
  const ends = [...robot.chain.map((joint) => joint.position)];
  const tip = robot.placements.find((placement) => placement.frame === robot.tip_frame);
  if (tip) ends.push(tip.position);
  const lengths = ends.map((end) => Math.hypot(...end));
  const radius = Math.max(0.01, (THICKNESS * lengths.reduce((sum, length) => sum + length, 0)) / 2);
  return ends.flatMap((end, after): Shape[] => {
    const ball: Shape = { after, matrix: new Matrix4(), form: { kind: 'sphere', radius: radius * 1.35 } };
    const length = lengths[after]!;
    if (length < SHORTEST) return [ball];
    const direction = new Vector3().fromArray(end).normalize();
    const turn = new Quaternion().setFromUnitVectors(new Vector3(0, 0, 1), direction);
    const middle = direction.multiplyScalar(length / 2);
    return [ball, { after, matrix: new Matrix4().compose(middle, turn, ONE), form: { kind: 'capsule', radius, length } }];
  });
}

// How far the robot reaches at most, m: what the view is fitted to.
export function reach(robot: Robot): number {
  const steps = [...robot.chain, robot.placements.find((placement) => placement.frame === robot.tip_frame), robot.tool];
  const strokes = robot.joints.map((joint) =>
    joint.kind === 'prismatic' ? Math.max(Math.abs(joint.lower ?? 0), Math.abs(joint.upper ?? 0)) : 0,
  );
  const rigid = steps.reduce((sum, step) => sum + (step ? Math.hypot(...step.position) : 0), 0);
  return rigid + strokes.reduce((sum, stroke) => sum + stroke, 0);
}
