// The button that puts the waypoints in the best order, and what came of it.
import { runsOf } from '../request/order';
import type { PlanRequest } from '../service/types';
import { ordered, ordering, orderWaypoints } from '../state/ordering';
import { texts } from '../texts';
import { ProblemText } from './Message';

export function Ordering({ request }: { request: PlanRequest }) {
  if (runsOf(request).tasks.length < 2) return null;
  const came = ordered.value?.request === request ? ordered.value.came : texts.waypoints.orderHint;
  return (
    <div class="ordering">
      <button type="button" disabled={ordering.value} onClick={() => void orderWaypoints()}>
        {ordering.value ? texts.waypoints.ordering : texts.waypoints.order}
      </button>
      <div class="hint" role="status">
        {typeof came === 'string' ? came : <ProblemText problem={came} />}
      </div>
    </div>
  );
}
