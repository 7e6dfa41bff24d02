// The choice among the ways in which a pose can be reached; the one that is pointed at is shown on the stage.
import { factorOf, short, unitOf } from '../plan/units';
import { configured, sidesOf, unconfigured } from '../request/configurations';
import type { PlanRequest, PoseWaypoint, Robot, Solution } from '../service/types';
import { show } from '../state/actions';
import { askSolutions, poseInBase, solutions } from '../state/configurations';
import { endReach, showReach } from '../state/reaching';
import { texts } from '../texts';

interface ConfigurationsProps {
  request: PlanRequest;
  robot: Robot;
  index: number;
}

export function Configurations({ request, robot, index }: ConfigurationsProps) {
  const all = solutions.value;
  const { configuration } = request.waypoints[index] as PoseWaypoint;
  const choose = (next: PlanRequest): void => {
    endReach();
    show(next);
  };
  return (
    <div class="configurations" onMouseLeave={endReach}>
      {configuration && (
        <button type="button" onClick={() => choose(unconfigured(request, index))}>
          {texts.configurations.leave}
        </button>
      )}
      {all === null && (
        <button type="button" disabled={!poseInBase(request, index)} onClick={() => void askSolutions()}>
          {texts.configurations.ask}
        </button>
      )}
      {all?.map((solution, number) => (
        <button
          key={number}
          type="button"
          title={postureOf(solution, robot)}
          onMouseEnter={() => showReach(solution.position, all.length)}
          onFocus={() => showReach(solution.position, all.length)}
          onBlur={endReach}
          onClick={() => choose(configured(request, index, solution, all))}
        >
          {texts.configurations.number(number, all.length)} {sidesOf(solution).map(([part, side]) => texts.configurations.side(part, side)).join(', ') || postureOf(solution, robot)}
        </button>
      ))}
    </div>
  );
}

function postureOf({ position }: Solution, robot: Robot): string {
  return position.map((value, joint) => `${short(value * factorOf(robot.joints[joint]!, 'position'), 4)} ${unitOf(robot.joints[joint]!, 'position')}`).join(', ');
}
