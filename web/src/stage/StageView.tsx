// The stage on the page: it follows the signals, and brings views and the screenshot.
import { useEffect, useRef, useState } from 'preact/hooks';
import { effect, signal, untracked } from '@preact/signals';
import { toolSpeeds } from '../plan/samples';
import { limitUse } from '../plan/use';
import type { Robot } from '../service/types';
import type { Planned } from '../state/store';
import { depthOf, inService, lengthBelow, written } from '../plan/units';
import { kept } from '../state/ends';
import { shownPath } from '../state/path_import';
import { select } from '../state/selection';
import { firstPosition, shownPosition } from '../state/jointPosition';
import { compared, links, ownProblem, problem, request, robot, selected, shownPlan } from '../state/store';
import { goToNearest, nearest, setting, shownPair, shownTool } from '../state/surroundings';
import { hasVisuals, showsSolids, toggleSolids } from '../state/shapes';
import { theme } from '../state/theme';
import { ANGLES, angleUnit, LENGTHS, lengthUnit } from '../state/units';
import { isCut, workspace } from '../state/workspace';
import { toggleWhole, whole } from '../state/whole';
import { texts } from '../texts';
import { JOINT_COLOURS } from '../plots/colours';
import type { Pair } from '../scene/pair';
import type { Dragging } from '../state/dragging';
import type { Reach } from '../state/reaching';
import type { GizmoMode } from './gizmo';
import type { Stage } from './stage';
import type { View } from './views';

const MODES: readonly GizmoMode[] = ['translate', 'rotate'];
const VIEWS: readonly View[] = ['home', 'front', 'side', 'top'];

const mode = signal<GizmoMode>('translate');
const ofTool = signal(false); // the handles have the axes of the tool, else those of the world
const snaps = signal(false);
const byUse = signal(false); // the path is coloured by the use of limits, else by its speed

// Without `dragging` nothing can be changed: so it is in a report.
export function StageView({ dragging }: { dragging?: Dragging }) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const [stage, setStage] = useState<Stage | null>(null);
  const [failed, setFailed] = useState(false);
  useEffect(() => {
    let stop = (): void => undefined;
    void Promise.all([import('./stage'), import('../state/placed'), import('../state/drawn_shapes'), import('../state/others')]).then(
      ([{ Stage }, placed, drawn, others]) => {
        if (!canvas.current) return;
        try {
          const made = new Stage(canvas.current);
          stop = follow(made, { ...placed, ...drawn, ...others }, dragging);
          setStage(made);
        } catch {
          setFailed(true); // a browser without WebGL: everything else works
        }
      },
    );
    return () => stop();
  }, []);
  return (
    <section class="stage" aria-label={texts.stage.label}>
      <canvas ref={canvas} tabIndex={0} role="img" aria-label={robot.value ? texts.stage.canvas(robot.value.id) : texts.stage.empty} />
      {failed && <p class="stage-failed">{texts.stage.failed}</p>}
      {!robot.value && problem.value && <p class="stage-failed">{texts.stage.none(request.value?.robot ?? '')}</p>}
      <div class="stage-tools" role="group" aria-label={texts.stage.views}>
        {dragging?.pose() && (
          <>
            {MODES.map((name) => (
              <button key={name} type="button" aria-pressed={mode.value === name} onClick={() => (mode.value = name)}>
                {texts.stage.mode[name]}
              </button>
            ))}
            <button type="button" aria-pressed={ofTool.value} onClick={() => (ofTool.value = !ofTool.value)}>
              {texts.stage.toolAxes}
            </button>
            <button
              type="button"
              aria-pressed={snaps.value}
              title={texts.stage.snapHint(...snapTexts())}
              onClick={() => (snaps.value = !snaps.value)}
            >
              {texts.stage.snap}
            </button>
          </>
        )}
        {VIEWS.map((view) => (
          <button key={view} type="button" onClick={() => stage?.look(view)}>
            {texts.stage.view[view]}
          </button>
        ))}
        {hasVisuals.value && (dragging || links.value.length > 0) && (
          <button type="button" aria-pressed={showsSolids.value} title={texts.stage.solidsHint} onClick={toggleSolids}>
            {texts.stage.solids}
          </button>
        )}
        <button type="button" aria-pressed={whole.value === 'stage'} onClick={() => toggleWhole('stage')}>
          {texts.stage.whole}
        </button>
        <button type="button" onClick={() => stage && savePicture(stage)}>
          {texts.stage.screenshot}
        </button>
      </div>
      <div class="stage-notes">
        {dragging && <ReachNote reach={dragging.reach()} />}
        <div class="stage-keys">
          <ColourKey />
          <NearestNote />
        </div>
      </div>
    </section>
  );
}

// The steps of a snapping hand, m and rad.
function snapSteps(): [number, number] {
  return [inService(LENGTHS[lengthUnit.value].steps[2], 'm'), inService(ANGLES[angleUnit.value].steps[2], 'rad')];
}

function snapTexts(): [string, string] {
  const [distance, angle] = snapSteps();
  return [written(distance, 'm'), written(angle, 'rad')];
}

// Whether the pose that is dragged can be reached, in how many ways, and what is in the way.
function ReachNote({ reach }: { reach: Reach | null }) {
  if (!reach) return null;
  if (reach.kind === 'missed') return <p class="reach-note missed">{texts.stage.missed(written(reach.distance, 'm', 3))}</p>;
  return (
    <p class={`reach-note ${reach.collision ? 'hindered' : 'reached'}`}>
      {reach.kind === 'reached' && texts.stage.reached(reach.solutions, reach.free)}
      {reach.collision && <strong>{texts.stage.hindered(reach.collision.pair, depthOf(reach.collision))}</strong>}
    </p>
  );
}

