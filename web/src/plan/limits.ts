// The limits in force on each segment: the robot's, narrowed by the request's and the waypoint's.
import type { Limits, PlanRequest, Robot } from '../service/types';

export type Quantity = 'position' | 'velocity' | 'acceleration' | 'jerk' | 'torque';

export interface Band {
  lower: number | null;
  upper: number | null;
}

// The band of a joint on the way to waypoint `goal`; null: no limit on that side.
export function bandOf(robot: Robot, request: PlanRequest, quantity: Quantity, joint: number, goal: number): Band {
  const described = robot.joints[joint]!;
  if (quantity === 'position') return { lower: described.lower, upper: described.upper };
  const whole = request.limits;
  const own = request.waypoints[goal]?.limits ?? undefined;
  const scale = scaleOf(whole, quantity) * scaleOf(own, quantity);
  const ranges = [rangeOf(described, quantity), rangeAsked(own, quantity, joint), rangeAsked(whole, quantity, joint)];
  const present = ranges.filter((range) => range !== null);
  if (present.length === 0) return { lower: null, upper: null };
  return {
    lower: Math.max(...present.map(([lower]) => lower)) * scale,
    upper: Math.min(...present.map(([, upper]) => upper)) * scale,
  };
}

function scaleOf(limits: Limits | undefined, quantity: Quantity): number {
  if (quantity === 'velocity') return limits?.velocity_scale ?? 1;
  return quantity === 'acceleration' ? (limits?.acceleration_scale ?? 1) : 1;
}

type Range = readonly [number, number];

function rangeOf(joint: Robot['joints'][number], quantity: Exclude<Quantity, 'position'>): Range | null {
  const range = quantity === 'jerk' ? null : joint[`${quantity}_range`];
  if (range) return [range[0]!, range[1]!];
  const limit = joint[quantity];
  return limit === null ? null : [-limit, limit];
}

function rangeAsked(limits: Limits | undefined, quantity: Exclude<Quantity, 'position'>, joint: number): Range | null {
  const range = quantity === 'jerk' ? null : limits?.[`${quantity}_range`]?.[joint];
  if (range) return [range[0]!, range[1]!];
  const limit = limits?.[quantity]?.[joint];
  return limit === undefined ? null : [-limit, limit];
}

// The limit of the tool's speed on the way to waypoint `goal`, m/s; null: none.
export function toolSpeedLimit(request: PlanRequest, goal: number): number | null {
  const own = request.waypoints[goal]?.limits?.tcp_linear_velocity;
  const limits = [own, request.limits?.tcp_linear_velocity].filter((limit) => typeof limit === 'number');
  return limits.length > 0 ? Math.min(...limits) : null;
}
