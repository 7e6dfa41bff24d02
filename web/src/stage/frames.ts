// The frames in which things are drawn: one that stands still, and the base frame, which a positioner moves in it.
import { Group, type Matrix4 } from 'three';
import { jointMatrices } from '../robot/chain';
import type { Robot } from '../service/types';

const STANDING: readonly string[] = ['ghost', 'reach', 'scene', 'waiting', 'gap', 'pair'];

export class Frames {
  readonly standing = new Group();
  readonly base = new Group();

  constructor() {
    this.standing.add(this.base);
    this.standing.matrixAutoUpdate = this.base.matrixAutoUpdate = false;
  }

  // The frame that stands still in the world.
  mount(matrix: Matrix4): void {
    this.standing.matrix.copy(matrix);
    this.standing.matrixWorldNeedsUpdate = true;
  }

  pose(robot: Robot, position: readonly number[]): void {
    this.base.matrix.copy(jointMatrices(robot, position)[0]!);
    this.base.matrixWorldNeedsUpdate = true;
  }

  // The frame of a drawing.
  of(drawn: string): Group {
    return STANDING.includes(drawn) ? this.standing : this.base;
  }
}
