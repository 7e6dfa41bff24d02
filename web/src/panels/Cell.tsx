// The robots of a cell: one of them is edited below; where each stands, what all of them keep, and when they wait and meet.
import { MOST_ROBOTS, robotsOf, sharedNames, withMeeting, withName, withoutRobot, withRobot, withRules } from '../request/cells';
import { lengthBelow, seconds } from '../plan/units';
import type { CellAnswer, PlanRequest, Pose, Robot } from '../service/types';
import { show } from '../state/actions';
import { chooseRobotOfCell, currentCell } from '../state/cells';
import { seek } from '../state/playback';
import { projectRequest, projects } from '../state/projects';
import { refusedRobots } from '../state/store';
import { texts } from '../texts';
import { NumberField, TextField } from './fields';
import { Menu } from './Menu';
import { PoseFields } from './PoseFields';

export function Cell({ request, robot }: { request: PlanRequest; robot: Robot | null }) {
  const { cell } = request;
  if (!cell) return null;
  const planned = currentCell.value;
  const names = sharedNames(request);
  return (
    <section class="cell" aria-label={texts.cells.label}>
      <div class="panel-head">
        <h2>{texts.cells.label}</h2>
        <AddRobot request={request} />
      </div>
      <ol class="waypoints">
        {robotsOf(request).map((own, index) => (
          <Row key={index} own={own} index={index} isChosen={index === cell.index} planned={planned} />
        ))}
      </ol>
      <Findings planned={planned} skew={cell.rules.skew ?? 0} />
      <div class="way">
        <NumberField
          label={texts.cells.margin}
          unit="m"
          value={cell.rules.margin}
          placeholder="0"
          min={0}
          onValue={(margin) => show(withRules(request, { margin }))}
        />
        <NumberField
          label={texts.cells.skew}
          title={texts.cells.skewHint}
          unit="s"
          value={cell.rules.skew}
          placeholder="0"
          min={0}
          onValue={(skew) => show(withRules(request, { skew }))}
        />
      </div>
      {names.length > 0 && (
        <fieldset class="group">
          <legend>{texts.cells.meetings}</legend>
          {names.map((name) => (
            <label key={name} class="check">
              <input
                type="checkbox"
                checked={cell.rules.meetings?.includes(name) ?? false}
                onChange={(event) => show(withMeeting(request, name, event.currentTarget.checked))}
              />{' '}
              {name}
            </label>
          ))}
        </fieldset>
      )}
      <p class="hint">{texts.cells.hint}</p>
      <h2>{texts.cells.ofRobot(cell.name)}</h2>
      <TextField label={texts.cells.name} value={cell.name} onValue={(name) => rename(request, name)} />
      <fieldset class="group">
        <legend>{texts.cells.base}</legend>
        <PoseFields pose={request.mounting ?? mountedAt(robot)} onPose={(mounting) => show({ ...request, mounting })} />
      </fieldset>
    </section>
  );
}

// The button for another robot, which makes a cell of a request by itself.
export function AddRobot({ request }: { request: PlanRequest }) {
  if (robotsOf(request).length >= MOST_ROBOTS) return null;
  const kept = Object.keys(projects.value).flatMap((name) => {
    const like = projectRequest(name);
    return like && !like.cell ? [{ text: name, onChoose: () => show(withRobot(request, like)) }] : [];
  });
  const same = { items: [{ text: texts.cells.addSame, onChoose: () => show(withRobot(request)) }] };
  return <Menu label={texts.cells.add} groups={kept.length > 0 ? [same, { label: texts.cells.addProject, items: kept }] : [same]} />;
}

interface RowProps {
  own: PlanRequest;
  index: number;
  isChosen: boolean;
  planned: CellAnswer | null;
}

function Row({ own, index, isChosen, planned }: RowProps) {
  const { cell, robot } = own;
  const answer = planned?.robots[index];
  const waits = answer?.waits.flatMap((wait, at) => (wait > 0 ? [texts.cells.wait(seconds(wait), at)] : [])) ?? [];
  return (
    <li class={`${isChosen ? 'chosen' : ''} ${refusedRobots.value.includes(index) ? 'wrong' : ''}`}>
      <button type="button" class="row" aria-current={isChosen} onClick={() => chooseRobotOfCell(index)}>
        <span class="what">
          <strong>{cell!.name}</strong>
          <small>{robot}</small>
        </span>
        <span class="when">
          {answer && seconds(answer.plan.duration)}
          {answer && <small>{waits.length > 0 ? waits.join(', ') : texts.cells.noWait}</small>}
        </span>
      </button>
      {isChosen && (
        <span class="buttons">
          <button
            type="button"
            aria-label={texts.cells.remove(cell!.name)}
            title={texts.cells.remove(cell!.name)}
            onClick={() => show(withoutRobot(own))}
          >
            ✕
          </button>
        </span>
      )}
    </li>
  );
}

// What is proved between the robots, and when they meet.
function Findings({ planned, skew }: { planned: CellAnswer | null; skew: number }) {
  if (!planned) return null;
  return (
    <ul class="found" aria-label={texts.cells.found}>
      {planned.clearances.map(({ robots, clearance }) => (
        <li key={robots.join()}>
          {texts.cells.clear(robots, lengthBelow(clearance.lower), seconds(skew))}
          {clearance.time !== null && <Moment time={clearance.time} />}
        </li>
      ))}
      {planned.meetings.map(({ name, waypoints, time }) => (
        <li key={name}>
          {texts.cells.meet(Object.keys(waypoints), name)}
          <Moment time={time} />
        </li>
      ))}
    </ul>
  );
}

function Moment({ time }: { time: number }) {
  return (
    <>
      {' '}
      <button type="button" class="link" aria-label={texts.result.goTo(seconds(time))} onClick={() => seek(time)}>
        {seconds(time)}
      </button>
    </>
  );
}

// A name that another robot has, or that is none, is not taken.
function rename(request: PlanRequest, name: string): void {
  const next = /^[A-Za-z0-9][A-Za-z0-9_.-]*$/.test(name) ? withName(request, name) : null;
  if (next) show(next);
}

// The base as the robot itself has it.
function mountedAt(robot: Robot | null): Pose {
  const { position, quaternion_xyzw } = robot?.mounting ?? { position: [0, 0, 0], quaternion_xyzw: [0, 0, 0, 1] };
  return { position, orientation: { kind: 'quaternion', xyzw: quaternion_xyzw } };
}
