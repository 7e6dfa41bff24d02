// A report: one file that anyone can open. It holds the plan, and shows it with the parts of the page.
import { render } from 'preact';
import '../style/base.css';
import '../style/layout.css';
import '../style/stage.css';
import '../style/narrow.css';
import '../style/waypoints.css';
import '../style/panels.css';
import '../style/report.css';
import { Certificate } from '../panels/Certificate';
import { PlotsView } from '../plots/PlotsView';
import { Timeline } from '../plots/Timeline';
import { json } from '../request/code';
import type { LinkShape, PlanAnswer, PlanRequest, Robot } from '../service/types';
import { StageView } from '../stage/StageView';
import { links, plan, request, robot } from '../state/store';
import { texts } from '../texts';
import { seconds } from '../plan/units';
import { WaypointTable } from './WaypointTable';

interface Report {
  title: string;
  request: PlanRequest;
  answer: PlanAnswer;
  robot: Robot;
  links: readonly LinkShape[];
  version: string;
}

const report = JSON.parse(document.getElementById('plan')!.textContent) as Report;
links.value = report.links; // before the robot, which is drawn by them
robot.value = report.robot;
request.value = report.request;
plan.value = { request: report.request, answer: report.answer, took: 0 };

function Page() {
  const { answer, title, version } = report;
  return (
    <main class="report">
      <header>
        <h1>{title}</h1>
        <p>{texts.report.facts(answer.robot, answer.backend, seconds(answer.duration))}</p>
        <p class="verdict">
          <strong>{answer.certificate.satisfied ? `✓ ${texts.report.certified}` : texts.report.violated}</strong>
        </p>
      </header>
      <StageView />
      <Timeline />
      <PlotsView />
      <section class="panel">
        <h2>{texts.result.tabs.certificate}</h2>
        <Certificate />
      </section>
      <section class="panel">
        <h2>{texts.waypoints.label}</h2>
        <WaypointTable answer={answer} robot={report.robot} />
      </section>
      <details class="panel">
        <summary>{texts.json.label}</summary>
        <pre class="code">{json(report.request)}</pre>
      </details>
      <footer>
        {texts.report.madeBy(version)} <code>{answer.request_hash}</code>
      </footer>
    </main>
  );
}

render(<Page />, document.getElementById('app')!);
