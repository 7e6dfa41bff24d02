// The choice among the ways in which a pose can be reached; the one that is pointed at is shown on the stage.
import { useRef, useState } from 'preact/hooks';
import { decimal, depthOf, shownIn, unitOf } from '../plan/units';
import { configured, isSolution, sidesOf, unconfigured } from '../request/configurations';
import type { PlanRequest, PoseWaypoint, Robot, Solution } from '../service/types';
import { show } from '../state/actions';
import { askSolutions, plannedPosition, poseInBase, solutions } from '../state/configurations';
import { endReach, freeOf, showReach } from '../state/reaching';
import { texts } from '../texts';

interface ConfigurationsProps {
  request: PlanRequest;
  robot: Robot;
  index: number;
}

export function Configurations({ request, robot, index }: ConfigurationsProps) {
  const host = useRef<HTMLDivElement>(null);
  const all = solutions.value;
  const { configuration } = request.waypoints[index] as PoseWaypoint;
  // What had the focus is gone: the first that has come in its place gets it, else the waypoint.
  const focusFirst = (): void => {
    requestAnimationFrame(() => {
      const next = host.current?.querySelector<HTMLElement>('button') ?? document.querySelector<HTMLElement>(`[data-waypoint="${index}"]`);
      next?.focus();
    });
  };
  const focusWays = (): void => void requestAnimationFrame(() => host.current?.querySelector<HTMLElement>('.ways button')?.focus());
  const choose = (next: PlanRequest): void => {
    endReach();
    show(next);
    focusFirst();
  };
  return (
    <div class="configurations" ref={host}>
      {configuration && (
        <button type="button" onClick={() => choose(unconfigured(request, index))}>
          {texts.configurations.leave}
        </button>
      )}
      {all === null && (
        <button type="button" disabled={!poseInBase(request, index)} onClick={() => void askSolutions().then(focusWays)}>
          {texts.configurations.ask}
        </button>
      )}
      {all && <Ways all={all} robot={robot} onChoose={(solution) => choose(configured(request, index, solution, all))} />}
    </div>
  );
}

interface WaysProps {
  all: readonly Solution[];
  robot: Robot;
  onChoose: (solution: Solution) => void;
}

// One stop of the tab key, however many there are: arrows lead from one to the next.
function Ways({ all, robot, onChoose }: WaysProps) {
  const [focused, setFocused] = useState(0);
  const planned = plannedPosition.value;
  const label = texts.configurations.label(all.length, freeOf(all));
  const point = (number: number): void => {
    setFocused(number);
    showReach(all[number]!, all);
  };
  // The mouse also leaves when the list moves below it: what has the focus is shown on.
  const leave = ({ currentTarget }: { currentTarget: HTMLElement }): void =>
    currentTarget.contains(document.activeElement) ? point(focused) : endReach();
  return (
    <>
      <p class="hint">
        {label}. {texts.configurations.hint}
      </p>
      <ol class="ways" aria-label={label} onKeyDown={keys} onMouseLeave={leave}>
        {all.map((solution, number) => (
          <li key={number}>
            <button
              type="button"
              tabIndex={number === focused ? 0 : -1}
              aria-current={planned !== null && isSolution(planned, solution)}
              onMouseEnter={() => showReach(solution, all)}
              onFocus={() => point(number)}
              onBlur={endReach}
              onClick={() => onChoose(solution)}
            >
              {[
                texts.configurations.number(number, all.length),
                ...sidesOf(solution).map(([part, side]) => texts.configurations.side(part, side)),
              ].join(', ')}
              <small>{textOfPosition(solution, robot)}</small>
              {solution.collision && (
                <small class="hindered">{texts.configurations.hindered(solution.collision.pair, depthOf(solution.collision))}</small>
              )}
            </button>
          </li>
        ))}
      </ol>
    </>
  );
}

function keys(event: KeyboardEvent): void {
  const buttons = [...(event.currentTarget as HTMLElement).querySelectorAll('button')];
  const at = buttons.indexOf(event.target as HTMLButtonElement);
  const to = { ArrowUp: at - 1, ArrowDown: at + 1, Home: 0, End: buttons.length - 1 }[event.key];
  if (at < 0 || to === undefined) return;
  event.preventDefault();
  buttons[Math.min(Math.max(0, to), buttons.length - 1)]!.focus();
}

// The unit stands once where all joints have the same.
function textOfPosition({ position }: Solution, { joints }: Robot): string {
  const units = joints.map((joint) => unitOf(joint, 'position'));
  const name = (joint: number): string => shownIn(units[joint]!).name;
  const isSame = units.every((unit) => unit === units[0]);
  const values = position.map((value, joint) => `${decimal(value, units[joint]!)}${isSame ? '' : ` ${name(joint)}`}`);
  return `${values.join(', ')}${isSame ? ` ${name(0)}` : ''}`;
}
