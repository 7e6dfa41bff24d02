// Calls of the service, typed by its own OpenAPI document.
import createClient from 'openapi-fetch';
import { signal } from '@preact/signals';
import type { paths } from './openapi';
import type { Problem } from './types';

const KEY_NAME = 'planner key';

// The page may stand under any prefix: addresses are relative to it.
export const base = new URL('.', document.baseURI).href.replace(/\/$/, '');

// Whether the service was out of reach when it was last called.
export const isAway = signal(false);

export const apiKey = signal(sessionStorage.getItem(KEY_NAME) ?? '');

export const client = createClient<paths>({ baseUrl: base });

client.use({
  onRequest({ request }) {
    if (apiKey.value !== '') request.headers.set('Authorization', `Bearer ${apiKey.value}`);
    return request;
  },
});

export function useKey(key: string): void {
  apiKey.value = key;
  sessionStorage.setItem(KEY_NAME, key);
}

// What a call came to: an answer, or the problem that the service tells of; and the state that it names (`ETag`).
export type Outcome<T> = ({ answer: T; problem?: undefined } | { answer?: undefined; problem: Problem }) & { tag?: string };

interface Result<T> {
  data?: T;
  error?: unknown;
  response?: Response;
}

const NO_CONTENT = 204;
const GATEWAY: readonly number[] = [502, 503, 504]; // what a proxy answers for a service that is away

// Turns the result of a call into an outcome; a service that cannot be reached is a problem, too.
export async function outcome<T>(call: Promise<Result<T>>): Promise<Outcome<T>> {
  try {
    const { data, error, response } = await call;
    isAway.value = !isProblem(error) && GATEWAY.includes(response?.status ?? 0);
    const tag = response?.headers.get('ETag') ?? undefined;
    if (data !== undefined || response?.status === NO_CONTENT) return { answer: data as T, tag };
    return { problem: isProblem(error) ? error : unreachable('the answer cannot be read'), tag };
  } catch (error) {
    if (error instanceof DOMException && error.name === 'AbortError') throw error;
    isAway.value = true;
    return { problem: unreachable(error instanceof Error ? error.message : String(error)) };
  }
}

function isProblem(error: unknown): error is Problem {
  return typeof error === 'object' && error !== null && 'code' in error && 'detail' in error;
}

function unreachable(detail: string): Problem {
  return {
    type: 'about:blank',
    title: 'The service does not answer',
    status: 0,
    detail,
    instance: '',
    code: 'internal_error',
  };
}
