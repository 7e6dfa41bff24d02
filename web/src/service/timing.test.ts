import { expect, test } from 'vitest';
import { timings } from './timing';

test('the stages of an answer are named with their durations', () => {
  expect([...timings('backend_0;dur=519.5, backend_1;desc="second";dur=2, total;dur=521.412')]).toEqual([
    ['backend_0', 0.5195],
    ['backend_1', 0.002],
    ['total', 0.521412],
  ]);
});

test.each([[null], [''], ['missed'], ['cache;desc="hit"']])('where nothing is timed, nothing is said: %s', (header) => {
  expect(timings(header).size).toBe(0);
});
