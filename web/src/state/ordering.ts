// Has the waypoints put in the order of the shortest duration that the service finds.
import { batch, signal } from '@preact/signals';
import { inOrder, orderRequest } from '../request/order';
import { seconds } from '../plan/units';
import { client, isAway, outcome } from '../service/client';
import type { OrderRequest, PlanRequest, Problem } from '../service/types';
import { texts } from '../texts';
import { openRequest, show } from './actions';
import { stopPlanning } from './planning';
import { planning, problem, request } from './store';

export const ordering = signal(false);

// What came of it, beside the request that it is about.
export const ordered = signal<{ request: PlanRequest; came: string | Problem } | null>(null);

export async function orderWaypoints(): Promise<void> {
  const asked = request.value;
  if (!asked || ordering.value) return;
  batch(() => {
    ordering.value = true;
    ordered.value = null;
  });
  const found = await outcome(client.POST('/v1/tasks/order', { body: orderRequest(asked) }));
  ordering.value = false;
  if (request.value !== asked) return;
  if (found.problem) {
    ordered.value = { request: asked, came: found.problem };
    return;
  }
  const { order, plan, bound } = found.answer;
  const next = inOrder(
    asked,
    order.map(({ task }) => task),
  );
  const came = texts.waypoints.ordered(seconds(plan.duration), seconds(bound));
  show(next, came);
  ordered.value = { request: next, came };
}

// Shows an example of tasks.
export async function openTaskExample(load: () => Promise<OrderRequest>): Promise<void> {
  const tasks = await load().catch(() => null);
  if (tasks) await openTasks(tasks);
  else isAway.value = true; // examples are files of the service
}

// Has tasks put in order, and shows them in that order as a request.
export async function openTasks(tasks: OrderRequest): Promise<void> {
  const before = request.value;
  stopPlanning();
  planning.value = true;
  const found = await outcome(client.POST('/v1/tasks/order', { body: tasks }));
  if (request.value !== before || !planning.peek()) return; // cancelled, or something else is shown by now
  planning.value = false;
  if (found.problem) {
    problem.value = found.problem;
    return;
  }
  const { request: next, plan, bound } = found.answer;
  const came = texts.waypoints.ordered(seconds(plan.duration), seconds(bound));
  openRequest(next as unknown as PlanRequest, came);
  ordered.value = { request: next as unknown as PlanRequest, came };
}
