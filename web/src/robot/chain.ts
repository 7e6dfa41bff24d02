// Where joints and frames are at a joint position, from the robot's `chain` and `placements`.
import { Matrix4, Quaternion, Vector3 } from 'three';
import type { Placement, Robot } from '../service/types';

const ONE = new Vector3(1, 1, 1);

export function matrixOf({ position, quaternion_xyzw }: Placement): Matrix4 {
  return new Matrix4().compose(new Vector3().fromArray(position), new Quaternion().fromArray(quaternion_xyzw), ONE);
}

const STANDING = 'positioner_base'; // the frame in which arm and positioner stand, while the base moves with the workpiece

// Whether the tool stands in the cell, and the arm holds the workpiece.
export function hasFixedTool(robot: Robot): boolean {
  return robot.tip_frame === STANDING;
}

// The matrices of the base and of each joint's frame, in the frame that stands still: a frame `after` n joints moves with entry n.
export function jointMatrices(robot: Robot, position: readonly number[]): Matrix4[] {
  const matrices = matricesInBase(robot, position);
  const foot = robot.positioner && robot.placements.find(({ frame }) => frame === STANDING);
  if (!foot) return matrices;
  const base = matrices[foot.after]!.clone().multiply(matrixOf(foot)).invert();
  return matrices.map((matrix) => matrix.premultiply(base));
}

function matricesInBase(robot: Robot, position: readonly number[]): Matrix4[] {
  const matrices = [new Matrix4()];
  const motion = new Matrix4();
  const axis = new Vector3();
  robot.chain.forEach((joint, index) => {
    axis.fromArray(joint.axis);
    const value = position[index] ?? 0;
    if (robot.joints[index]!.kind === 'prismatic') motion.makeTranslation(axis.multiplyScalar(value));
    else motion.makeRotationAxis(axis, value);
    matrices.push(matrices[index]!.clone().multiply(matrixOf(joint)).multiply(motion));
  });
  return matrices;
}

// The matrix of the tool centre point in the base frame.
export function toolMatrix(robot: Robot, position: readonly number[]): Matrix4 {
  const tip = robot.placements.find((placement) => placement.frame === robot.tip_frame)!;
  return matricesInBase(robot, position)[tip.after]!.multiply(matrixOf(tip)).multiply(matrixOf(robot.tool));
}
