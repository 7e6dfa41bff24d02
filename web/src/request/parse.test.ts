import { describe, expect, test } from 'vitest';
import { toolAt } from '../plan/tools';
import { placedOf } from '../scene/objects';
import type { PlanRequest, Robot, Scene } from '../service/types';
import { grownGeometry } from '../stage/geometry';
import { keptMarks } from '../stage/kept';
import { disposeOf } from '../stage/marks';
import { firstPosition } from '../state/jointPosition';
import { codeOf, LANGUAGES } from './code';
import { handledNames } from './handled';
import { parseRequest } from './parse';
import { quaternionOf, rpyOfQuaternion } from './rotations';
import { surroundingsOf } from './surroundings';
import { zonesOf } from './zones';

const still = { position: [0, 0, 0], quaternion_xyzw: [0, 0, 0, 1] };
const limits = {
  velocity: 1,
  acceleration: null,
  jerk: null,
  torque: null,
  velocity_range: null,
  acceleration_range: null,
  torque_range: null,
};
const arm = {
  id: 'arm',
  joint_names: ['a', 'b'],
  joints: ['a', 'b'].map((name) => ({ ...limits, name, kind: 'revolute', lower: -1, upper: null })),
  chain: [],
  placements: [{ frame: 'tip', after: 0, ...still }],
  tip_frame: 'tip',
  tool: still,
  mounting: null,
} as unknown as Robot;

// A request with every field that the page reads.
const about = { position: [0, 0, 1], orientation: { kind: 'rpy', rpy: [0, 0, 1] } };
const turned = {
  position: [0, 1, 0],
  orientation: {
    kind: 'matrix',
    matrix: [
      [1, 0, 0],
      [0, 1, 0],
      [0, 0, 1],
    ],
  },
};
const ways = {
  name: 'over there',
  duration: 2,
  dwell: 0.5,
  transition: { kind: 'blend', radius: 0.1 },
  tool: about,
  limits: {
    velocity: [1, 1],
    torque_range: [
      [-1, 1],
      [-2, 2],
    ],
    tcp_linear_velocity: 0.1,
    velocity_scale: 0.5,
  },
  attach: [{ id: 'ball', link: 'tip' }],
  detach: ['crate'],
  motion: {
    kind: 'free',
    optimise: 'effort',
    time_budget: 1,
    keep: [
      { kind: 'tool_axis', direction: [0, 0, 1], angle: 0.1, axis: [1, 0, 0] },
      { kind: 'orientation', orientation: { kind: 'rpy', rpy: [0, 0, 1] }, angle: 0.1 },
      { kind: 'box', pose: about, size: [1, 1, 1] },
      { kind: 'half_space', normal: [0, 0, 1], offset: 1 },
    ],
  },
};
const shapes = [
  { kind: 'box', size: [1, 1, 1] },
  { kind: 'sphere', radius: 1 },
  { kind: 'cylinder', radius: 1, length: 1 },
  { kind: 'capsule', radius: 1, length: 1 },
  { kind: 'half_space', normal: [0, 0, 1], offset: 0 },
  {
    kind: 'convex',
    vertices: [
      [0, 0, 0],
      [1, 0, 0],
      [0, 1, 0],
      [0, 0, 1],
    ],
  },
  {
    kind: 'mesh',
    vertices: [
      [0, 0, 0],
      [1, 0, 0],
      [0, 1, 0],
    ],
    triangles: [[0, 1, 2]],
  },
  { kind: 'point_cloud', points: [[0, 0, 0]], radius: 0.1 },
];
const FULL = {
  robot: 'arm',
  waypoints: [
    { kind: 'joint', position: [0, 1], ...ways },
    { kind: 'pose', pose: turned, frame: 'table', configuration: { shoulder: 'left', elbow: null }, ...ways },
    { kind: 'relative', frame: 'tool', move: { kind: 'cartesian', translation: [0, 0, 1] } },
    { kind: 'any_of', name: 'pick', options: [{ kind: 'sequence', waypoints: [{ kind: 'pose', pose: about }] }] },
    { kind: 'named', name: 'home' },
  ],
  limits: ways.limits,
  tool: about,
  frames: { table: about },
  mounting: turned,
  duration: 9,
  self_collision: true,
  scene: {
    objects: [
      ...shapes.map((shape, index) => ({ id: `thing ${index}`, shape, pose: about, frame: 'table', margin: 0.1 })),
      { id: 'crate', shape: shapes[0], motion: { kind: 'linear', velocity: [0, 1, 0], end: 2 } },
      { id: 'door', shape: shapes[0], motion: { kind: 'timed_poses', poses: [{ time: 1, pose: about }] } },
    ],
    attached: [{ id: 'ball', shape: shapes[1], pose: about, link: 'tip', touch_links: ['tip'], margin: 0 }],
    allowed_pairs: [['ball', 'thing 1']],
    margin: 0.01,
  },
  speed_zones: [{ clearance: 0.1, speed: 0.2, objects: ['thing 1'] }],
  sample_period: 0.01,
  include: ['jerk'],
  backend: { kind: 'cubic' },
};

