// The chosen pose as something to drag; while it is dragged, whoever listens hears where it is.
import { Group, Matrix4 } from 'three';
import type { Camera, Object3D } from 'three';
import { TransformControls } from 'three/examples/jsm/controls/TransformControls.js';
import { disposeOf } from './marks';
import type { Pose } from '../service/types';
import { quaternionOf } from '../request/rotations';

export type GizmoMode = 'translate' | 'rotate';

export interface GizmoWays {
  ofTool: boolean; // along the axes of the tool, else those of the world
  snap: readonly [number, number] | null; // steps of a motion, m, and of a turn, rad
}

export class Gizmo {
  private readonly handle = new Group(); // in the base frame
  private readonly controls: TransformControls;
  private begun = new Matrix4();
  private pose: Pose | null = null;
  private tool?: Object3D;

  constructor(camera: Camera, canvas: HTMLCanvasElement, base: Object3D, scene: Object3D, size: number) {
    this.controls = new TransformControls(camera, canvas);
    this.controls.setSize(size);
    base.add(this.handle);
    scene.add(this.controls.getHelper());
    this.controls.addEventListener('change', () => this.onChange());
    this.controls.addEventListener('objectChange', () => this.pose && this.onDrag(this.dragged(this.pose)));
    this.controls.addEventListener('dragging-changed', ({ value }) => this.turn(value as boolean));
  }

  get isHeld(): boolean {
    return this.controls.dragging;
  }

  onChange: () => void = () => undefined;
  onHold: (isHeld: boolean) => void = () => undefined;
  onDrag: (pose: Pose) => void = () => undefined;
  onDrop: (pose: Pose) => void = () => undefined;

  // Shows the handles at a pose, with the tool that is there; null: none.
  show(pose: Pose | null, mode: GizmoMode, { ofTool, snap }: GizmoWays, tool?: Object3D): void {
    this.pose = pose;
    disposeOf(this.tool);
    this.tool = pose?.orientation ? tool : undefined; // with any orientation nobody knows where the tip is
    if (this.tool) this.handle.add(this.tool);
    if (!pose) {
      this.controls.detach();
      return;
    }
    const turn = quaternionOf(pose.orientation);
    this.handle.position.fromArray(pose.position);
    this.handle.quaternion.set(...(turn ?? [0, 0, 0, 1]));
    this.controls.setMode(turn ? mode : 'translate');
    this.controls.setSpace(ofTool ? 'local' : 'world');
    this.controls.setTranslationSnap(snap && snap[0]);
    this.controls.setRotationSnap(snap && snap[1]);
    this.controls.attach(this.handle);
  }

  private turn(isHeld: boolean): void {
    this.onHold(isHeld);
    this.handle.updateMatrix();
    if (isHeld) this.begun = this.handle.matrix.clone();
    else if (this.pose && !this.handle.matrix.equals(this.begun)) this.onDrop(this.dragged(this.pose));
  }

  private dragged(pose: Pose): Pose {
    const { x, y, z, w } = this.handle.quaternion;
    const position = this.handle.position.toArray().map((value) => Number(value.toFixed(6)));
    return { position, orientation: pose.orientation ? { kind: 'quaternion', xyzw: [x, y, z, w] } : null };
  }
}
