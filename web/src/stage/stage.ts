// The three-dimensional view. It draws when something has changed, and only then.
import {
  AmbientLight,
  Box3,
  DirectionalLight,
  GridHelper,
  Group,
  PerspectiveCamera,
  Raycaster,
  Scene,
  Sphere,
  Vector2,
  Vector3,
  WebGLRenderer,
} from 'three';
import type { Object3D, Vector3Tuple } from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import type { ComparedBackend, LinkShape, PlanAnswer, Pose, Problem, Robot } from '../service/types';
import { matrixOf } from '../robot/chain';
import { reach, shapesOf } from '../robot/shapes';
import type { Form, Shape } from '../robot/shapes';
import { styleColour, theme } from '../state/theme';
import { Arm } from './arm';
import { Gizmo } from './gizmo';
import type { GizmoMode } from './gizmo';
import { axes, ball, disposeOf, ghostLine, pathLine, waypointMarks } from './marks';
import { gapMark, obstacles } from './obstacles';
import { pointsOf } from '../scene/pair';
import type { Pair } from '../scene/pair';
import { mountingOf, toolOf } from '../scene/objects';
import type { Placed, Setting } from '../scene/objects';

export type View = 'home' | 'front' | 'side' | 'top';

const DIRECTIONS: Record<View, Vector3Tuple> = { home: [1, -1.05, 0.75], front: [1, 0, 0.02], side: [0, -1, 0.02], top: [0.001, 0, 1] };

type Drawn = 'path' | 'waypoints' | 'ghosts' | 'place' | 'ghost' | 'reach' | 'scene' | 'waiting' | 'gap' | 'pair';

