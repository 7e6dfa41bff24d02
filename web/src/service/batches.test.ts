import { describe, expect, test, vi } from 'vitest';
import { gridOf, sizeOf, valuesOf } from '../request/grid';

vi.mock('./client', () => ({ base: 'http://host', apiKey: { value: 'secret' } }));
const { listen, parsed } = await import('./events');

describe('server-sent events', () => {
  test('are read as they come, comments left out', () => {
    const [events, rest] = parsed('id: 3\nevent: progress\ndata: {"a":1}\n\n: nothing new\n\nid: 4\nevent: end\ndata: {}\n\nid: 5\nda');
    expect(events).toEqual([
      { id: '3', name: 'progress', data: '{"a":1}' },
      { id: '4', name: 'end', data: '{}' },
    ]);
    expect(rest).toBe('id: 5\nda');
  });

  test('go on after a break where they were, with the key', async () => {
    const asked: Record<string, string>[] = [];
    const answers = ['id: 1\nevent: progress\ndata: a\n\nid: 2\nev', 'id: 2\nevent: end\ndata: b\n\n'];
    vi.stubGlobal('fetch', (_: string, { headers }: { headers: Record<string, string> }) => {
      asked.push(headers);
      return Promise.resolve(new Response(answers[asked.length - 1]));
    });
    vi.useFakeTimers({ toFake: ['setTimeout'] });
    const heard: string[] = [];
    const over = vi.fn();
    const done = listen('/events', new AbortController().signal, ({ name, data }) => {
      heard.push(data);
      return name !== 'end';
    }).finally(over);
    // Streams are read in real time, so that nobody knows when the break that is slept over begins.
    while (over.mock.calls.length === 0) await vi.advanceTimersByTimeAsync(1000);
    await done;
    vi.useRealTimers();
    expect(heard).toEqual(['a', 'b']);
    expect(asked.map((headers) => headers['Last-Event-ID'])).toEqual([undefined, '1']);
    expect(asked[0]!.Authorization).toBe('Bearer secret');
  });

  test.each([429, 503])('go on after an answer that says to come later: %i', async (status) => {
    const answers = [new Response('{}', { status, headers: { 'Retry-After': '5' } }), new Response('id: 1\nevent: end\ndata: a\n\n')];
    const asked = vi.fn(() => Promise.resolve(answers[asked.mock.calls.length - 1]!));
    vi.stubGlobal('fetch', asked);
    vi.useFakeTimers({ toFake: ['setTimeout'] });
    const heard: string[] = [];
    const done = listen('/events', new AbortController().signal, ({ data }) => {
      heard.push(data);
      return false;
    });
    await vi.advanceTimersByTimeAsync(4900);
    expect(asked).toHaveBeenCalledTimes(1);
    await vi.advanceTimersByTimeAsync(200);
    await done;
    vi.useRealTimers();
    expect(heard).toEqual(['a']);
    expect(asked).toHaveBeenCalledTimes(2);
  });

  test('that are refused end it', async () => {
    const refused = new Response('{}', { status: 404 });
    vi.stubGlobal('fetch', () => Promise.resolve(refused));
    expect(await listen('/events', new AbortController().signal, () => true)).toBe(refused);
  });
});

describe('a grid', () => {
  test.each<[string, unknown[] | null]>([
    ['1, 2.5', [1, 2.5]],
    ['["cubic", null]', ['cubic', null]],
    ['cubic, ruckig', ['cubic', 'ruckig']],
    ['{"kind": "cubic"}', [{ kind: 'cubic' }]],
    ['', null],
    ['1, ', null],
    ['[]', null],
  ])('reads values: %s', (text, values) => expect(valuesOf(text)).toEqual(values));

  test('has all combinations', () => {
    expect(
      sizeOf([
        { pointer: '/a', values: '1, 2, 3' },
        { pointer: '/b/0', values: 'x, y' },
      ]),
    ).toBe(6);
    expect(sizeOf([{ pointer: 'a', values: '1' }])).toBeNull();
  });

  test('has a template in which its fields are there', () => {
    const { template, vary } = gridOf({ robot: 'arm', waypoints: [] }, [{ pointer: '/limits/velocity_scale', values: '0.5, 1' }]).grid!;
    expect(template).toEqual({ robot: 'arm', waypoints: [], limits: { velocity_scale: 0.5 } });
    expect(vary[0]!.values).toEqual([0.5, 1]);
  });

  test('names the field that its request has no place for', () => {
    expect(gridOf({ robot: 'arm', waypoints: [] }, [{ pointer: '/robot/x', values: '1' }])).toEqual({ wrong: '/robot/x' });
  });
});
