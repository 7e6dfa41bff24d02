// The form of a request that comes from outside: a link, a file, a text. What the page reads is checked here, the rest by
// the service.
import type { CellRequest, OrderRequest, PlanRequest } from '../service/types';
import { MOST_ROBOTS, shownOf } from './cells';
import { byKind, flag, list, matching, nullable, number, object, oneOf, record, text } from './shape';
import type { Check } from './shape';

const MOST_WAYPOINTS = 1000; // of the service

const vector = list(number, { least: 3, most: 3 });
const range = list(number, { least: 2, most: 2 });

const orientation = byKind({
  quaternion: object({ xyzw: list(number, { least: 4, most: 4 }) }),
  rpy: object({ rpy: vector }),
  matrix: object({ matrix: list(vector, { least: 3, most: 3 }) }),
});
const pose = object({ position: vector }, { orientation: nullable(orientation) });

const numbers = nullable(list(number));
const limits = object(
  {},
  {
    velocity: numbers,
    acceleration: numbers,
    jerk: numbers,
    torque: numbers,
    velocity_range: nullable(list(range)),
    acceleration_range: nullable(list(range)),
    torque_range: nullable(list(range)),
    tcp_linear_velocity: nullable(number),
    velocity_scale: number,
    acceleration_scale: number,
    torque_scale: number,
  },
);

const kindOnly = object({});
const constraint = byKind({
  tool_axis: object({ direction: vector, angle: number }, { axis: vector }),
  orientation: object({ orientation, angle: number }),
  plane: object({ point: vector, normal: vector, distance: number }),
  line: object({ point: vector, direction: vector, distance: number }),
  box: object({ pose, size: vector }),
  half_space: object({ normal: vector, offset: number }),
});
const motion = byKind({
  joint: kindOnly,
  linear: kindOnly,
  circular: kindOnly,
  polyline: kindOnly,
  spline: kindOnly,
  free: object(
    {},
    { optimise: nullable(oneOf('duration', 'effort', 'path_length')), time_budget: nullable(number), keep: list(constraint) },
  ),
});
const transition = byKind({ stop: kindOnly, through: kindOnly, blend: object({ radius: number }) });

const ofEveryWaypoint = {
  name: nullable(text),
  motion,
  duration: nullable(number),
  dwell: number,
  transition,
  limits: nullable(limits),
  attach: list(object({ id: text }, { link: nullable(text) })),
  detach: list(text),
  tool: nullable(pose),
};
const sides = object({}, { shoulder: nullable(text), elbow: nullable(text), wrist: nullable(text) });
const move = byKind({ cartesian: object({ translation: vector }), cylindrical: kindOnly, spherical: kindOnly });
const goals = {
  joint: object({ position: list(number, { least: 1 }) }, ofEveryWaypoint),
  pose: object({ pose }, { ...ofEveryWaypoint, on: nullable(text), frame: nullable(text), configuration: nullable(sides) }),
  named: object({ name: text }, ofEveryWaypoint),
};
const relative = object({ frame: oneOf('tool', 'base'), move }, ofEveryWaypoint);
const sequence = object({ waypoints: list(byKind({ ...goals, relative }), { least: 1 }) });
const goalSet = object({ options: list(byKind({ ...goals, sequence }), { least: 1 }) }, { name: nullable(text) });
const waypoint = byKind({ ...goals, relative, any_of: goalSet });

const sphere = object({ radius: number });
const roller = object({ radius: number, length: number });
const points = list(vector, { least: 1 });
const shape = byKind({
  box: object({ size: vector }),
  sphere,
  cylinder: roller,
  capsule: roller,
  half_space: object({ normal: vector }, { offset: number }),
  convex: object({ vertices: list(vector, { least: 4 }) }),
  mesh: mesh,
  point_cloud: object({ points, radius: number }),
});

function mesh(value: unknown, at: string): string | null {
  const form = object({ vertices: points, triangles: list(vector, { least: 1 }) })(value, at);
  if (form !== null) return form;
  const { vertices, triangles } = value as { vertices: unknown[]; triangles: number[][] };
  const isCorner = (index: number): boolean => Number.isInteger(index) && index >= 0 && index < vertices.length;
  const wrong = triangles.findIndex((corners) => !corners.every(isCorner));
  return wrong < 0 ? null : `${at}/triangles/${wrong} must have indices of vertices; got ${JSON.stringify(triangles[wrong])}`;
}

const objectMotion = byKind({
  linear: object({ velocity: vector }, { end: nullable(number) }),
  timed_poses: object({ poses: list(object({ time: number, pose }), { least: 1 }) }),
});
const ofThing = { pose: nullable(pose), margin: nullable(number) };
const attached = list(object({ id: text, shape }, { ...ofThing, link: nullable(text), touch_links: list(text) }));
const pairs = list(list(text));
const scene = object(
  {},
  {
    objects: list(object({ id: text, shape }, { ...ofThing, frame: text, motion: nullable(objectMotion) })),
    attached,
    allowed_pairs: pairs,
    margin: number,
  },
);
const sceneOrId: Check = (value, at) => (typeof value === 'string' ? null : scene(value, at));

const name = (of: string): Check => matching(/^[A-Za-z0-9][A-Za-z0-9_.-]*$/, of);
const ofEveryRobot = {
  limits,
  tool: nullable(pose),
  mounting: nullable(pose),
  duration: nullable(number),
  self_collision: nullable(flag),
  speed_zones: list(object({ clearance: number, speed: number }, { objects: nullable(list(text)) })),
  sample_period: number,
  include: list(text),
  backend: object({ kind: text }),
};
const planned = { robot: name('the id of a robot'), waypoints: list(waypoint, { least: 1, most: MOST_WAYPOINTS }) };
const around = { frames: record(pose), scene: nullable(sceneOrId) };

const request = object(planned, { ...ofEveryRobot, ...around });
const member = object({ ...planned, name: name('the name of a robot in the cell') }, { ...ofEveryRobot, attached, allowed_pairs: pairs });
const cell = object(
  { robots: list(member, { least: 2, most: MOST_ROBOTS }) },
  { ...around, margin: number, skew: number, meetings: list(text), allowed_pairs: pairs },
);

// Tasks in any order from a JSON text, which the service checks; null: it is something else.
export function tasksOf(json: string): OrderRequest | null {
  try {
    const value: unknown = JSON.parse(json);
    return typeof value === 'object' && value !== null && 'tasks' in value ? (value as OrderRequest) : null;
  } catch {
    return null;
  }
}

export type Parsed = { request: PlanRequest; fault?: undefined } | { request?: undefined; fault: string };

// Reads a request from a JSON text, or a cell as the request of its first robot; else the fault says which field must be what.
export function parseRequest(json: string): Parsed {
  let value: unknown;
  try {
    value = JSON.parse(json);
  } catch (error) {
    return { fault: error instanceof Error ? error.message : String(error) };
  }
  const isCell = typeof value === 'object' && value !== null && 'robots' in value;
  const fault = (isCell ? cell : request)(value, '');
  if (fault !== null) return { fault };
  return { request: isCell ? shownOf(value as CellRequest, 0) : (value as PlanRequest) };
}
