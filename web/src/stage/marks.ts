// What is drawn beside the robot: the tool's path, waypoints, frames, the place of a refusal.
import {
  BufferGeometry,
  Color,
  Float32BufferAttribute,
  Group,
  InstancedMesh,
  Line,
  LineBasicMaterial,
  LineDashedMaterial,
  LineSegments,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  SphereGeometry,
  Vector3,
} from 'three';
import type { ColorRepresentation, Object3D } from 'three';
import { Line2 } from 'three/examples/jsm/lines/Line2.js';
import { LineGeometry } from 'three/examples/jsm/lines/LineGeometry.js';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import type { PlanAnswer } from '../service/types';
import { quaternionOf } from '../request/rotations';
import { shareColour } from './colours';

const PATH_WIDTH = 4; // pixels
const AXES = ['#d7263d', '#2b8a3e', '#1c6fd6'].map((hex) => new Color(hex));

// The tool's path, coloured by a share from 0 to 1 at each sample; it lies in the base frame.
export function pathLine(answer: PlanAnswer, shares: readonly number[], dark: boolean): Object3D {
  const points = answer.samples.tcp_pose?.position ?? [];
  const geometry = new LineGeometry();
  geometry.setPositions(points.flat());
  geometry.setColors(shares.flatMap((share) => shareColour(share, dark).toArray()));
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

export function ball(radius: number, colour: ColorRepresentation): Mesh {
  return new Mesh(new SphereGeometry(radius, 20, 14), new MeshBasicMaterial({ color: colour }));
}

// A ball and axes at each waypoint; the number of a ball is that of its planned waypoint.
export function waypointMarks(answer: PlanAnswer, size: number, chosen: number, colour: string, mark: string): Group {
  const material = new MeshBasicMaterial();
  const balls = new InstancedMesh(new SphereGeometry(size, 16, 10), material, answer.waypoints.length);
  const frames: { matrix: Matrix4; length: number }[] = [];
  answer.waypoints.forEach(({ pose, index: waypoint }, index) => {
    const isChosen = waypoint === chosen;
    const turn = quaternionOf(pose.orientation);
    const at = new Vector3().fromArray(pose.position);
    const matrix = new Matrix4().compose(at, turn ? new Quaternion(...turn) : new Quaternion(), new Vector3(1, 1, 1));
    if (turn) frames.push({ matrix, length: size * (isChosen ? 6 : 3.5) });
    balls.setMatrixAt(index, isChosen ? matrix.clone().scale(new Vector3(1.5, 1.5, 1.5)) : matrix);
    balls.setColorAt(index, new Color(isChosen ? mark : colour));
  });
  return new Group().add(balls, allAxes(frames));
}

export function disposeOf(object: Object3D | undefined): void {
  object?.traverse((node) => {
    if (node instanceof Mesh || node instanceof Line) (node.geometry as BufferGeometry).dispose();
  });
  object?.removeFromParent();
}
