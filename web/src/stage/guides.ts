// A path that is not yet in the request: its line, and a ball at each waypoint that the tool cannot reach.
import { Group } from 'three';
import { Line2 } from 'three/examples/jsm/lines/Line2.js';
import { LineGeometry } from 'three/examples/jsm/lines/LineGeometry.js';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import type { Pose } from '../service/types';
import { ball } from './marks';

export interface PreviewedPath {
  line: readonly (readonly number[])[];
  poses: readonly Pose[];
  missed: readonly number[];
}

const WIDTH = 3; // pixels

export function previewMarks({ line, poses, missed }: PreviewedPath, size: number, colour: string, bad: string): Group {
  const group = new Group();
  if (line.length > 1) {
    const geometry = new LineGeometry();
    geometry.setPositions(line.flatMap((point) => [...point]));
    group.add(new Line2(geometry, new LineMaterial({ color: colour, linewidth: WIDTH })));
  }
  const ends = [poses[0], poses.at(-1)].flatMap((pose) => pose ?? []);
  for (const { position } of ends) group.add(ball(position, size, colour));
  for (const index of missed) if (poses[index]) group.add(ball(poses[index].position, 1.2 * size, bad));
  return group;
}
