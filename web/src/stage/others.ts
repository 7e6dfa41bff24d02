// The other robots of a cell: each stands on its base in the world, and carries what it holds.
import { Group } from 'three';
import type { Object3D } from 'three';
import type { Placed } from '../scene/objects';
import type { OtherRobot } from '../state/others';
import { Arm } from './arm';
import { disposeOf } from './marks';

export class OtherArms {
  readonly object = new Group();
  private robots: readonly OtherRobot[] = [];
  private arms: readonly Arm[] = [];
  private carried: Object3D[] = [];

  // True: there are other robots than before, or some stand elsewhere.
  set(robots: readonly OtherRobot[]): boolean {
    const before = this.robots;
    const isSame = (one: OtherRobot | undefined, next: OtherRobot): boolean => one?.robot === next.robot && one.shapes === next.shapes;
    const areSame = robots.length === before.length && robots.every((next, i) => isSame(before[i], next));
    const isMoved = !areSame || robots.some(({ base }, i) => !base.equals(before[i]!.base));
    this.robots = robots;
    if (!areSame) {
      this.arms.forEach((arm) => arm.dispose());
      this.arms = robots.map(({ robot, shapes }) => new Arm(robot, shapes));
      this.arms.forEach(({ object }) => this.object.add(object));
    }
    this.arms.forEach(({ object }, i) => {
      object.matrixAutoUpdate = false;
      object.matrix.copy(robots[i]!.base);
      object.matrixWorldNeedsUpdate = true;
    });
    return isMoved;
  }

  pose(positions: readonly (readonly number[])[]): void {
    this.arms.forEach((arm, i) => positions[i] && arm.pose(positions[i]));
  }

  // What the arm that is shown and the others carry now.
  carry(shown: Arm | undefined, placed: readonly Placed[], drawn: (one: Placed) => Object3D): void {
    this.carried.forEach(disposeOf);
    this.carried = placed.flatMap((one) => {
      const holder = one.after === null ? undefined : [shown, ...this.arms][one.by];
      if (!holder) return [];
      const object = drawn(one);
      holder.attach(one.after!, object);
      return [object];
    });
  }
}
