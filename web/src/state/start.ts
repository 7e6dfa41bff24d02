// Loads what the service has, and the request that the address names, else the first example.
import { effect } from '@preact/signals';
import { fromFragment, toFragment } from '../request/address';
import { EXAMPLES, FIRST_EXAMPLE } from '../request/examples';
import { apiKey, client, outcome } from '../service/client';
import { texts } from '../texts';
import { chooseExample, openRequest } from './actions';
import { followConnection } from './connection';
import { playing, time } from './playback';
import { loadRobots } from './robots';
import { backends, banner, problem, request, robots } from './store';
import { followVisuals } from './shapes';
import { followScenes } from './surroundings';
import { followWorkspace } from './workspace';

let written = '';

export async function start(): Promise<void> {
  followScenes();
  followVisuals();
  followWorkspace();
  followConnection(() => void loadLists());
  effect(() => {
    if (apiKey.value !== '' || robots.peek().length === 0) void loadLists();
  });
  // The event has the link; by now the address may be that of an earlier request again, which was still being packed.
  addEventListener('hashchange', ({ newURL }) => {
    const { hash } = new URL(newURL);
    if (hash !== written) void showAddress(hash);
  });
  effect(() => {
    if (request.value && time.value >= 0 && !playing.value) void writeAddressSoon();
  });
  if (!(await showAddress(location.hash))) await chooseExample(EXAMPLES.find(({ name }) => name === FIRST_EXAMPLE)!);
}

async function loadLists(): Promise<void> {
  const [known, kinds] = await Promise.all([loadRobots(), outcome(client.GET('/v1/backends'))]);
  if (known.problem) problem.value = known.problem;
  if (kinds.answer) backends.value = kinds.answer.backends;
}

async function showAddress(hash: string): Promise<boolean> {
  const shown = await fromFragment(hash);
  if (!shown) return false;
  if ('fault' in shown) {
    banner.value = { text: texts.said.wrongLink(shown.fault) };
    return false;
  }
  banner.value = null;
  openRequest(shown.request, '', shown.time);
  return true;
}

const LONGEST_LINK = 1_000_000; // characters: browsers refuse addresses of two million

let timer: ReturnType<typeof setTimeout> | undefined;

// The address of what is shown.
export async function linkToShown(): Promise<string> {
  const shown = request.peek();
  return shown ? new URL(await toFragment({ request: shown, time: time.peek() }), location.href).href : location.href;
}

async function writeAddressSoon(): Promise<void> {
  clearTimeout(timer);
  await new Promise((resolve) => (timer = setTimeout(resolve, 400)));
  if (request.peek() && !playing.peek()) await writeAddress();
}

// From now on the address holds what is shown, unless that is too long.
export async function writeAddress(): Promise<void> {
  const link = await linkToShown();
  if (link.length > LONGEST_LINK) return;
  written = new URL(link).hash;
  globalThis.history.replaceState(null, '', link);
}
