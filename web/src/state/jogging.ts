// The tool moved by hand along the axes of a frame: base, tool or a frame of the request.
import { computed, effect, signal } from '@preact/signals';
import { toolAt } from '../plan/tools';
import { frameInBase, poseInFrame } from '../request/frames';
import { composed, inverted } from '../request/poses';
import { shift, toolPose, turn } from '../robot/tool_pose';
import type { Pose, Solution } from '../service/types';
import { isPosed, pose, jointPosition } from './jointPosition';
import { askHindrance, askReach, endReach, isAsking } from './reaching';
import { request, robot, selected } from './store';

export const frame = signal('base');

export function chooseFrame(name: string): void {
  frame.value = name;
}

// The frames whose axes the tool can move along.
export const frames = computed(() => ['base', 'tool', ...Object.keys(request.value?.frames ?? {})]);

const shownFrame = computed(() => (frames.value.includes(frame.value) ? frame.value : 'base'));

// The tool at the chosen waypoint, where the robot stands, in the base frame.
const atTool = computed(() => {
  const [arm, shown] = [robot.value, request.value];
  if (!arm || !shown || jointPosition.value.length !== arm.joints.length) return null;
  return toolPose(arm, jointPosition.value, toolAt(shown, selected.value));
});

// The same in the chosen frame; along the axes of the tool, people read it in the base frame.
export const readout = computed(() => {
  const [arm, shown, at] = [robot.value, request.value, atTool.value];
  if (!arm || !shown || !at || shownFrame.value === 'tool') return at;
  return poseInFrame(at, shownFrame.value, shown, arm);
});

// A jogged robot that is led back to the plan is asked about no more.
effect(() => {
  if (!isPosed.value) endReach();
});

let goal: Pose | null = null;

// Moves the tool along an axis by m, or turns it about the axis by rad; the arm stays in its configuration.
export function jog(kind: 'shift' | 'turn', axis: number, by: number): void {
  const from = isAsking() && goal ? goal : atTool.value;
  if (!from || !robot.value || !request.value) return;
  const along = [0, 1, 2].map((i) => (i === axis ? 1 : 0));
  const step = kind === 'shift' ? shift(along, by) : turn(along, by);
  const axes = shownFrame.value === 'tool' ? from : frameInBase(shownFrame.value, request.value, robot.value);
  if (!axes) return;
  const atPoint = { position: from.position, orientation: axes.orientation ?? null };
  goal = [atPoint, step, inverted(atPoint), from].reduce(composed);
  askReach(goal, jointPosition.value, pose, nearestOf);
}

// Moves one joint, and looks at what is in the way.
export function jogJoint(joint: number, to: number): void {
  const position = jointPosition.value.map((old, i) => (i === joint ? to : old));
  pose(position);
  askHindrance(position);
}

function nearestOf(all: readonly Solution[], reference: readonly number[]): Solution | undefined {
  const distance = ({ position }: Solution): number => Math.hypot(...position.map((value, i) => value - reference[i]!));
  return [...all].sort((a, b) => distance(a) - distance(b))[0];
}
