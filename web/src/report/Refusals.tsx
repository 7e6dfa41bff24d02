// How many requests were refused for which reason, with examples.
import { texts } from '../texts';
import { percent } from './batch';
import type { ReportedBatch } from './batch';

export function Refusals({ batch, figures, problems }: ReportedBatch) {
  const { refusals } = batch.summary;
  if (refusals.length === 0) return null;
  const answered = batch.counts.total - batch.counts.waiting;
  const ordered = refusals.toSorted((one, other) => other.count - one.count);
  return (
    <section class="panel">
      <h2>{texts.batchReport.refusals}</h2>
      <div class="wide-table" tabIndex={0}>
        <table class="refusals">
          <thead>
            <tr>
              <th scope="col">{texts.batchReport.code}</th>
              <th scope="col" class="number">
                {texts.batchReport.count}
              </th>
              <th scope="col" class="number">
                {texts.batchReport.share}
              </th>
              <th scope="col">{texts.batchReport.examples}</th>
            </tr>
          </thead>
          <tbody>
            {ordered.map(({ code, count }) => (
              <tr key={code}>
                <th scope="row">
                  <code>{code}</code>
                </th>
                <td class="number">{count}</td>
                <td class="number">{percent(count / answered)}</td>
                <td>
                  <ul>
                    {(figures.examples[code] ?? []).map(({ position }) => (
                      <li key={position}>
                        <strong>{position}</strong> {problems[position] ?? texts.batchReport.tooLarge}
                      </li>
                    ))}
                  </ul>
                </td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </section>
  );
}
