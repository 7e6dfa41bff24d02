// The worst plans of a batch, by what is worst about them, each with a small graph; a click shows one as a whole.
import { useMemo } from 'preact/hooks';
import { seconds } from '../plan/units';
import { curvesOf } from '../plots/curves';
import { texts } from '../texts';
import { choose, chosen, KINDS, percent, span } from './batch';
import type { Answered, Kind, ReportedBatch, ShownPlan } from './batch';
import type { Arm } from '../state/reported';

export function WorstPlans(report: ReportedBatch) {
  const { figures } = report;
  if (KINDS.every((kind) => figures.worst[kind].length === 0)) return null;
  return (
    <section class="panel">
      <h2>{texts.batchReport.worst}</h2>
      <p class="hint">{texts.batchReport.indices}</p>
      <div class="columns">
        {KINDS.map((kind) => (
          <Listed key={kind} kind={kind} {...report} />
        ))}
      </div>
      <p class="hint">{texts.batchReport.graphs}</p>
    </section>
  );
}

function Listed({ kind, figures, plans, problems, arms }: { kind: Kind } & ReportedBatch) {
  return (
    <section>
      <h3>{texts.batchReport.kinds[kind]}</h3>
      <ol class="worst">
        {figures.worst[kind].map((item) => {
          const shown = plans[item.position];
          return (
            <li key={item.position}>
              {shown ? (
                <button type="button" aria-pressed={chosen.value === item.position} onClick={() => goTo(item.position)}>
                  <Facts item={item} />
                  <Graph index={item.position} shown={shown} arm={arms[shown.arm]!} />
                </button>
              ) : (
                <div>
                  <Facts item={item} />
                  <small>{item.outcome === 'planned' ? texts.batchReport.tooLarge : (problems[item.position] ?? item.outcome)}</small>
                </div>
              )}
            </li>
          );
        })}
      </ol>
    </section>
  );
}

function goTo(index: number): void {
  choose(index);
  requestAnimationFrame(() => document.getElementById('chosen')?.scrollIntoView({ behavior: 'smooth' }));
}

function Facts({ item }: { item: Answered }) {
  const { position, duration, ratio, seconds: computing } = item;
  const words = texts.batchReport;
  return (
    <span class="facts">
      <strong>{words.request(position)}</strong>
      {duration !== null && <span>{words.lasts(seconds(duration))}</span>}
      {ratio !== null && <span>{words.uses(percent(ratio))}</span>}
      {computing !== null && <span>{words.took(span(computing))}</span>}
    </span>
  );
}

const [WIDTH, HEIGHT, TOP] = [150, 64, 110]; // points, points, percent of a limit

function Graph({ index, shown, arm }: { index: number; shown: ShownPlan; arm: Arm }) {
  const curves = useMemo(() => curvesOf({ ...shown.plan, took: 0 }, arm.robot, 'velocity', null, true), [shown, arm]);
  if (!curves) return null;
  const last = curves.time.at(-1) || 1;
  const y = (percentage: number): number => HEIGHT * (0.5 - percentage / (2 * TOP));
  return (
    <svg class="small-graph" viewBox={`0 0 ${WIDTH} ${HEIGHT}`} role="img" aria-label={texts.batchReport.graph(index)}>
      {[-100, 100].map((limit) => (
        <line key={limit} class="limit" x1="0" x2={WIDTH} y1={y(limit)} y2={y(limit)} />
      ))}
      <line x1="0" x2={WIDTH} y1={y(0)} y2={y(0)} />
      {curves.curves.map(({ label, colour, values }) => {
        const points = values.flatMap((value, row) =>
          value === null ? [] : [`${((WIDTH * curves.time[row]!) / last).toFixed(1)},${y(value).toFixed(1)}`],
        );
        return <polyline key={label} points={points.join(' ')} stroke={colour} />;
      })}
    </svg>
  );
}
