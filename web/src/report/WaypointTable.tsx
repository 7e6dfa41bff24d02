// The waypoints as they were reached: when, where the joints are, how exactly.
import { decimal, short, shownIn, unitOf, withUnit } from '../plan/units';
import type { PlanAnswer, Robot } from '../service/types';
import { seek } from '../state/playback';
import { texts } from '../texts';

interface TableProps {
  answer: PlanAnswer;
  robot: Robot;
}

export function WaypointTable({ answer, robot }: TableProps) {
  return (
    <div class="wide-table" tabIndex={0}>
      <table>
        <thead>
          <tr>
            <th scope="col">{texts.report.waypoint}</th>
            <th scope="col">{withUnit(texts.report.arrival, 's')}</th>
            <th scope="col">{withUnit(texts.report.departure, 's')}</th>
            {robot.joints.map((joint) => (
              <th key={joint.name} scope="col">
                {withUnit(joint.name, unitOf(joint, 'position'))}
              </th>
            ))}
            <th scope="col">{withUnit(texts.report.tool, 'm')}</th>
            <th scope="col">{withUnit(texts.report.error, 'm')}</th>
          </tr>
        </thead>
        <tbody>
          {answer.waypoints.map(({ index, name, arrival_time, departure_time, position, pose, position_error }, row) => (
            <tr key={row}>
              <th scope="row">{name ?? index}</th>
              <td class="number">
                <button type="button" class="link" onClick={() => seek(arrival_time)}>
                  {arrival_time.toFixed(3)}
                </button>
              </td>
              <td class="number">{departure_time.toFixed(3)}</td>
              {position.map((value, joint) => (
                <td key={joint} class="number">
                  {decimal(value, unitOf(robot.joints[joint]!, 'position'))}
                </td>
              ))}
              <td class="number">{pose.position.map((value) => decimal(value, 'm')).join(', ')}</td>
              <td class="number">{short(position_error * shownIn('m').factor, 2)}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}
