import { describe, expect, test } from 'vitest';
import type { SceneShape } from '../service/types';
import { shapeOfFile } from './import';
import type { Fault } from './import';

type Corner = [number, number, number];

const random = (): number => Math.round((Math.random() - 0.5) * 2e5) / 100; // mm, hundredths
const corners: Corner[] = Array.from({ length: 8 }, () => [random(), random(), random()]);
const faces: Corner[] = [
  [0, 1, 2],
  [2, 1, 3],
  [4, 6, 5],
  [7, 0, 4],
  [3, 5, 7],
];

const bytes = (text: string): ArrayBuffer => new TextEncoder().encode(text).buffer;

const asciiStl = (): ArrayBuffer => {
  const facet = (face: Corner): string => face.map((i) => `vertex ${corners[i]!.join(' ')}`).join('\n');
  return bytes(
    `solid a\n${faces.map((face) => `facet normal 0 0 1\nouter loop\n${facet(face)}\nendloop\nendfacet`).join('\n')}\nendsolid a\n`,
  );
};

const binaryStl = (): ArrayBuffer => {
  const view = new DataView(new ArrayBuffer(84 + 50 * faces.length));
  view.setUint32(80, faces.length, true);
  faces.forEach((face, number) =>
    face.forEach((i, corner) =>
      corners[i]!.forEach((value, axis) => view.setFloat32(84 + 50 * number + 12 * (corner + 1) + 4 * axis, value, true)),
    ),
  );
  return view.buffer;
};

const obj = (): ArrayBuffer =>
  bytes(
    `${corners.map((corner) => `v ${corner.join(' ')}`).join('\n')}\n${faces.map((face) => `f ${face.map((i) => i + 1).join(' ')}`).join('\n')}\n`,
  );

const ply = (withFaces: boolean): ArrayBuffer =>
  bytes(
    `ply\nformat ascii 1.0\nelement vertex ${corners.length}\nproperty float x\nproperty float y\nproperty float z\n` +
      (withFaces ? `element face ${faces.length}\nproperty list uchar int vertex_indices\n` : '') +
      `end_header\n${corners.map((corner) => corner.join(' ')).join('\n')}\n` +
      (withFaces ? `${faces.map((face) => `3 ${face.join(' ')}`).join('\n')}\n` : ''),
  );

const pcd = (): ArrayBuffer =>
  bytes(
    `# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH ${corners.length}\nHEIGHT 1\n` +
      `VIEWPOINT 0 0 0 1 0 0 0\nPOINTS ${corners.length}\nDATA ascii\n${corners.map((corner) => corner.join(' ')).join('\n')}\n`,
  );

const METRES = 0.001;
const inMetres = (point: readonly number[]): number[] => point.map((value) => Number((value * METRES).toFixed(6)));

function near(found: readonly (readonly number[])[], wanted: readonly (readonly number[])[]): void {
  expect(found).toHaveLength(wanted.length);
  found.forEach((point, i) => point.forEach((value, axis) => expect(value).toBeCloseTo(wanted[i]![axis]!, 5)));
}

describe('a mesh', () => {
  test.each([
    ['a.stl', asciiStl],
    ['a.STL', binaryStl],
    ['part.v2.obj', obj],
    ['a.ply', () => ply(true)],
  ])('in %s has the triangles that were written, in m, with common corners', (name, content) => {
    const shape = shapeOfFile(name, content(), METRES) as Extract<SceneShape, { kind: 'mesh' }>;
    expect(shape.kind).toBe('mesh');
    expect(shape.vertices).toHaveLength(8);
    near(
      shape.triangles.flatMap((triangle) => triangle.map((i) => shape.vertices[i]!)),
      faces.flatMap((face) => face.map((i) => inMetres(corners[i]!))),
    );
  });
});

describe('a point cloud', () => {
  test.each([
    ['a.pcd', pcd],
    ['a.ply', () => ply(false)],
  ])('in %s has the points that were written', (name, content) => {
    const shape = shapeOfFile(name, content(), METRES) as Extract<SceneShape, { kind: 'point_cloud' }>;
    expect(shape.kind).toBe('point_cloud');
    near(shape.points, corners.map(inMetres));
    expect(shape.radius).toBeGreaterThanOrEqual(0.001);
  });
});

const many = 200_001;
const tooMany = (): ArrayBuffer =>
  bytes(
    `ply\nformat ascii 1.0\nelement vertex ${many}\nproperty float x\nproperty float y\nproperty float z\nend_header\n${'1 2 3\n'.repeat(many)}`,
  );

test.each<[string, () => ArrayBuffer, Fault]>([
  ['a.txt', obj, { fault: 'unknown', count: 0 }],
  ['a.obj', () => bytes('# nothing\n'), { fault: 'empty', count: 0 }],
  ['a.pcd', () => bytes('no header'), { fault: 'unreadable', count: 0 }],
  ['a.obj', () => bytes('v 1 1 1\nv 1 1 1\nv 2 2 2\nf 1 2 3\n'), { fault: 'empty', count: 0 }],
  ['a.ply', tooMany, { fault: 'points', count: many }],
])('%s is refused with the reason', (name, content, fault) => {
  expect(shapeOfFile(name, content(), 1)).toEqual(fault);
});
