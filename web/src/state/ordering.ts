// Has the waypoints put in the order of the shortest duration that the service finds.
import { batch, signal } from '@preact/signals';
import { inOrder, orderRequest } from '../request/order';
import { seconds } from '../plan/units';
import { client, outcome } from '../service/client';
import type { PlanRequest, Problem } from '../service/types';
import { texts } from '../texts';
import { show } from './actions';
import { request } from './store';

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
