// The chosen waypoint while a slider, a field or the handles move it: the arm and the numbers show it. Letting go edits the
// request.
import { effect } from '@preact/signals';
import { withoutEmpty, withWaypoint } from '../request/edits';
import { poseInBase } from '../request/places';
import { show } from './actions';
import { pose, jointPosition } from './jointPosition';
import { metAt } from './meeting';
import { askReach, endReach } from './reaching';
import { select } from './selection';
import { draft, request, robot, selected } from './store';

effect(() => {
  request.value;
  selected.value;
  draft.value = null;
});

// Shows the chosen waypoint with changes that the request does not have yet.
export function sketch(changes: object): void {
  const [shown, arm] = [request.value, robot.value];
  const waypoint = shown?.waypoints[selected.value];
  if (!waypoint || !arm) return;
  if (!draft.value) select(selected.value);
  const next = withoutEmpty({ ...waypoint, ...changes });
  draft.value = next;
  if (next.kind === 'joint') pose(next.position);
  const wanted = next.kind === 'pose' ? poseInBase(next, shown, arm, metAt(selected.value)) : null;
  if (wanted) askReach(wanted, jointPosition.value, pose);
}

// Puts changes of the chosen waypoint into the request.
export function edit(changes: object): void {
  endReach();
  if (!request.value) return;
  select(selected.value);
  show(withWaypoint(request.value, selected.value, changes));
}

// Forgets changes that were sketched and taken back.
export function endSketch(): void {
  if (draft.value) endReach();
  draft.value = null;
}
