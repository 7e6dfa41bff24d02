// A plan as reports show it: the robot in motion, plots, certificate, waypoints and the request.
import { batch as together } from '@preact/signals';
import { Certificate } from '../panels/Certificate';
import { PlotsView } from '../plots/PlotsView';
import { Timeline } from '../plots/Timeline';
import { json } from '../request/code';
import type { LinkShape, PlanAnswer, PlanRequest, Robot } from '../service/types';
import { StageView } from '../stage/StageView';
import { playing, time } from '../state/playback';
import { links, plan, request, robot } from '../state/store';
import { texts } from '../texts';
import { WaypointTable } from './WaypointTable';

export interface AskedPlan {
  request: PlanRequest;
  answer: PlanAnswer;
}

export interface Arm {
  robot: Robot;
  links: readonly LinkShape[];
}

// Makes a plan the one that is shown.
export function showPlan(asked: AskedPlan, arm: Arm): void {
  if (plan.peek()?.answer === asked.answer) return;
  together(() => {
    playing.value = false;
    time.value = 0;
    links.value = arm.links;
    robot.value = arm.robot;
    request.value = asked.request;
    plan.value = { request: asked.request, answer: asked.answer, took: 0 };
  });
}

export function PlanView({ request: asked, answer, robot: arm }: AskedPlan & { robot: Robot }) {
  return (
    <>
      <StageView />
      <Timeline />
      <PlotsView />
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
