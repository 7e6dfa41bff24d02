// The report of a batch: counts, histograms, refusals, and the worst plans, one of which is shown at a time.
import { effect } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { Histogram } from '../panels/Histogram';
import type { Bars } from '../panels/Histogram';
import { seconds, short } from '../plan/units';
import { texts } from '../texts';
import { choose, chosen, firstShown, percent, span } from './batch';
import type { ReportedBatch } from './batch';
import { showPlan } from '../state/reported';
import { PlanView } from './PlanView';
import { Refusals } from './Refusals';
import { WorstPlans } from './WorstPlans';

export function BatchReport(report: ReportedBatch) {
  const { batch, version } = report;
  useEffect(() => {
    choose(firstShown(report));
    return effect(() => {
      const shown = report.plans[chosen.value ?? -1];
      if (shown) showPlan(shown.plan, report.arms[shown.arm]!);
    });
  }, []);
  return (
    <main class="report batch-report">
      <header>
        <h1>{texts.batchReport.title(batch.id)}</h1>
        <p>
          {texts.batchReport.times(
            texts.batch.status[batch.status],
            moment(batch.created),
            batch.ended === null ? null : moment(batch.ended),
          )}
        </p>
      </header>
      <Counts {...report} />
      <Histograms {...report} />
      <Refusals {...report} />
      <WorstPlans {...report} />
      <ChosenPlan {...report} />
      <footer>
        {texts.batchReport.madeBy(version)} <code>{batch.id}</code>
      </footer>
    </main>
  );
}

function Counts({ batch }: ReportedBatch) {
  const { total, planned, refused, waiting } = batch.counts;
  const elapsed = batch.ended === null ? null : (Date.parse(batch.ended) - Date.parse(batch.created)) / 1000;
  const rate = batch.rate ?? (elapsed ? (total - waiting) / elapsed : null);
  const words = texts.batchReport.outcomes;
  return (
    <section class="panel" aria-label={texts.batchReport.counts}>
      <dl class="tiles">
        <Tile name={words.total} value={String(total)} />
        <Tile name={words.planned} value={String(planned)} />
        <Tile name={words.refused} value={String(refused)} />
        {waiting > 0 && <Tile name={words.waiting} value={String(waiting)} />}
        {rate !== null && <Tile name={texts.batchReport.rate} value={short(rate, 3)} />}
        {elapsed !== null && <Tile name={texts.batchReport.elapsed} value={span(elapsed)} />}
      </dl>
      <div class="outcomes" aria-hidden="true">
        <span class="planned" style={{ flexGrow: planned }} />
        <span class="refused" style={{ flexGrow: refused }} />
        <span style={{ flexGrow: waiting }} />
      </div>
    </section>
  );
}

function Tile({ name, value }: { name: string; value: string }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>{value}</dd>
    </div>
  );
}

function Histograms({ figures }: ReportedBatch) {
  const { duration, ratio, seconds: computing } = figures;
  return (
    <section class="panel">
      <h2>{texts.batchReport.histograms}</h2>
      {!duration && <p class="hint">{texts.batchReport.none}</p>}
      <div class="columns">
        <Spread title={texts.batchReport.duration} bars={duration} written={seconds} />
        <Spread title={texts.batchReport.ratio} bars={ratio} written={percent} />
        <Spread title={texts.batchReport.seconds} bars={computing} written={span} />
      </div>
    </section>
  );
}

function Spread({ title, bars, written }: { title: string; bars: Bars | null; written: (value: number) => string }) {
  if (!bars) return null;
  const label = texts.batchReport.spread(written(bars.least), written(bars.mean), written(bars.most));
  return <Histogram title={title} label={label} written={written} {...bars} />;
}

function ChosenPlan({ plans, arms }: ReportedBatch) {
  const index = chosen.value;
  const shown = index === null ? undefined : plans[index];
  if (!shown) return null;
  const { answer } = shown.plan;
  return (
    <section class="chosen-plan" id="chosen" aria-label={texts.batchReport.request(index!)}>
      <header>
        <h2>{texts.batchReport.request(index!)}</h2>
        <p>{texts.report.facts(answer.robot, answer.backend, seconds(answer.duration))}</p>
      </header>
      <PlanView key={shown.arm} {...shown.plan} robot={arms[shown.arm]!.robot} />
    </section>
  );
}

// A time by the clock, in words that are read everywhere.
function moment(rfc3339: string): string {
  return `${rfc3339.slice(0, 10)} ${rfc3339.slice(11, 19)} UTC`;
}
