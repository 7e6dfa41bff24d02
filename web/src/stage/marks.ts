// What is drawn beside the robot: the tool's path, waypoints, frames, the place of a refusal.
import {
  BufferGeometry,
  Float32BufferAttribute,
  Group,
  Line,
  LineBasicMaterial,
  LineDashedMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  SphereGeometry,
} from 'three';
import type { ColorRepresentation, Object3D } from 'three';
import { Line2 } from 'three/examples/jsm/lines/Line2.js';
import { LineGeometry } from 'three/examples/jsm/lines/LineGeometry.js';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import type { PlanAnswer } from '../service/types';
import { toolSpeeds } from '../plan/samples';
import { quaternionOf } from '../request/rotations';
import { shareColour } from './colours';

const PATH_WIDTH = 4; // pixels
const AXES = ['#d7263d', '#2b8a3e', '#1c6fd6'];

// The tool's path, coloured from standing still to its highest speed; it lies in the base frame.
export function pathLine(answer: PlanAnswer, dark: boolean): Object3D {
  const points = answer.samples.tcp_pose?.position ?? [];
  const speeds = toolSpeeds(answer);
  const fastest = speeds.reduce((most, speed) => Math.max(most, speed), 1e-9);
  const geometry = new LineGeometry();
  geometry.setPositions(points.flat());
  geometry.setColors(speeds.flatMap((speed) => shareColour(speed / fastest, dark).toArray()));
  return new Line2(geometry, new LineMaterial({ vertexColors: true, linewidth: PATH_WIDTH }));
}

// Another back end's path.
export function ghostLine(answer: PlanAnswer, colour: ColorRepresentation): Object3D {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new Float32BufferAttribute((answer.samples.tcp_pose?.position ?? []).flat(), 3));
  const line = new Line(geometry, new LineDashedMaterial({ color: colour, dashSize: 0.02, gapSize: 0.012 }));
  line.computeLineDistances();
  return line;
}

export function axes(length: number): LineSegments {
  const geometry = new BufferGeometry();
  const ends = [0, 1, 2].flatMap((axis) => [0, 0, 0, ...[0, 1, 2].map((i) => (i === axis ? length : 0))]);
  const colours = AXES.flatMap((hex) => [...new LineBasicMaterial({ color: hex }).color.toArray()]);
  const doubled = [0, 1, 2].flatMap((axis) => [...colours.slice(3 * axis, 3 * axis + 3), ...colours.slice(3 * axis, 3 * axis + 3)]);
  geometry.setAttribute('position', new Float32BufferAttribute(ends, 3));
  geometry.setAttribute('color', new Float32BufferAttribute(doubled, 3));
  return new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true, linewidth: 2 }));
}

export function ball(radius: number, colour: ColorRepresentation): Mesh {
  return new Mesh(new SphereGeometry(radius, 20, 14), new MeshBasicMaterial({ color: colour }));
}

// A ball and axes at each waypoint, which knows its number.
export function waypointMarks(answer: PlanAnswer, size: number, chosen: number, colour: string, mark: string): Group {
  const group = new Group();
  answer.waypoints.forEach((waypoint, index) => {
    const at = new Group();
    at.position.fromArray(waypoint.pose.position);
    const turn = quaternionOf(waypoint.pose.orientation);
    if (turn) {
      at.quaternion.set(...turn);
      at.add(axes(size * (index === chosen ? 6 : 3.5)));
    }
    const round = ball(index === chosen ? size * 1.5 : size, index === chosen ? mark : colour);
    round.userData.waypoint = index;
    at.add(round);
    group.add(at);
  });
  return group;
}

export function disposeOf(object: Object3D | undefined): void {
  object?.traverse((node) => {
    if (node instanceof Mesh || node instanceof Line) (node.geometry as BufferGeometry).dispose();
  });
  object?.removeFromParent();
}
