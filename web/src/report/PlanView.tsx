// A plan as reports show it: the robot in motion, plots, certificate, waypoints and the request.
import { Certificate } from '../panels/Certificate';
import { PlotsView } from '../plots/PlotsView';
import { Timeline } from '../plots/Timeline';
import { json } from '../request/code';
import type { Robot } from '../service/types';
import { StageView } from '../stage/StageView';
import type { AskedPlan } from '../state/reported';
import { texts } from '../texts';
import { WaypointTable } from './WaypointTable';

export function PlanView({ request: asked, answer, robot: arm }: AskedPlan & { robot: Robot }) {
  return (
    <>
      <div class="middle">
        <StageView />
        <Timeline />
        <PlotsView />
      </div>
      <section class="panel">
        <h2>{texts.result.tabs.certificate}</h2>
        <Certificate />
      </section>
      <section class="panel">
        <h2>{texts.waypoints.label}</h2>
        <WaypointTable answer={answer} robot={arm} />
      </section>
      <details class="panel">
        <summary>{texts.json.label}</summary>
        <pre class="code">{json(asked)}</pre>
      </details>
    </>
  );
}