const EXAMPLES = import.meta.glob<unknown>(['../../../examples/*.json', '../../../examples/jobs/*.json'], {
  import: 'default',
  eager: true,
});

const MALFORMED: readonly unknown[] = [
  [
    [0, 0, 0],
    [0, 0, 0],
    [0, 0, 0],
    [0, 0, 0],
  ],
  null,
  true,
  -1,
  1.5,
  '',
  'word',
  [],
  [null],
  [[1]],
  [1, 2, 3],
  [1, 2, 3, 4],
  {},
  { kind: 'word' },
  { kind: null },
  { 0: null },
];

type Path = readonly (string | number)[];

// The paths to all values in a document.
function pathsIn(document: unknown, at: Path = []): Path[] {
  if (typeof document !== 'object' || document === null) return [at];
  return [
    at,
    ...Object.entries(document).flatMap(([name, value]) => pathsIn(value, [...at, Array.isArray(document) ? Number(name) : name])),
  ];
}

function replaced(document: unknown, path: Path, value: unknown): unknown {
  const [key, ...rest] = path;
  if (key === undefined) return value;
  const copy: unknown = Array.isArray(document) ? [...(document as unknown[])] : { ...(document as object) };
  (copy as Record<string | number, unknown>)[key] = replaced((document as Record<string | number, unknown>)[key], rest, value);
  return copy;
}

// Reads a request as the page does before the service has answered.
function read(request: PlanRequest): void {
  firstPosition(request, arm);
  handledNames(request);
  for (const language of LANGUAGES) codeOf(language, request, 'http://host');
  for (const { objects } of zonesOf(request)) objects?.includes('thing');
  const scene = typeof request.scene === 'object' ? (request.scene as Scene) : null;
  for (const { shape, margin } of placedOf({ ...request, scene }, arm)) grownGeometry(shape, margin, 1)?.dispose();
  request.waypoints.forEach((waypoint, index) => {
    const { motion } = waypoint;
    if (motion?.kind === 'free' && motion.keep)
      disposeOf(keptMarks({ constraints: motion.keep, ends: [{ position: [0, 0, 0] }] }, 1, 'red'));
    toolAt(request, index);
    surroundingsOf(request, scene, index, arm);
    if (waypoint.kind !== 'pose') return;
    const turn = quaternionOf(waypoint.pose.orientation);
    if (turn) rpyOfQuaternion(turn);
    waypoint.pose.position.map((value) => value.toFixed(3));
  });
}

describe('a request from outside', () => {
  test.each(Object.entries(EXAMPLES))('is taken as it is: %s', (_, example) => {
    expect(parseRequest(JSON.stringify(example)).fault).toBeUndefined();
  });

  test('is taken with every field that the page reads', () => {
    expect(parseRequest(JSON.stringify(FULL))).toEqual({ request: FULL });
    read(FULL as never);
  });

  const paths = pathsIn(FULL).filter((path) => path.length > 0);

  test.each(paths.map((path) => [path.join('/'), path] as const))('with a malformed %s is refused, or the page can read it', (_, path) => {
    for (const value of MALFORMED) {
      const { request, fault } = parseRequest(JSON.stringify(replaced(FULL, path, value)));
      if (request) read(request);
      else expect(fault).toMatch(/^\/\S+ must .+; got .+/);
    }
  });

  test('that is no request at all is refused', () => {
    for (const value of MALFORMED) expect(parseRequest(JSON.stringify(value)).fault).toMatch(/ must .+; got .+/);
    expect(parseRequest('{').fault).toContain('JSON');
  });

  test('is refused by the field that is wrong, with its value', () => {
    const { fault } = parseRequest('{"robot": "arm", "waypoints": [null]}');
    expect(fault).toBe('/waypoints/0 must be an object; got null');
  });

  test('that is very long is shortened in what is said', () => {
    expect(parseRequest(JSON.stringify({ robot: 'x '.repeat(1000) })).fault!.length).toBeLessThan(120);
  });
});
