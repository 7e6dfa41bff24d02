// Where a moving object is at a time, as its motion in a request says it.
import { Matrix4, Quaternion, Vector3 } from 'three';
import { quaternionOf } from '../request/rotations';
import type { SceneObject } from '../service/types';

type Motion = NonNullable<SceneObject['motion']>;

const ONE = new Vector3(1, 1, 1);

// The pose in the frame of the object at a time, s; `start` is its pose at time 0.
export function movedPose(motion: Motion, start: Matrix4, time: number): Matrix4 {
  const now = Math.max(time, 0);
  if (motion.kind === 'linear') {
    const moved = new Vector3().fromArray(motion.velocity).multiplyScalar(Math.min(now, motion.end ?? Infinity));
    return new Matrix4().makeTranslation(moved).multiply(start);
  }
  let [from, at, turn] = [0, new Vector3(), new Quaternion()];
  start.decompose(at, turn, new Vector3());
  for (const { time: to, pose } of motion.poses) {
    const there = new Vector3().fromArray(pose.position);
    const xyzw = pose.orientation ? quaternionOf(pose.orientation) : null;
    const turned = xyzw ? new Quaternion(...xyzw).normalize() : turn;
    const share = Math.min((now - from) / (to - from), 1);
    if (share < 1) return new Matrix4().compose(at.lerp(there, share), turn.clone().slerp(turned, share), ONE);
    [from, at, turn] = [to, there, turned];
  }
  return new Matrix4().compose(at, turn, ONE);
}
