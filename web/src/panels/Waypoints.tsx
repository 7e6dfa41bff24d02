// The list of waypoints: choose, add, reorder by drag and by keys, delete.
import { signal } from '@preact/signals';
import { jointWaypoint, moved, removed } from '../request/edits';
import { zonesOf } from '../request/zones';
import { plannedWaypoint } from '../plan/samples';
import { seconds, short, written } from '../plan/units';
import type { PlanRequest, Robot, Waypoint } from '../service/types';
import { insert, insertPose, show } from '../state/actions';
import { select } from '../state/selection';
import { shownPosition } from '../state/jointPosition';
import { isStale, ownProblem, request, robot, selected, shownPlan } from '../state/store';
import { texts } from '../texts';
import { AddRobot, Cell } from './Cell';
import { Menu } from './Menu';
import type { MenuGroup } from './Menu';
import { MoreOfRequest } from './MoreFields';
import { Ordering } from './Ordering';
import { PathImport } from './PathImport';
import { ScenePanel } from './scene/ScenePanel';
import { SpeedZones } from './SpeedZones';
import { Units } from './Units';
import { WaypointEditor } from './WaypointEditor';

const dragged = signal<number | null>(null);

export function Waypoints() {
  const [shown, arm] = [request.value, robot.value];
  if (!shown) return <section class="panel" id="waypoints" />;
  return (
    <section class="panel" id="waypoints" tabIndex={-1} aria-label={texts.waypoints.label}>
      <Cell request={shown} robot={arm} />
      <div class="panel-head">
        <h2>{texts.waypoints.label}</h2>
        {arm && <Menu label={texts.waypoints.add} groups={additions(arm)} />}
        <Units />
      </div>
      <ol class="waypoints" onKeyDown={(event) => keys(event, shown)}>
        {shown.waypoints.map((waypoint, index) => (
          <Row key={index} waypoint={waypoint} index={index} shown={shown} />
        ))}
      </ol>
      <p class="hint">{texts.waypoints.keys}</p>
      <Ordering request={shown} />
      {arm && <WaypointEditor request={shown} robot={arm} index={Math.min(selected.value, shown.waypoints.length - 1)} />}
      {arm && <PathImport />}
      {arm && <MoreOfRequest request={shown} robot={arm} />}
      {arm && <ScenePanel request={shown} robot={arm} />}
      {(shown.scene || zonesOf(shown).length > 0) && <SpeedZones request={shown} />}
      {!shown.cell && <AddRobot request={shown} />}
    </section>
  );
}

interface RowProps {
  waypoint: Waypoint;
  index: number;
  shown: PlanRequest;
}

function Row({ waypoint, index, shown }: RowProps) {
  const planned = isStale.value ? null : shownPlan.value;
  const answer = planned ? plannedWaypoint(planned.answer, index) : undefined;
  const chosenOption = planned?.answer.choices?.find((choice) => choice.waypoint === index)?.option ?? null;
  const isChosen = selected.value === index;
  const isWrong = ownProblem.value?.waypoint === index;
  return (
    <li
      class={`${isChosen ? 'chosen' : ''} ${isWrong ? 'wrong' : ''} ${dragged.value === index ? 'dragged' : ''}`}
      draggable
      onDragStart={() => (dragged.value = index)}
      onDragEnd={() => (dragged.value = null)}
      onDragOver={(event) => event.preventDefault()}
      onDrop={() => drop(shown, index)}
    >
      <button type="button" class="row" aria-current={isChosen} data-waypoint={index} onClick={() => select(index)}>
        <span class="number">{index}</span>
        <span class="what">
          <strong>{waypoint.name ?? texts.waypoints.kinds[waypoint.kind]}</strong>
          <small>{waypoint.kind === 'any_of' ? texts.waypoints.options(waypoint.options.length, chosenOption) : summary(waypoint)}</small>
        </span>
        <span class="when">
          {answer && seconds(answer.arrival_time)}
          {answer && waypoint.kind === 'pose' && !waypoint.on && (
            <small>{texts.waypoints.solutions(answer.solution, answer.solutions)}</small>
          )}
        </span>
      </button>
      {isChosen && (
        <span class="buttons">
          <button
            type="button"
            aria-label={texts.waypoints.up}
            title={texts.waypoints.up}
            disabled={index === 0}
            onClick={() => move(shown, index, index - 1)}
          >
            ↑
          </button>
          <button
            type="button"
            aria-label={texts.waypoints.down}
            title={texts.waypoints.down}
            disabled={index === shown.waypoints.length - 1}
            onClick={() => move(shown, index, index + 1)}
          >
            ↓
          </button>
          <button
            type="button"
            aria-label={texts.waypoints.duplicate}
            title={texts.waypoints.duplicate}
            onClick={() => insert(structuredClone(waypoint))}
          >
            ❐
          </button>
          <button
            type="button"
            aria-label={texts.waypoints.remove}
            title={texts.waypoints.remove}
            disabled={shown.waypoints.length <= 2}
            onClick={() => show(removed(shown, index))}
          >
            ✕
          </button>
        </span>
      )}
    </li>
  );
}

// How the robot gets there and how it passes, in a few words.
export function summary(waypoint: Waypoint): string {
  const { motion, transition, duration, dwell } = waypoint;
  const parts = [texts.editor.motions[motion?.kind ?? 'joint']];
  if (transition?.kind === 'through') parts.push(texts.editor.transitions.through);
  if (transition?.kind === 'blend') parts.push(`${texts.editor.transitions.blend} ${written(transition.radius, 'm')}`);
  if (duration) parts.push(`${short(duration)} s`);
  if (dwell) parts.push(`+ ${short(dwell)} s`);
  return parts.join(', ');
}

function keys(event: KeyboardEvent, shown: PlanRequest): void {
  const index = selected.value;
  const row = (event.target as HTMLElement).closest('[data-waypoint]');
  if (!row) return;
  const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
  if (step !== undefined) {
    event.preventDefault();
    const to = Math.min(Math.max(0, index + step), shown.waypoints.length - 1);
    if (event.altKey) move(shown, index, to);
    else select(to);
    requestAnimationFrame(() => document.querySelector<HTMLElement>(`[data-waypoint="${to}"]`)?.focus());
  } else if (event.key === 'Delete') show(removed(shown, index));
}

function move(shown: PlanRequest, from: number, to: number): void {
  select(to);
  show(moved(shown, from, to));
}

function drop(shown: PlanRequest, to: number): void {
  if (dragged.value !== null && dragged.value !== to) move(shown, dragged.value, to);
  dragged.value = null;
}

// What can be added behind the chosen waypoint.
function additions(arm: Robot): MenuGroup[] {
  const lift: Waypoint = { kind: 'relative', frame: 'base', move: { kind: 'cartesian', translation: [0, 0, 0.05] } };
  const usual = [
    { text: texts.waypoints.addJointPosition, onChoose: () => insert(jointWaypoint(shownPosition(arm))) },
    { text: texts.waypoints.addPose, onChoose: () => void insertPose(shownPosition(arm)) },
    { text: texts.waypoints.addRelative, onChoose: () => insert(lift) },
  ];
  const named = Object.keys(arm.named_positions).map((name) => ({ text: name, onChoose: () => insert({ kind: 'named', name }) }));
  return named.length > 0 ? [{ items: usual }, { label: texts.waypoints.addNamed, items: named }] : [{ items: usual }];
}
