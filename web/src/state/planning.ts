// Has the request planned, a moment after its last change; an answer to an older request is dropped.
import { batch, effect } from '@preact/signals';
import { alone, cellOf, robotsOf } from '../request/cells';
import { messageOf } from '../request/messages';
import { client, outcome } from '../service/client';
import type { Outcome } from '../service/client';
import { timings } from '../service/timing';
import type { Include, PlanAnswer, PlanRequest, Robot } from '../service/types';
import { backendOf } from './options';
import { backends, compared, comparing, notice, plan, planning, problem, request, robot, waited } from './store';
import type { Planned } from './store';
import { describedRobot } from './described';
import { durationOf, settleTime } from './playback';
import { texts } from '../texts';

const DELAY = 250; // ms after the last change
const SHOWN: readonly Include[] = ['jerk', 'tcp_pose', 'tcp_velocity', 'limits'];
const MOST_SAMPLES = 20_000; // longer motions are sampled more coarsely, so that plots stay fluid

// The answer of a call that asks for JSON, of all the forms that the document lists.
type AsJson<T> = T extends Promise<infer R> ? Promise<Omit<R, 'data'> & { data?: PlanAnswer }> : never;

let timer: ReturnType<typeof setTimeout> | undefined;
let running = new AbortController();

export function planSoon(): void {
  clearTimeout(timer);
  timer = setTimeout(() => void planNow(), DELAY);
}

export function stopPlanning(): void {
  clearTimeout(timer);
  running.abort();
  planning.value = false;
}

// Ends the planning because a person does not want to wait: the service stops its work when the connection closes.
export function cancelPlanning(): void {
  stopPlanning();
  notice.value = texts.said.cancelled;
}

// Counts the seconds, so that a long wait is seen.
effect(() => {
  waited.value = 0;
  if (!planning.value) return;
  const counting = setInterval(() => (waited.value += 1), 1000);
  return () => clearInterval(counting);
});

export async function planNow(): Promise<void> {
  const [asked, arm] = [request.value, robot.value];
  if (!asked || arm?.id !== asked.robot) return;
  stopPlanning();
  running = new AbortController();
  const { signal } = running;
  planning.value = true;
  const begun = performance.now();
  try {
    const found = await (asked.cell ? planCell(asked, signal) : planRequest(asked, arm, signal));
    if (signal.aborted) return;
    batch(() => {
      planning.value = false;
      problem.value = found.problem ?? null;
      if (found.problem) {
        notice.value = messageOf(found.problem, arm.joints).sentences[0]!;
        return;
      }
      plan.value = { request: asked, ...found.answer, took: (performance.now() - begun) / 1000 };
      settleTime();
      notice.value = texts.said.planned(durationOf(plan.value));
    });
  } catch {
    // A newer request has taken its place, or a person has cancelled it.
  }
}

type Found = Outcome<Pick<Planned, 'answer' | 'cell'>>;

async function planRequest(asked: PlanRequest, arm: Robot, signal: AbortSignal): Promise<Found> {
  const call = client.POST('/v1/trajectories', { body: withShown(asked, arm), signal });
  const found = await outcome(call as AsJson<typeof call>);
  return found.problem ? found : { answer: { answer: found.answer } };
}

async function planCell(asked: PlanRequest, signal: AbortSignal): Promise<Found> {
  const cell = cellOf(asked)!;
  const robots = robotsOf(asked).map((own, index) => {
    const { include, sample_period } = withShown(own, describedRobot(own.robot));
    return { ...cell.robots[index]!, include, sample_period };
  });
  const found = await outcome(client.POST('/v1/cells/plan', { body: { ...cell, robots }, signal }));
  return found.problem ? found : { answer: { answer: found.answer.robots[asked.cell!.index]!.plan, cell: found.answer } };
}

// The request with what the page draws besides; torques only of a robot whose masses are known.
export function withShown(asked: PlanRequest, arm: Robot | null): PlanRequest {
  const torque: Include[] = (arm?.mass ?? 0) > 0 ? ['torque'] : [];
  const include = [...new Set([...(asked.include ?? []), ...SHOWN, ...torque])];
  const longest = asked.duration ?? 0;
  const period = Math.max(asked.sample_period ?? 0.01, longest / MOST_SAMPLES);
  return { ...asked, include, sample_period: period };
}

// Plans with all back ends that the service has.
export async function compare(): Promise<void> {
  const [asked, arm] = [request.value, robot.value];
  if (!asked || !arm || comparing.value) return;
  comparing.value = true;
  const rest = { ...alone(asked), backend: undefined };
  const kinds = backends.value.map(({ kind }) => backendOf(kind));
  const body = { ...rest, include: ['tcp_pose'] as Include[], backends: kinds };
  const call = client.POST('/v1/trajectories/compare', { body });
  const found = await outcome(call);
  const took = timings(found.answer ? (await call).response.headers.get('Server-Timing') : null);
  batch(() => {
    comparing.value = false;
    if (request.value !== asked) return;
    if (found.answer)
      compared.value = found.answer.results.map((entry, index) => ({ ...entry, took: took.get(`backend_${index}`) ?? null }));
    else problem.value = found.problem;
  });
}