// Which two things come nearest, and when; it leads there.
function NearestNote() {
  const found = nearest.value;
  if (!found) return null;
  const { kind, clearance } = found;
  return (
    <button type="button" class="nearest-note" onClick={() => goToNearest(kind)}>
      {texts.clearance.note(clearance.pair!, lengthBelow(clearance.lower), clearance.time!)}
    </button>
  );
}

// What the colours of the path mean; a click colours it by the other.
function ColourKey() {
  const shown = shownPlan.value;
  if (!shown?.answer.samples.tcp_velocity) return null;
  const [least, most] = byUse.value ? ['0', '100 %'] : ['0', written(fastestOf(shown), 'm/s', 3)];
  return (
    <button type="button" class="colour-key" title={texts.stage.colourHint} onClick={() => (byUse.value = !byUse.value)}>
      {byUse.value ? texts.stage.use : texts.stage.speed} {least} <span class="speed-scale" /> {most}
    </button>
  );
}

function fastestOf({ answer }: Planned): number {
  return toolSpeeds(answer).reduce((most, speed) => Math.max(most, speed), 1e-9);
}

function sharesOf(shown: Planned | null, arm: Robot | null): readonly number[] {
  if (!shown || !arm) return [];
  if (byUse.value) return limitUse(shown.answer);
  const fastest = fastestOf(shown);
  return toolSpeeds(shown.answer).map((speed) => speed / fastest);
}

// What is in the way where the arm would stand.
function hindranceOf(reach: Reach | null): Pair | null {
  return reach && 'collision' in reach && reach.collision ? { names: reach.collision.pair, position: reach.position } : null;
}

type Drawing = typeof import('../state/placed') & typeof import('../state/drawn_shapes') & typeof import('../state/others');

function follow(
  stage: Stage,
  { movable, placedAtPair, standing, shownShapes, otherRobots, otherPositions }: Drawing,
  dragging: Dragging | undefined,
): () => void {
  stage.gizmo.onDrag = (pose) => dragging?.onDrag(pose);
  stage.gizmo.onDrop = (pose) => dragging?.onDrop(pose);
  stage.onPick = select;
  const observer = new ResizeObserver(() => stage.resize());
  observer.observe(stage.canvas);
  const stops = [
    effect(() => {
      const arm = robot.value;
      if (arm) untracked(() => stage.setRobot(arm, shownShapes.value, firstPosition(request.peek(), arm)));
      else stage.removeRobot();
    }),
    effect(() => stage.setShapes(shownShapes.value)),
    effect(() => stage.setOthers(otherRobots.value)),
    effect(() => {
      otherRobots.value;
      stage.others.pose(otherPositions.value);
      stage.draw();
    }),
    effect(() => {
      theme.value; // drawn anew in other colours
      robot.value;
      stage.setSurroundings(setting.value, standing.value);
    }),
    effect(() => {
      theme.value; // drawn anew in other colours
      robot.value;
      otherRobots.value;
      stage.setMovable(movable.value);
    }),
    effect(() => {
      theme.value; // drawn anew in other colours
      robot.value;
      stage.setTool(shownTool.value);
    }),
    effect(() => {
      theme.value; // drawn anew in other colours
      stage.setCloud(workspace.value?.answer ?? null, isCut.value);
    }),
    effect(() => {
      theme.value; // drawn anew in other colours
      setting.value;
      const hindrance = hindranceOf(dragging?.reach() ?? null);
      stage.setPair(hindrance ?? shownPair.value, placedAtPair.value, links.value, hindrance !== null || problem.value !== null);
    }),
    effect(() => {
      theme.value; // drawn anew in other colours
      stage.setPlan(shownPlan.value, sharesOf(shownPlan.value, robot.value));
    }),
    effect(() => {
      theme.value; // drawn anew in other colours
      stage.setWaypoints(shownPlan.value, selected.value);
    }),
    effect(() => {
      theme.value; // drawn anew in other colours
      robot.value;
      stage.setGizmo(dragging?.pose() ?? null, dragging?.tool(), mode.value, {
        ofTool: ofTool.value,
        snap: snaps.value ? snapSteps() : null,
      });
    }),
    effect(() => {
      const found = dragging?.reach() ?? null;
      stage.setReach(found?.position ?? null, found?.kind === 'reached' && !found.collision);
    }),
    effect(() => {
      theme.value; // drawn anew in other colours
      stage.setKept(kept.value);
    }),
    effect(() => {
      theme.value; // drawn anew in other colours
      stage.setPreview(shownPath.value);
    }),
    effect(() => stage.setGhosts(request.peek(), compared.value, JOINT_COLOURS)),
    effect(() => {
      robot.value; // a ghost of another robot goes
      stage.setProblem(ownProblem.value);
    }),
    effect(() => {
      if (robot.value) stage.setJointPosition(shownPosition(robot.value));
    }),
  ];
  return () => {
    observer.disconnect();
    for (const stop of stops) stop();
  };
}

function savePicture(stage: Stage): void {
  const link = document.createElement('a');
  link.href = stage.picture();
  link.download = `${robot.value?.id ?? 'robot'}.png`;
  link.click();
}
