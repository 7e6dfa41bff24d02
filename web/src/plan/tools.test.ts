import { describe, expect, test } from 'vitest';
import type { PlanAnswer, PlanRequest, Pose } from '../service/types';
import { stretchesOfTools, toolAt, toolAtTime } from './tools';

const tool = (z: number): Pose => ({ position: [0, 0, z], orientation: null });
const [first, camera, gripper] = [tool(0.1), tool(0.2), tool(0.3)];

// The camera is taken for the way to the third waypoint, where a way around has two corners; the gripper for the last.
const request = {
  robot: 'arm',
  tool: first,
  waypoints: [{}, {}, { tool: camera }, {}, { tool: gripper }],
} as unknown as PlanRequest;
const answer = {
  waypoints: [0, 1, 2, 2, 2, 3, 4].map((index) => ({ index })),
  samples: { time: [0, 1, 2, 3, 4, 5, 6, 7], segment: [0, 0, 1, 2, 3, 4, 5, 5] },
} as unknown as PlanAnswer;

describe('the tool in force', () => {
  test("at a waypoint is the last that was brought, else that of the request, else the robot's own", () => {
    expect([0, 1, 2, 3, 4].map((index) => toolAt(request, index))).toEqual([first, first, camera, camera, gripper]);
    expect(toolAt({ ...request, tool: undefined }, 1)).toBeNull();
    expect(toolAt({ ...request, tool: undefined }, 3)).toBe(camera);
  });

  test('at a time is that of the motion then, which is that of the waypoint it leads to', () => {
    expect([-1, 0, 1.9, 2, 4.5, 5.9, 6, 7, 99].map((time) => toolAtTime(request, answer, time))).toEqual([
      first,
      first,
      first,
      camera,
      camera,
      camera,
      gripper,
      gripper,
      gripper,
    ]);
  });
});

describe('the path of the tool', () => {
  test('ends where the tool changes, and begins anew', () => {
    expect(stretchesOfTools(request, answer)).toEqual([
      [0, 2],
      [2, 6],
      [6, 8],
    ]);
  });

  test('is one line where no waypoint brings a tool, or all bring the same', () => {
    const plain = { ...request, waypoints: request.waypoints.map(() => ({})) } as unknown as PlanRequest;
    expect(stretchesOfTools(plain, answer)).toEqual([[0, 8]]);
    const same = { ...request, waypoints: request.waypoints.map(() => ({ tool: structuredClone(first) })) } as unknown as PlanRequest;
    expect(stretchesOfTools(same, answer)).toEqual([[0, 8]]);
  });

  test('leaves out what is one sample', () => {
    const alone = { ...answer, samples: { ...answer.samples, segment: [0, 0, 1, 4, 5, 5, 5, 5] } };
    const brief = { ...request, waypoints: [{}, {}, { tool: camera }, { tool: first }, { tool: gripper }] } as unknown as PlanRequest;
    expect(stretchesOfTools(brief, alone)).toEqual([
      [0, 2],
      [4, 8],
    ]);
  });
});
