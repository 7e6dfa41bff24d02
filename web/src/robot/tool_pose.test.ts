import { Matrix4, Quaternion, Vector3 } from 'three';
import { expect, test } from 'vitest';
import { quaternionOf } from '../request/rotations';
import type { Robot } from '../service/types';
import { drawnTool } from '../scene/objects';
import { jointMatrices, matrixOf, toolMatrix } from './chain';
import { toolPose } from './tool_pose';

const random = (): number => 2 * Math.random() - 1;
const placement = (): { position: number[]; quaternion_xyzw: number[] } => ({
  position: [random(), random(), random()],
  quaternion_xyzw: new Quaternion(random(), random(), random(), random()).normalize().toArray(),
});

// A robot with joints of both kinds about any axes, whose tip is behind all of them.
function anyRobot(joints: number): Robot {
  const kinds = Array.from({ length: joints }, (_, i) => (i % 3 === 2 ? 'prismatic' : 'revolute'));
  return {
    joints: kinds.map((kind) => ({ kind })),
    chain: kinds.map(() => ({ ...placement(), axis: new Vector3(random(), random(), random()).normalize().toArray() })),
    placements: [{ frame: 'tip', after: joints, ...placement() }],
    tip_frame: 'tip',
    tool: placement(),
  } as unknown as Robot;
}

test.each([0, 1, 6, 9])('the tool of a robot with %i joints is where three has it', (joints) => {
  const robot = anyRobot(joints);
  const position = robot.joints.map(() => 3 * random());
  const { position: at, orientation } = toolPose(robot, position, null);
  const found = new Matrix4().compose(new Vector3(...at), new Quaternion(...quaternionOf(orientation)!), new Vector3(1, 1, 1));
  toolMatrix(robot, position).elements.forEach((value, i) => expect(found.elements[i]).toBeCloseTo(value, 9));
});

test('beside a positioner all is drawn in the frame in which it stands', () => {
  const robot = { ...anyRobot(6), positioner: ['turn', 'tilt'] };
  robot.placements = [...robot.placements, { frame: 'positioner_base', after: 2, ...placement() }] as Robot['placements'];
  const still = { ...robot, positioner: undefined };
  const position = robot.joints.map(() => 3 * random());
  const [inBase, drawn] = [still as Robot, robot as Robot].map((one) => jointMatrices(one, position));
  const foot = drawn![2]!.clone().multiply(matrixOf(robot.placements[1]!));
  foot.elements.forEach((value, i) => expect(value).toBeCloseTo(new Matrix4().elements[i]!, 9));
  drawn!.forEach((matrix, k) => {
    const again = drawn![0]!.clone().multiply(inBase![k]!);
    matrix.elements.forEach((value, i) => expect(value).toBeCloseTo(again.elements[i]!, 9));
  });
});

test('a tool that stands in the cell is not drawn as if the arm held it', () => {
  const robot = anyRobot(6);
  const fixed = { ...robot, tip_frame: 'positioner_base' };
  expect(drawnTool(null, robot).equals(matrixOf(robot.tool))).toBe(true);
  expect(drawnTool(null, fixed).equals(new Matrix4())).toBe(true);
});
