// The three-dimensional view. It draws when something has changed, and only then.
import { Box3, Group, PerspectiveCamera, Scene, Sphere, Vector3, WebGLRenderer, type Object3D } from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { stretchesOfTools } from '../plan/tools';
import type { ComparedBackend, LinkShape, PlanRequest, Pose, Problem, Robot, WorkspaceAnswer } from '../service/types';
import type { Kept } from '../state/ends';
import type { OtherRobot } from '../state/others';
import type { Planned } from '../state/store';
import { matrixOf } from '../robot/chain';
import { linkShapes, reach, type Shape } from '../robot/shapes';
import { styleColour, theme } from '../state/theme';
import { Arm } from './arm';
import { Cloud } from './cloud';
import { Frames } from './frames';
import { Gizmo, type GizmoMode, type GizmoWays } from './gizmo';
import { lights } from './lights';
import { areSeen, DIRECTIONS, fillCanvas, isSeen, NEAR, SHARES, standBack, type View } from './views';
import { axes, ball, disposeOf, ghostLine, ground, pathLine, toolFrame, waypointMarks } from './marks';
import { instanceAt, listenToClicks } from './picking';
import { previewMarks, type PreviewedPath } from './guides';
import { keptMarks } from './kept';
import { OtherArms } from './others';
import { gapMark, obstacles } from './obstacles';
import { pointsOf, type Pair } from '../scene/pair';
import { drawnTool, mountingOf, toolOf, type Placed, type Setting } from '../scene/objects';

type Drawn =
  'path' | 'waypoints' | 'ghosts' | 'place' | 'ghost' | 'reach' | 'scene' | 'waiting' | 'gap' | 'pair' | 'cloud' | 'kept' | 'preview';

