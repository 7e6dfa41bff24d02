// A path that is read from a file, before it is added: its points, its extent, and what may be added to a request.
import type { PlanRequest, Pose, Robot, Waypoint } from '../service/types';
import { toolPose } from '../robot/tool_pose';
import { poseInBase } from './places';

export const PATH_FRAME = 'path';

export interface Extent {
  from: readonly number[]; // m, in the base frame
  to: readonly number[];
}

// The request with the waypoints of a path, and the frame that they are in: behind the others, or in their place.
export function withPath(request: PlanRequest, path: readonly Waypoint[], at: Pose, isAdded: boolean): PlanRequest {
  const usesFrame = path.some((waypoint) => 'frame' in waypoint && waypoint.frame === PATH_FRAME);
  const frames = usesFrame ? { ...request.frames, [PATH_FRAME]: at } : request.frames;
  const waypoints = isAdded ? [...request.waypoints, ...path] : [...path];
  return { ...request, waypoints, ...(frames ? { frames } : {}) };
}

// The tool's poses at the waypoints, and the points of its path between them, in the base frame of the robot.
export function placesOf(request: PlanRequest, path: readonly Waypoint[], robot: Robot): { poses: Pose[]; line: number[][] } {
  const poses: Pose[] = [];
  const line: number[][] = [];
  for (const waypoint of path) {
    const pose = poseOfWaypoint(waypoint, request, robot);
    if (!pose) continue;
    line.push(...pointsOf(waypoint, pose, line.at(-1), request, robot));
    poses.push(pose);
  }
  return { poses, line };
}

function poseOfWaypoint(waypoint: Waypoint, request: PlanRequest, robot: Robot): Pose | null {
  if (waypoint.kind === 'joint') return toolPose(robot, waypoint.position, request.tool ?? null);
  return waypoint.kind === 'pose' ? poseInBase(waypoint, request, robot) : null;
}

const ARC_STEPS = 24;

// The points of the motion to a waypoint, its end last.
function pointsOf(waypoint: Waypoint, end: Pose, start: number[] | undefined, request: PlanRequest, robot: Robot): number[][] {
  const { motion } = waypoint;
  const placed = (pose: Pose): number[] => poseOfWaypoint({ ...waypoint, pose } as Waypoint, request, robot)!.position;
  if (motion?.kind === 'polyline') return [...motion.poses.map(placed), end.position];
  if (motion?.kind === 'circular' && start) return arc(start, placed(motion.via), end.position);
  return [end.position];
}

type Three = readonly number[];
const minus = (a: Three, b: Three): number[] => a.map((value, i) => value - b[i]!);
const dot = (a: Three, b: Three): number => a.reduce((sum, value, i) => sum + value * b[i]!, 0);
const scaled = (a: Three, factor: number): number[] => a.map((value) => value * factor);
const cross = (a: Three, b: Three): number[] => [
  a[1]! * b[2]! - a[2]! * b[1]!,
  a[2]! * b[0]! - a[0]! * b[2]!,
  a[0]! * b[1]! - a[1]! * b[0]!,
];

// Points on the arc from one point past another to a third, without the first; of three on a line, the line.
export function arc(from: Three, past: Three, to: Three): number[][] {
  const [a, b] = [minus(past, from), minus(to, from)];
  const normal = cross(a, b);
  const size = dot(normal, normal);
  if (size < 1e-18) return [[...past], [...to]];
  const toMiddle = scaled(cross(minus(scaled(b, dot(a, a)), scaled(a, dot(b, b))), normal), 1 / (2 * size));
  const middle = from.map((value, i) => value + toMiddle[i]!);
  const x = minus(from, middle);
  const y = scaled(cross(normal, x), 1 / Math.sqrt(size));
  const angleOf = (point: Three): number => {
    const out = minus(point, middle);
    return (Math.atan2(dot(out, y), dot(out, x)) + 2 * Math.PI) % (2 * Math.PI);
  };
  const angle = angleOf(to);
  return Array.from({ length: ARC_STEPS }, (_, i) => {
    const at = (angle * (i + 1)) / ARC_STEPS;
    return middle.map((value, axis) => value + Math.cos(at) * x[axis]! + Math.sin(at) * y[axis]!);
  });
}

export function extentOf(points: readonly Three[]): Extent | null {
  if (points.length === 0) return null;
  const [from, to] = [Math.min, Math.max].map((pick) => [0, 1, 2].map((axis) => pick(...points.map((point) => point[axis]!))));
  return { from: from!, to: to! };
}
