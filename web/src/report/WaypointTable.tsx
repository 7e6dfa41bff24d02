// The waypoints as they were reached: when, where the joints are, how exactly.
import { factorOf, unitOf } from '../plan/units';
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
            <th scope="col">{texts.report.arrival}</th>
            <th scope="col">{texts.report.departure}</th>
            {robot.joints.map((joint) => (
              <th key={joint.name} scope="col">
                {joint.name} ({unitOf(joint, 'position')})
              </th>
            ))}
            <th scope="col">{texts.report.tool}</th>
            <th scope="col">{texts.report.error}</th>
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
                  {(Math.round(value * factorOf(robot.joints[joint]!, 'position') * 100) / 100 + 0).toFixed(2)}
                </td>
              ))}
              <td class="number">{pose.position.map((value) => (value * 1000).toFixed(1)).join(', ')}</td>
              <td class="number">{Number((position_error * 1e6).toFixed(3))}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}