export class Stage {
  readonly scene = new Scene();
  readonly camera = new PerspectiveCamera(38, 1, 0.01, 100);
  private readonly frames = new Frames();
  readonly others = new OtherArms();
  readonly controls: OrbitControls;
  readonly gizmo: Gizmo;
  private readonly renderer: WebGLRenderer;
  private arm?: Arm;
  private robot?: Robot;
  private shapes: readonly Shape[] = [];
  private drawn: Partial<Record<Drawn | 'grid', Object3D>> = {};
  private tool?: Object3D;
  private cloud?: Cloud;
  private waypoints: readonly number[] = []; // of the request, by the ball
  private waiting = false;
  private standing = 0; // things around the robot
  private extent = 1;
  private swept: readonly Vector3[] = []; // points around the arm on its path
  private isFitted = false; // to the first path of this robot

  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.localClippingEnabled = true;
    this.camera.up.set(0, 0, 1);
    this.scene.add(this.frames.standing, this.others.object, ...lights());
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.draw());
    this.gizmo = new Gizmo(this.camera, canvas, this.frames.base, this.scene, 0.7);
    this.gizmo.onChange = () => this.draw();
    this.gizmo.onHold = (isHeld) => (this.controls.enabled = !isHeld);
    listenToClicks(canvas, (event) => this.pick(event));
  }

  // Called with the number of a waypoint that is clicked.
  onPick: (waypoint: number) => void = () => undefined;

  private pick(event: PointerEvent): void {
    const hit = instanceAt(event, this.canvas, this.camera, this.drawn.waypoints?.children ?? []);
    if (hit !== undefined) this.onPick(this.waypoints[hit]!);
  }

  removeRobot(): void {
    this.arm?.dispose();
    [this.arm, this.robot, this.swept, this.standing] = [undefined, undefined, [], 0];
    this.replace('scene', undefined);
  }

  setRobot(robot: Robot, shapes: readonly Shape[], jointPosition: readonly number[]): void {
    this.removeRobot();
    this.robot = robot;
    this.shapes = shapes;
    this.extent = Math.max(0.3, reach(robot));
    this.arm = new Arm(robot, this.shapes);
    this.frames.standing.add(this.arm.object);
    this.setJointPosition(jointPosition);
    this.isFitted = false;
    this.setGround();
    this.look('home');
  }

  // Draws the robot by other shapes.
  setShapes(shapes: readonly Shape[]): void {
    this.arm?.dress((this.shapes = shapes));
    this.draw();
  }

  // The base in the world, and what stands around the robot at all times.
  setSurroundings(setting: Setting, standing: readonly Placed[]): void {
    if (!this.robot) return;
    this.frames.mount(mountingOf(setting, this.robot));
    const isNew = this.isFitted && standing.length > this.standing;
    this.standing = standing.length;
    this.replace('scene', this.things(standing));
    this.setGround();
    if (isNew && this.ends().some((end) => !isSeen(end, this.camera))) this.refit();
  }

  // The tool at the tip; null: the robot's own.
  setTool(asked: Pose | null): void {
    const tip = this.robot?.placements.find(({ frame }) => frame === this.robot!.tip_frame);
    disposeOf(this.tool);
    if (!this.robot || !tip) return;
    this.tool = toolFrame(drawnTool(asked, this.robot), this.extent, styleColour('--text-soft')).add(axes(this.extent * 0.09));
    this.tool.applyMatrix4(matrixOf(tip).multiply(toolOf(asked, this.robot)));
    this.arm?.attach(tip.after, this.tool);
    this.draw();
  }

  // Where the tool can be, cut open towards the viewer or whole; a cloud that was not there before is brought into view.
  setCloud(found: WorkspaceAnswer | null, isCut: boolean): void {
    const isNew = !this.cloud && found !== null;
    this.cloud = found ? new Cloud(found, isCut, theme.value === 'dark') : undefined;
    this.replace('cloud', this.cloud?.object);
    if (isNew) this.refit();
  }

  // What robots carry now, and what they take later or have put down.
  setMovable(placed: readonly Placed[]): void {
    this.others.carry(this.arm, placed, (one) => this.things([one])!);
    this.replace('waiting', this.things(placed.filter(({ after }) => after === null)));
  }

  private things(placed: readonly Placed[]): Object3D | undefined {
    const [thing, margin] = [styleColour('--thing'), styleColour('--margin')];
    return placed.length > 0 ? obstacles(placed, this.extent, { thing, margin }) : undefined;
  }

  // Shows where two things are nearest: a line between them, and the shapes of the links that are held against objects.
  setPair(pair: Pair | null, placed: readonly Placed[], links: readonly LinkShape[], isRefused: boolean): void {
    const isOfRobot = pair !== null && pair.position.length === this.robot?.chain.length;
    const colour = styleColour(isRefused ? '--bad' : '--accent');
    const ends = isOfRobot && !isRefused ? pointsOf(pair, this.robot!, links, placed) : null;
    this.replace('gap', ends ? gapMark(ends, this.extent * 0.007, colour) : undefined);
    const shapes = linkShapes(links.filter(({ link }) => pair?.names.includes(link)));
    this.replace('pair', isOfRobot && shapes.length > 0 ? this.ghost(pair.position, colour, shapes) : undefined);
  }

  // The other robots of the cell; others than before are brought into view.
  setOthers(robots: readonly OtherRobot[]): void {
    if (this.others.set(robots) && this.robot && this.others.object.children.some((arm) => !isSeen(arm, this.camera))) this.refit();
  }

  setJointPosition(position: readonly number[]): void {
    this.arm?.pose(position);
    if (this.robot) this.frames.pose(this.robot, position);
    this.draw();
  }

  setPlan(shown: Planned | null, shares: readonly number[]): void {
    const isDrawn = shown?.answer.samples.tcp_pose;
    const stretches = shown && stretchesOfTools(shown.request, shown.answer);
    this.replace('path', isDrawn && pathLine(shown.answer, shares, stretches!, theme.value === 'dark'));
    this.swept = (shown && this.arm?.swept(shown.answer.samples.position)) ?? [];
    if (shown && !this.isFitted) {
      this.isFitted = true;
      this.refit(new Vector3().fromArray(DIRECTIONS.home));
    } else if (isDrawn && !isSeen(this.drawn.path!, this.camera)) this.refit();
  }

  // Shows all, the arm wherever it goes, as near as nothing is cut off.
  private refit(from = this.camera.position.clone().sub(this.controls.target)): void {
    for (const share of SHARES) {
      this.fit(from, share);
      if (areSeen([...this.ends(), ...this.others.object.children, this.drawn.path], this.swept, this.camera)) return;
    }
  }

  // The waypoints, each with the tool that it brings.
  setWaypoints(shown: Planned | null, chosen: number): void {
    this.waypoints = shown?.answer.waypoints.map(({ index }) => index) ?? [];
    const tools = this.waypoints
      .map((index) => shown?.request.waypoints[index]?.tool)
      .map((tool) => (tool ? drawnTool(tool, this.robot!) : null));
    const colours = [styleColour('--text-soft'), styleColour('--accent')] as const;
    this.replace('waypoints', shown ? waypointMarks(shown.answer, tools, this.extent * 0.008, chosen, ...colours) : undefined);
  }

  setGhosts(asked: PlanRequest | null, compared: readonly ComparedBackend[] | null, colours: readonly string[]): void {
    const group = new Group();
    compared?.forEach(({ trajectory }, index) => {
      if (asked && trajectory) group.add(ghostLine(trajectory, stretchesOfTools(asked, trajectory), colours[index % colours.length]!));
    });
    this.replace('ghosts', group);
  }

  // Shows where a refusal is: the joint position there as a ghost, and the pose of the tool.
  setProblem(problem: Problem | null): void {
    const [place, nearest] = [problem?.place, problem?.nearest];
    const jointPosition = place?.position ?? nearest?.position ?? problem?.position ?? undefined;
    const colour = styleColour('--bad');
    this.replace('ghost', jointPosition && this.ghost(jointPosition, colour));
    const at = place?.pose.position ?? nearest?.pose.position ?? problem?.point;
    this.replace('place', at && ball(at, this.extent * 0.016, colour));
  }

  // Shows a path that is not yet in the request, in view.
  setPreview(path: PreviewedPath | null): void {
    this.replace('preview', path && previewMarks(path, this.extent * 0.007, styleColour('--accent'), styleColour('--bad')));
    if (path && !isSeen(this.drawn.preview!, this.camera)) this.refit();
  }

  // Shows what the tool keeps on the way to the chosen waypoint.
  setKept(kept: Kept | null): void {
    this.replace('kept', kept && keptMarks(kept, this.extent, styleColour('--kept')));
  }

  // Shows where the arm would stand for a pose that is dragged: in red where it may not, or does not get there.
  setReach(jointPosition: readonly number[] | null, isFree: boolean): void {
    this.replace('reach', jointPosition ? this.ghost(jointPosition, styleColour(isFree ? '--accent' : '--bad')) : undefined);
  }

  // The handles at the chosen pose, with the tool that is to get there (undefined: none); a hand that holds them has put them where they are.
  setGizmo(pose: Pose | null, tool: Pose | null | undefined, mode: GizmoMode, ways: GizmoWays): void {
    if (this.gizmo.isHeld) return;
    const drawn = this.robot && tool !== undefined ? drawnTool(tool, this.robot) : undefined;
    this.gizmo.show(pose, mode, ways, drawn && toolFrame(drawn, this.extent, styleColour('--accent')));
    this.draw();
  }

  private ghost(jointPosition: readonly number[], colour: string, shapes = this.shapes): Object3D | undefined {
    if (jointPosition.length !== this.robot?.chain.length) return undefined;
    const arm = new Arm(this.robot, shapes, { colour, opacity: 0.32 });
    arm.pose(jointPosition);
    return arm.object;
  }

  setGround(): void {
    disposeOf(this.drawn.grid);
    this.drawn.grid = ground(this.extent, Math.min(0, this.bounds().min.z), styleColour('--grid-strong'), styleColour('--ground'));
    this.scene.add(this.drawn.grid);
    this.draw();
  }

  // The box around the robot, the path of its tool and what stands around it, and around more.
  private bounds(...more: readonly (Object3D | undefined)[]): Box3 {
    this.frames.standing.updateWorldMatrix(true, true);
    const box = new Box3().setFromPoints([...this.swept]);
    for (const object of [this.arm?.object, ...this.others.object.children, this.drawn.path, ...this.ends(), ...more])
      if (object) box.expandByObject(object);
    return box.isEmpty() ? new Box3(new Vector3(-1, -1, 0), new Vector3(1, 1, 1)) : box;
  }

  // What of the scene has an end: half spaces are drawn as large as the view.
  private ends(): Object3D[] {
    return [this.drawn.scene, this.drawn.waiting].flatMap((group) => group?.children ?? []).filter((child) => !child.userData.endless);
  }

  look(view: View): void {
    this.fit(new Vector3().fromArray(DIRECTIONS[view]));
  }

  // Shows all from a direction.
  private fit(from: Vector3, share = NEAR): void {
    const sphere = this.bounds(this.drawn.cloud, this.drawn.preview).getBoundingSphere(new Sphere());
    this.controls.target.copy(sphere.center);
    standBack(this.camera, sphere, from, share);
    this.controls.update();
    this.draw();
  }

  resize(): void {
    if (fillCanvas(this.canvas, this.renderer, this.camera)) this.draw();
  }

  picture(): string {
    this.render();
    return this.canvas.toDataURL('image/png');
  }

  draw(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.render();
    });
  }

  private render(): void {
    this.cloud?.face(this.camera);
    this.renderer.render(this.scene, this.camera);
  }

  private replace(name: Drawn, object: Object3D | null | undefined): void {
    disposeOf(this.drawn[name]);
    this.drawn[name] = object ?? undefined;
    if (object) this.frames.of(name).add(object);
    this.draw();
  }
}
