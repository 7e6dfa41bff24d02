import { Matrix4, Quaternion, Vector3 } from 'three';
import type { BufferGeometry, Object3D } from 'three';
import { expect, test } from 'vitest';
import type { PlanAnswer } from '../service/types';
import { pathLine, toolMarks } from './marks';

// The ends of the lines of an object, by pairs.
function ends(object: Object3D, name: 'instanceStart' | 'instanceEnd'): number[][] {
  const attribute = (object as Object3D & { geometry: BufferGeometry }).geometry.getAttribute(name);
  return Array.from({ length: attribute.count }, (_, i) =>
    [attribute.getX(i), attribute.getY(i), attribute.getZ(i)].map((value) => Math.round(value * 1e5) / 1e5 + 0),
  );
}

test('the path is one line for each tool: none leads from one tool centre point to the next', () => {
  const position = [
    [0, 0, 0],
    [1, 0, 0],
    [1, 5, 0],
    [2, 5, 0],
    [3, 5, 0],
  ];
  const answer = { samples: { tcp_pose: { position } } } as unknown as PlanAnswer;
  const { children } = pathLine(
    answer,
    [0, 0, 0, 0, 0],
    [
      [0, 2],
      [2, 5],
    ],
    false,
  );
  expect(children.map((line) => ends(line, 'instanceStart'))).toEqual([
    [[0, 0, 0]],
    [
      [1, 5, 0],
      [2, 5, 0],
    ],
  ]);
  expect(children.map((line) => ends(line, 'instanceEnd'))).toEqual([
    [[1, 0, 0]],
    [
      [2, 5, 0],
      [3, 5, 0],
    ],
  ]);
});

test('a tool is a line from the tip to its centre point, and a ring around the tip', () => {
  const tool = new Matrix4().compose(
    new Vector3(0.1, 0, 0.2),
    new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), Math.PI / 2),
    new Vector3(1, 1, 1),
  );
  const tip = new Matrix4().makeTranslation(1, 2, 3);
  const mark = toolMarks([{ at: tip.clone().multiply(tool), tool }], 0.05, 'red')!;
  const [first, ...ring] = ends(mark, 'instanceStart');
  expect(first).toEqual([1, 2, 3]);
  expect(ends(mark, 'instanceEnd')[0]).toEqual([1.1, 2, 3.2]);
  for (const [x, y, z] of ring) {
    expect(Math.hypot(x! - 1, y! - 2)).toBeCloseTo(0.05, 4);
    expect(z).toBe(3);
  }
});

test('a tool without length has no mark', () => {
  expect(toolMarks([{ at: new Matrix4(), tool: new Matrix4() }], 0.05, 'red')).toBeUndefined();
});
