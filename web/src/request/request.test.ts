import ts from 'typescript';
import { describe, expect, test } from 'vitest';
import type { PlanRequest } from '../service/types';
import { fromFragment, toFragment } from './address';
import { codeOf, json } from './code';
import { edited, NO_HISTORY, redone, undone } from './history';
import type { History } from './history';
import { quaternionOf, quaternionOfRpy, rpyOfQuaternion } from './rotations';
import type { Quaternion, Vector } from './rotations';

const request: PlanRequest = {
  robot: 'arm',
  waypoints: [{ kind: 'joint', position: [0.1, -2e-7], name: "it's “true” \\ null" }],
  limits: { velocity: null as never },
};

describe('the address', () => {
  test('brings back what it was made from', async () => {
    expect(await fromFragment(await toFragment({ request, time: 1.25 }))).toEqual({ request, time: 1.25 });
  });

  test('is short: 300 waypoints fit', async () => {
    const long = { ...request, waypoints: Array.from({ length: 300 }, (_, i) => ({ kind: 'joint' as const, position: [i / 7] })) };
    expect((await toFragment({ request: long, time: 0 })).length).toBeLessThan(8000);
  });

  test.each(['', '#', '#other=1'])('that names no request is none: %s', async (fragment) => {
    expect(await fromFragment(fragment)).toBeNull();
  });

  test.each(['#r=', '#r=%%', '#r=AAAA'])('that is cut off says so: %s', async (fragment) => {
    expect(await fromFragment(fragment)).toEqual({ fault: 'it is cut off or changed' });
  });

  test('that holds a malformed request names the field', async () => {
    const malformed = await toFragment({ request: { ...request, waypoints: [null as never] }, time: 0 });
    expect(await fromFragment(malformed)).toEqual({ fault: '/waypoints/0 must be an object; got null' });
  });

  test.each(['-3', 'x', 'Infinity', ''])('with a malformed time begins at 0: %s', async (time) => {
    const fragment = `${await toFragment({ request, time: 0 })}&t=${time}`;
    expect(await fromFragment(fragment)).toEqual({ request, time: 0 });
  });
});

describe('the history', () => {
  test('goes back and forth, and an edit ends what was undone', () => {
    let [history, shown]: [History<number>, number] = [edited(edited(NO_HISTORY, 1), 2), 3];
    [history, shown] = undone(history, shown);
    expect(shown).toBe(2);
    [history, shown] = undone(history, shown);
    [history, shown] = undone(history, shown);
    expect(shown).toBe(1);
    [history, shown] = redone(history, shown);
    expect(shown).toBe(2);
    expect(redone(edited(history, shown), 9)[1]).toBe(9);
  });
});

describe('the code', () => {
  test('is JSON with rows of numbers on one line', () => {
    expect(json({ a: [1, -2.5, 3e-7] })).toBe('{\n  "a": [1, -2.5, 3e-7]\n}');
    expect(JSON.parse(json(request))).toEqual(request);
  });

  test('for a shell holds the request between single quotes', () => {
    const quoted = /--json '(.*)'$/s.exec(codeOf('curl', request, 'http://host'))![1]!;
    expect(JSON.parse(quoted.replaceAll("'\\''", "'"))).toEqual(request);
  });

  test('for Python has its names, but not within strings', () => {
    const code = codeOf('python', { ...request, frames: {} }, 'http://host');
    expect(code).toContain('"velocity": None');
    expect(code).toContain('“true”');
    expect(code).toContain('null"');
  });

  test('for TypeScript compiles, posts the request and reads the answer', async () => {
    const code = codeOf('typescript', request, 'http://host');
    const asked: [string, RequestInit][] = [];
    const said: unknown[][] = [];
    const post = (url: string, init: RequestInit): Promise<Response> => {
      asked.push([url, init]);
      return Promise.resolve(Response.json({ duration: 2.5, certificate: { satisfied: true } }));
    };
    await run(code, post, { log: (...values) => said.push(values) });
    expect(asked).toHaveLength(1);
    const [url, { method, headers, body }] = asked[0]!;
    expect([url, method, headers]).toEqual(['http://host/v1/trajectories', 'POST', { 'Content-Type': 'application/json' }]);
    expect(JSON.parse(body as string)).toEqual(request);
    expect(said).toEqual([[2.5, true]]);
  });

  test('for TypeScript throws what the service says of a request that it refuses', async () => {
    const refuse = (): Promise<Response> => Promise.resolve(Response.json({ detail: 'too fast' }, { status: 422 }));
    await expect(run(codeOf('typescript', request, 'http://host'), refuse, console)).rejects.toThrow('too fast');
  });
});

// Runs the code as a browser would, but for its calls and what it prints.
async function run(
  code: string,
  fetch: (url: string, init: RequestInit) => Promise<Response>,
  console: { log: (...values: unknown[]) => void },
): Promise<void> {
  const faults: ts.Diagnostic[] = [];
  const script = ts.transpile(code, { target: ts.ScriptTarget.ES2022, module: ts.ModuleKind.ES2022 }, 'code.ts', faults);
  expect(faults).toEqual([]);
  // eslint-disable-next-line @typescript-eslint/no-implied-eval -- it is the code that is tested
  await (new Function('fetch', 'console', `return (async () => { ${script} })();`) as (...given: unknown[]) => Promise<void>)(
    fetch,
    console,
  );
}

describe('rotations', () => {
  // R = Rz(yaw) Ry(pitch) Rx(roll) turns x into its first column.
  const turned = ([x, y, z, w]: Quaternion): number[] => [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)];

  test.each<Vector>([
    [0.3, -0.4, 2.0],
    [3.0, 1.2, -2.9],
    [0, Math.PI / 2, 0.7],
    [0, -Math.PI / 2, 0.7],
  ])('from and to roll, pitch and yaw %#', (...rpy) => {
    const [, pitch, yaw] = rpy;
    const quaternion = quaternionOfRpy(rpy);
    const column = [Math.cos(yaw) * Math.cos(pitch), Math.sin(yaw) * Math.cos(pitch), -Math.sin(pitch)];
    turned(quaternion).forEach((value, i) => expect(value).toBeCloseTo(column[i]!, 12));
    const back = quaternionOfRpy(rpyOfQuaternion(quaternion));
    expect(Math.abs(back.reduce((sum, value, i) => sum + value * quaternion[i]!, 0))).toBeCloseTo(1, 12);
  });

  test.each([
    [
      [1, 0, 0],
      [0, 0, -1],
      [0, 1, 0],
    ],
    [
      [-1, 0, 0],
      [0, -1, 0],
      [0, 0, 1],
    ],
    [
      [0, 0, 1],
      [1, 0, 0],
      [0, 1, 0],
    ],
  ])('from a matrix %#', (...matrix) => {
    const column = turned(quaternionOf({ kind: 'matrix', matrix })!);
    column.forEach((value, i) => expect(value).toBeCloseTo(matrix[i]![0]!, 12));
  });
});