export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(38, 1, 0.01, 100);
  readonly world = new Group(); // in the base frame; the mounting turns it
  readonly controls: OrbitControls;
  readonly gizmo: Gizmo;
  private readonly renderer: WebGLRenderer;
  private arm?: Arm;
  private robot?: Robot;
  private shapes: readonly Shape[] = [];
  private drawn: Partial<Record<Drawn | 'grid', Object3D>> = {};
  private carried: Object3D[] = [];
  private tool?: Object3D;
  private waypoints: readonly number[] = []; // of the request, by the ball
  private waiting = false;
  private extent = 1;
  private isFitted = false; // the view has been fitted to the first path of this robot

  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.camera.up.set(0, 0, 1);
    this.scene.add(this.world, new AmbientLight('#ffffff', 1.4));
    for (const [x, y, z, strength] of [[2, -3, 5, 2.2], [-4, 2, 3, 0.9]] as const) {
      const light = new DirectionalLight('#ffffff', strength);
      light.position.set(x, y, z);
      this.scene.add(light);
    }
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.draw());
    this.gizmo = new Gizmo(this.camera, canvas, this.world, this.scene, 0.7);
    this.gizmo.onChange = () => this.draw();
    this.gizmo.onHold = (isHeld) => (this.controls.enabled = !isHeld);
    canvas.addEventListener('pointerdown', (down) => this.remember(down));
  }

  // Called with the number of a waypoint that is clicked.
  onPick: (waypoint: number) => void = () => undefined;

  private remember(down: PointerEvent): void {
    const up = (event: PointerEvent): void => {
      if (Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) < 4) this.pick(event);
    };
    this.canvas.addEventListener('pointerup', up, { once: true });
  }

  private pick(event: PointerEvent): void {
    const box = this.canvas.getBoundingClientRect();
    const at = new Vector2((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
    const ray = new Raycaster();
    ray.setFromCamera(at, this.camera);
    const hit = ray.intersectObjects(this.drawn.waypoints?.children ?? []).find(({ instanceId }) => instanceId !== undefined);
    if (hit?.instanceId !== undefined) this.onPick(this.waypoints[hit.instanceId]!);
  }

  setRobot(robot: Robot, links: readonly LinkShape[], posture: readonly number[]): void {
    this.arm?.dispose();
    this.robot = robot;
    this.shapes = shapesOf(robot, links);
    this.extent = Math.max(0.3, reach(robot));
    this.arm = new Arm(robot, this.shapes);
    this.world.add(this.arm.object);
    this.arm.pose(posture);
    this.isFitted = false;
    this.setGround();
    this.look('home');
  }

  // Where the base stands in the world, the tool at the tip, and what stands around the robot at all times.
  setSurroundings(setting: Setting, standing: readonly Placed[]): void {
    if (!this.robot) return;
    this.world.matrixAutoUpdate = false;
    this.world.matrix.copy(mountingOf(setting, this.robot));
    this.world.matrixWorldNeedsUpdate = true;
    this.replace('scene', this.things(standing));
    const tip = this.robot.placements.find(({ frame }) => frame === this.robot!.tip_frame);
    disposeOf(this.tool);
    this.tool = axes(this.extent * 0.09);
    if (tip) {
      this.tool.applyMatrix4(matrixOf(tip).multiply(toolOf(setting, this.robot)));
      this.arm?.attach(tip.after, this.tool);
    }
    this.setGround();
  }

  // What the robot carries now, and what it takes later or has put down.
  setMovable(placed: readonly Placed[]): void {
    for (const object of this.carried) disposeOf(object);
    this.carried = placed.filter(({ after }) => after !== null).map((one) => this.carry(one, one.after!));
    this.replace('waiting', this.things(placed.filter(({ after }) => after === null)));
  }

  private carry(one: Placed, after: number): Object3D {
    const object = this.things([one])!;
    this.arm?.attach(after, object);
    return object;
  }

  private things(placed: readonly Placed[]): Object3D | undefined {
    const colours = { thing: styleColour('--thing'), margin: styleColour('--margin') };
    return placed.length > 0 ? obstacles(placed, this.extent, colours) : undefined;
  }

  // Shows where two things are nearest: a line between them, and the shapes of the links that are held against objects.
  setPair(pair: Pair | null, placed: readonly Placed[], links: readonly LinkShape[], isRefused: boolean): void {
    const isOfRobot = pair !== null && pair.position.length === this.robot?.chain.length;
    const colour = styleColour(isRefused ? '--bad' : '--accent');
    const ends = isOfRobot && !isRefused ? pointsOf(pair, this.robot!, links, placed) : null;
    this.replace('gap', ends ? gapMark(ends, this.extent * 0.007, colour) : undefined);
    const shapes = links.filter(({ link }) => pair?.names.includes(link)).map((link): Shape => ({ after: link.after, matrix: matrixOf(link), form: link.shape as Form }));
    this.replace('pair', isOfRobot && shapes.length > 0 ? this.ghost(pair.position, colour, shapes) : undefined);
  }

  setPosture(position: readonly number[]): void {
    this.arm?.pose(position);
    this.draw();
  }

  setPlan(answer: PlanAnswer | null, shares: readonly number[]): void {
    this.replace('path', answer?.samples.tcp_pose ? pathLine(answer, shares, theme.value === 'dark') : undefined);
    if (answer && !this.isFitted) {
      this.isFitted = true;
      this.arm?.pose(answer.samples.position[0]!); // the view is to hold the arm where it begins
      this.look('home');
    }
  }

  setWaypoints(answer: PlanAnswer | null, chosen: number): void {
    this.waypoints = answer?.waypoints.map(({ index }) => index) ?? [];
    const colours = [styleColour('--text-soft'), styleColour('--accent')] as const;
    this.replace('waypoints', answer ? waypointMarks(answer, this.extent * 0.008, chosen, ...colours) : undefined);
  }

  setGhosts(compared: readonly ComparedBackend[] | null, colours: readonly string[]): void {
    const group = new Group();
    compared?.forEach(({ trajectory }, index) => {
      if (trajectory) group.add(ghostLine(trajectory, colours[index % colours.length]!));
    });
    this.replace('ghosts', group);
  }

  // Shows where a refusal is: the posture there as a ghost, and the pose of the tool.
  setProblem(problem: Problem | null): void {
    const [place, nearest] = [problem?.place, problem?.nearest];
    const posture = place?.position ?? nearest?.position ?? problem?.position ?? undefined;
    const colour = styleColour('--bad');
    this.replace('ghost', posture && this.ghost(posture, colour));
    const at = place?.pose.position ?? nearest?.pose.position ?? problem?.point;
    const mark = at ? ball(this.extent * 0.016, colour) : undefined;
    if (at) mark?.position.fromArray(at);
    this.replace('place', mark);
  }

  // Shows where the arm would stand for a pose that is dragged: in red where it does not get there.
  setReach(posture: readonly number[] | null, isReached: boolean): void {
    this.replace('reach', posture ? this.ghost(posture, styleColour(isReached ? '--accent' : '--bad')) : undefined);
  }

  setGizmo(pose: Pose | null, mode: GizmoMode): void {
    this.gizmo.show(pose, mode);
    this.draw();
  }

  private ghost(posture: readonly number[], colour: string, shapes = this.shapes): Object3D | undefined {
    if (posture.length !== this.robot?.chain.length) return undefined;
    const arm = new Arm(this.robot, shapes, { colour, opacity: 0.32 });
    arm.pose(posture);
    return arm.object;
  }

  // The ground under the robot, in the colours of the theme.
  setGround(): void {
    disposeOf(this.drawn.grid);
    const size = Math.ceil(this.extent * 2.4);
    const grid = new GridHelper(size, size * 4, styleColour('--grid-strong'), styleColour('--ground'));
    grid.rotateX(Math.PI / 2);
    grid.position.z = Math.min(0, this.bounds().min.z);
    this.drawn.grid = grid;
    this.scene.add(grid);
    this.draw();
  }

  // The box around the robot, the path of its tool and what stands around it.
  private bounds(): Box3 {
    this.world.updateWorldMatrix(true, true);
    const box = new Box3();
    for (const object of [this.arm?.object, this.drawn.path, ...this.ends()]) if (object) box.expandByObject(object);
    return box.isEmpty() ? new Box3(new Vector3(-1, -1, 0), new Vector3(1, 1, 1)) : box;
  }

  // What of the scene has an end: half spaces are drawn as large as the view.
  private ends(): Object3D[] {
    return [this.drawn.scene, this.drawn.waiting].flatMap((group) => group?.children ?? []).filter((child) => !child.userData.endless);
  }

  look(view: View): void {
    const sphere = this.bounds().getBoundingSphere(new Sphere());
    const half = (this.camera.fov * Math.PI) / 360;
    const narrow = Math.atan(Math.tan(half) * Math.min(1, this.camera.aspect));
    const direction = new Vector3().fromArray(DIRECTIONS[view]).normalize();
    this.controls.target.copy(sphere.center);
    this.camera.position.copy(sphere.center).addScaledVector(direction, (sphere.radius / Math.sin(narrow)) * 0.76);
    this.controls.update();
    this.draw();
  }

  resize(): void {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  picture(): string {
    this.renderer.render(this.scene, this.camera);
    return this.canvas.toDataURL('image/png');
  }

  draw(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.renderer.render(this.scene, this.camera);
    });
  }

  private replace(name: Drawn, object: Object3D | undefined): void {
    disposeOf(this.drawn[name]);
    this.drawn[name] = object;
    if (object) this.world.add(object);
    this.draw();
  }
}
