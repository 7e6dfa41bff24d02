// The chosen pose may be dragged: it is asked about on the way, and put into the request where it is let go.
import { toolAt } from '../plan/tools';
import type { Pose } from '../service/types';
import { withWaypoint } from '../request/edits';
import { show } from './actions';
import { askReach, endReach, reach } from './reaching';
import type { Reach } from './reaching';
import { request, robot, selected } from './store';

export interface Dragging {
  pose: () => Pose | null; // reads signals
  tool: () => Pose | null; // that is to get there; reads signals
  reach: () => Reach | null; // reads signals
  onDrag: (pose: Pose) => void;
  onDrop: (pose: Pose) => void;
}

export const dragging: Dragging = {
  // Only poses in the base frame have handles.
  pose: () => {
    const waypoint = robot.value ? request.value?.waypoints[selected.value] : undefined;
    return waypoint?.kind === 'pose' && !waypoint.frame ? waypoint.pose : null;
  },
  tool: () => request.value && toolAt(request.value, selected.value),
  reach: () => reach.value,
  onDrag: askReach,
  onDrop: (pose) => {
    endReach();
    if (request.value) show(withWaypoint(request.value, selected.value, { pose }));
  },
};
