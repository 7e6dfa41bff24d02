// The chosen pose, or the chosen object of the scene, may be dragged. A pose it is asked about on the way, and put into the request where it is let go.
import { toolAt } from '../plan/tools';
import { poseAsGiven, poseInBase } from '../request/places';
import type { Pose } from '../service/types';
import { edit, sketch } from './draft';
import { metAt } from './meeting';
import { reach } from './reaching';
import type { Reach } from './reaching';
import { objectPose, placeObject, shownThing, sketchObject } from './scene_editing';
import { draft, request, robot, selected } from './store';

export interface Dragging {
  pose: () => Pose | null; // reads signals
  tool: () => Pose | null | undefined; // that is to get there: null is the robot's own, undefined none; reads signals
  reach: () => Reach | null; // reads signals
  onDrag: (pose: Pose) => void;
  onDrop: (pose: Pose) => void;
}

export const dragging: Dragging = {
  pose: () => {
    if (shownThing.value) return objectPose.value;
    const [shown, arm] = [request.value, robot.value];
    const waypoint = draft.value ?? shown?.waypoints[selected.value];
    return shown && arm && waypoint?.kind === 'pose' ? poseInBase(waypoint, shown, arm, metAt(selected.value)) : null;
  },
  tool: () => (shownThing.value ? undefined : request.value && toolAt(request.value, selected.value)),
  reach: () => reach.value,
  onDrag: (pose) => (shownThing.value ? sketchObject(pose) : sketch({ pose: inItsFrame(pose) })),
  onDrop: (pose) => (shownThing.value ? placeObject(pose) : edit({ pose: inItsFrame(pose) })),
};

function inItsFrame(pose: Pose): Pose {
  const [shown, arm] = [request.value, robot.value];
  const waypoint = shown?.waypoints[selected.value];
  return shown && arm && waypoint?.kind === 'pose' ? poseAsGiven(pose, waypoint, shown, arm, metAt(selected.value)) : pose;
}
