// What is drawn beside the robot: the tool's path, waypoints, frames, the place of a refusal.
import {
  BufferGeometry,
  Color,
  Float32BufferAttribute,
  GridHelper,
  Group,
  InstancedMesh,
  Line,
  LineBasicMaterial,
  LineDashedMaterial,
  LineSegments,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  Points,
  Quaternion,
  SphereGeometry,
  Vector3,
} from 'three';
import type { ColorRepresentation, Object3D } from 'three';
import { Line2 } from 'three/examples/jsm/lines/Line2.js';
import { LineGeometry } from 'three/examples/jsm/lines/LineGeometry.js';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import { LineSegments2 } from 'three/examples/jsm/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/examples/jsm/lines/LineSegmentsGeometry.js';
import type { PlanAnswer } from '../service/types';
import { quaternionOf } from '../request/rotations';
import { shareColour } from './colours';

const PATH_WIDTH = 4; // pixels
const TOOL_WIDTH = 2; // pixels
const TIP_SIDES = 16; // of the ring that stands for the tip
const TIP_SIZE = 2.2; // of that ring, as a multiple of a waypoint's ball
const SHORTEST_TOOL = 1e-6; // m; a shorter tool is none
const AXES = ['#d7263d', '#2b8a3e', '#1c6fd6'].map((hex) => new Color(hex));

// From so many samples on up to others, what lies between is drawn.
export type Stretch = readonly [number, number];

// The tool's path, coloured by a share from 0 to 1 at each sample, as one line for each tool; it lies in the base frame.
export function pathLine(answer: PlanAnswer, shares: readonly number[], stretches: readonly Stretch[], dark: boolean): Object3D {
  const points = answer.samples.tcp_pose?.position ?? [];
  const material = new LineMaterial({ vertexColors: true, linewidth: PATH_WIDTH });
  const lines = stretches.map(([from, to]) => {
    const geometry = new LineGeometry();
    geometry.setPositions(points.slice(from, to).flat());
    geometry.setColors(shares.slice(from, to).flatMap((share) => shareColour(share, dark).toArray()));
    return new Line2(geometry, material);
  });
  return new Group().add(...lines);
}

// Another back end's path, as one line for each tool.
export function ghostLine(answer: PlanAnswer, stretches: readonly Stretch[], colour: ColorRepresentation): Object3D {
  const points = answer.samples.tcp_pose?.position ?? [];
  const material = new LineDashedMaterial({ color: colour, dashSize: 0.02, gapSize: 0.012 });
  const lines = stretches.map(([from, to]) => {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new Float32BufferAttribute(points.slice(from, to).flat(), 3));
    return new Line(geometry, material).computeLineDistances();
  });
  return new Group().add(...lines);
}

// Tools, each by its tool centre point and where that is in the tip frame: a line leads there from a ring around the tip.
export function toolMarks(
  tools: readonly { at: Matrix4; tool: Matrix4 }[],
  size: number,
  colour: ColorRepresentation,
): Object3D | undefined {
  const ends = tools.flatMap(({ at, tool }) => {
    const tip = at.clone().multiply(tool.clone().invert());
    if (new Vector3().setFromMatrixPosition(tool).length() < SHORTEST_TOOL) return [];
    const ring = Array.from({ length: TIP_SIDES + 1 }, (_, i) => {
      const angle = (2 * Math.PI * i) / TIP_SIDES;
      return new Vector3(size * Math.cos(angle), size * Math.sin(angle), 0).applyMatrix4(tip);
    });
    const sides = ring.slice(1).flatMap((corner, i) => [ring[i]!, corner]);
    return [new Vector3().setFromMatrixPosition(tip), new Vector3().setFromMatrixPosition(at), ...sides];
  });
  if (ends.length === 0) return undefined;
  const geometry = new LineSegmentsGeometry().setPositions(ends.flatMap((end) => end.toArray()));
  return new LineSegments2(geometry, new LineMaterial({ color: colour, linewidth: TOOL_WIDTH }));
}

// How a tool stands away from the tip, in the frame of its centre point.
export function toolFrame(tool: Matrix4, extent: number, colour: string): Group {
  const mark = toolMarks([{ at: new Matrix4(), tool }], extent * 0.018, colour);
  return mark ? new Group().add(mark) : new Group();
}

export function axes(length: number): LineSegments {
  return allAxes([{ matrix: new Matrix4(), length }]);
}

// The axes of many frames as one object, so that it is drawn at once.
function allAxes(frames: readonly { matrix: Matrix4; length: number }[]): LineSegments {
  const [ends, colours]: [number[], number[]] = [[], []];
  for (const { matrix, length } of frames) {
    const origin = new Vector3().setFromMatrixPosition(matrix);
    AXES.forEach((colour, axis) => {
      const end = new Vector3().setComponent(axis, length).applyMatrix4(matrix);
      ends.push(...origin.toArray(), ...end.toArray());
      colours.push(...colour.toArray(), ...colour.toArray());
    });
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new Float32BufferAttribute(ends, 3));
  geometry.setAttribute('color', new Float32BufferAttribute(colours, 3));
  return new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true }));
}

export function ball(at: readonly number[], radius: number, colour: ColorRepresentation): Mesh {
  const mesh = new Mesh(new SphereGeometry(radius, 20, 14), new MeshBasicMaterial({ color: colour }));
  mesh.position.fromArray(at);
  return mesh;
}

// The ground at a height, in the colours of the theme.
export function ground(extent: number, height: number, strong: string, weak: string): GridHelper {
  const size = Math.ceil(extent * 2.4);
  const grid = new GridHelper(size, size * 4, strong, weak);
  grid.rotateX(Math.PI / 2);
  grid.position.z = height;
  return grid;
}

// A ball and axes at each waypoint, and the tool of those that have one; the number of a ball is that of its planned waypoint.
export function waypointMarks(
  answer: PlanAnswer,
  tools: readonly (Matrix4 | null)[],
  size: number,
  chosen: number,
  colour: string,
  mark: string,
): Group {
  const material = new MeshBasicMaterial();
  const balls = new InstancedMesh(new SphereGeometry(size, 16, 10), material, answer.waypoints.length);
  const frames: { matrix: Matrix4; length: number }[] = [];
  const held: { at: Matrix4; tool: Matrix4 }[] = [];
  answer.waypoints.forEach(({ pose, index: waypoint }, index) => {
    const isChosen = waypoint === chosen;
    const turn = quaternionOf(pose.orientation);
    const at = new Vector3().fromArray(pose.position);
    const matrix = new Matrix4().compose(at, turn ? new Quaternion(...turn) : new Quaternion(), new Vector3(1, 1, 1));
    if (turn) frames.push({ matrix, length: size * (isChosen ? 6 : 3.5) });
    const tool = tools[index];
    if (tool) held.push({ at: matrix, tool });
    balls.setMatrixAt(index, isChosen ? matrix.clone().scale(new Vector3(1.5, 1.5, 1.5)) : matrix);
    balls.setColorAt(index, new Color(isChosen ? mark : colour));
  });
  const group = new Group().add(balls, allAxes(frames));
  const marks = toolMarks(held, size * TIP_SIZE, colour);
  return marks ? group.add(marks) : group;
}

export function disposeOf(object: Object3D | undefined): void {
  object?.traverse((node) => {
    if (node instanceof Mesh || node instanceof Line || node instanceof Points) (node.geometry as BufferGeometry).dispose();
  });
  object?.removeFromParent();
}
