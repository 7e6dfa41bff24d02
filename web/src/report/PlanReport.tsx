// The report of a plan.
import { seconds } from '../plan/units';
import { texts } from '../texts';
import { showPlan } from '../state/reported';
import type { Arm, AskedPlan } from '../state/reported';
import { PlanView } from './PlanView';

export interface ReportedPlan extends AskedPlan, Arm {
  title: string;
  version: string;
}

export function PlanReport(report: ReportedPlan) {
  const { answer, title, version } = report;
  showPlan(report, report);
  return (
    <main class="report">
      <header>
        <h1>{title}</h1>
        <p>{texts.report.facts(answer.robot, answer.backend, seconds(answer.duration))}</p>
        <p class="verdict">
          <strong>{answer.certificate.satisfied ? `✓ ${texts.report.certified}` : texts.report.violated}</strong>
        </p>
      </header>
      <PlanView request={report.request} answer={answer} robot={report.robot} />
      <footer>
        {texts.report.madeBy(version)} <code>{answer.request_hash}</code>
      </footer>
    </main>
  );
}
