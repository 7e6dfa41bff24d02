// What stands around the robot and what it carries, as a request's scene says it, and where that is.
import { Matrix4, Quaternion, Vector3 } from 'three';
import type { PlanRequest, Pose, Robot, Scene, SceneShape } from '../service/types';
import { hasFixedTool, matrixOf } from '../robot/chain';
import { quaternionOf } from '../request/rotations';
import { movedPose } from './motions';

export interface Placed {
  id: string;
  shape: SceneShape;
  margin: number; // m
  matrix: Matrix4; // in the frame that stands still; of what is carried: behind so many joints
  after: number | null; // joints before it; null: none
  by: number; // the robot whose joints these are: 0 is the one that is shown
  at?: (time: number) => Matrix4; // of a moving object: the matrix at a time, s
}

// What of a request says where things are.
export type Setting = Pick<PlanRequest, 'frames' | 'tool' | 'mounting'> & { scene?: Scene | null };

const ONE = new Vector3(1, 1, 1);

// The objects of a scene in the frame that stands still, and what is attached to the robot behind its joints.
export function placedOf(setting: Setting, robot: Robot, by = 0): Placed[] {
  const { scene } = setting;
  if (!scene) return [];
  const toBase = mountingOf(setting, robot).invert();
  const usual = scene.margin ?? 0;
  const objects = (scene.objects ?? []).map(({ id, shape, pose, frame, margin, motion }): Placed => {
    const inFrame = matrixOfPose(pose);
    const toFrame = frame === 'base' ? new Matrix4() : toBase.clone().multiply(frameOf(setting, frame));
    const there: Placed = { id, shape, margin: margin ?? usual, matrix: toFrame.clone().multiply(inFrame), after: null, by: 0 };
    return motion ? { ...there, at: (time) => toFrame.clone().multiply(movedPose(motion, inFrame, time)) } : there;
  });
  const attached = (scene.attached ?? []).flatMap(({ id, shape, pose, link, margin }): Placed[] => {
    const holder = placeOfLink(setting, robot, link);
    if (!holder) return [];
    return [{ id, shape, margin: margin ?? 0, matrix: holder.matrix.multiply(matrixOfPose(pose)), after: holder.after, by }];
  });
  return [...objects, ...attached];
}

// The base in the world: where the request says, else where the robot does.
export function mountingOf(setting: Setting, robot: Robot): Matrix4 {
  if (setting.mounting) return matrixOfPose(setting.mounting);
  return robot.mounting ? matrixOf(robot.mounting) : new Matrix4();
}

// The tool centre point in the tip frame: the tool that is asked for, else the robot's.
export function toolOf(tool: Pose | null | undefined, robot: Robot): Matrix4 {
  return tool ? matrixOfPose(tool) : matrixOf(robot.tool);
}

// The tool that is drawn between the tip and its centre point: none of a tool that stands in the cell.
export function drawnTool(tool: Pose | null | undefined, robot: Robot): Matrix4 {
  return hasFixedTool(robot) ? new Matrix4() : toolOf(tool, robot);
}

// A pose without an orientation has the axes of its frame.
export function matrixOfPose(pose: Pose | null | undefined): Matrix4 {
  const turn = pose?.orientation ? quaternionOf(pose.orientation) : null;
  const at = new Vector3().fromArray(pose?.position ?? [0, 0, 0]);
  return new Matrix4().compose(at, turn ? new Quaternion(...turn) : new Quaternion(), ONE);
}

function frameOf(setting: Setting, frame: string | undefined): Matrix4 {
  return matrixOfPose(frame === undefined ? null : setting.frames?.[frame]);
}

// Without a link it is the tool that holds.
function placeOfLink(setting: Setting, robot: Robot, link: string | null | undefined): { after: number; matrix: Matrix4 } | null {
  const placement = robot.placements.find(({ frame }) => frame === (link ?? robot.tip_frame));
  if (!placement) return null;
  const matrix = matrixOf(placement);
  return { after: placement.after, matrix: link ? matrix : matrix.multiply(toolOf(setting.tool, robot)) };
}
