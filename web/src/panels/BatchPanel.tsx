// Batches: one is sent as a grid or opened by its id, and seen while it is planned.
import { useEffect } from 'preact/hooks';
import { seconds, short } from '../plan/units';
import { messageOf } from '../request/messages';
import { apiKey, base } from '../service/client';
import type { Batch } from '../service/types';
import { batches, batchProblem, cancelBatch, fileOf, listBatches, openBatch, reasons, shownBatch } from '../state/batches';
import type { BatchFile } from '../state/batches';
import { texts } from '../texts';
import { BatchGrid } from './BatchGrid';
import { equalParts, Histogram } from './Histogram';
import { ProblemText } from './Message';
import { save } from './save';

export function BatchPanel() {
  useEffect(() => void listBatches(), []);
  return (
    <>
      {batchProblem.value && (
        <div class="refusal" role="alert" aria-label={texts.batch.refused}>
          <strong>{messageOf(batchProblem.value).title}</strong>
          <ProblemText problem={batchProblem.value} />
        </div>
      )}
      {shownBatch.value && <BatchView shown={shownBatch.value} />}
      <BatchGrid />
      <OpenBatch />
    </>
  );
}

function OpenBatch() {
  return (
    <form
      class="open-batch"
      onSubmit={(event) => {
        event.preventDefault();
        void openBatch((new FormData(event.currentTarget).get('id') as string).trim());
      }}
    >
      <label>
        {texts.batch.id} <input name="id" list="batches" autocomplete="off" required />
      </label>
      <datalist id="batches">
        {batches.value.map(({ id, status, total }) => (
          <option key={id} value={id}>
            {texts.batch.entry(total, texts.batch.status[status])}
          </option>
        ))}
      </datalist>
      <button type="submit">{texts.batch.open}</button>
    </form>
  );
}

function BatchView({ shown }: { shown: Batch }) {
  const { id, status, counts, rate, remaining_time, summary } = shown;
  const done = counts.total - counts.waiting;
  return (
    <section class="batch" aria-label={texts.batch.shown}>
      <p class="batch-head">
        <strong>{texts.batch.status[status]}</strong> <code>{id}</code>
      </p>
      <progress max={counts.total} value={done} aria-label={texts.batch.progress} />
      <p role="status">{texts.batch.counts(counts.planned, counts.refused, counts.total)}</p>
      {rate !== null && <p class="hint">{texts.batch.rate(short(rate, 3), remaining_time === null ? null : seconds(remaining_time))}</p>}
      {summary.duration && <Durations {...summary.duration} />}
      {summary.worst_ratio !== null && <p class="hint">{texts.batch.worst(short(100 * summary.worst_ratio, 4))}</p>}
      {summary.refusals.length > 0 && (
        <>
          <h3>{texts.batch.failures}</h3>
          <ul class="failures">
            {summary.refusals.map(({ code, count, example }) => (
              <li key={code}>
                <strong>
                  {count} × <code>{code}</code>
                </strong>
                {reasons.value[code] && <small>{texts.batch.reason(example, reasons.value[code])}</small>}
              </li>
            ))}
          </ul>
        </>
      )}
      <div class="buttons wrap">
        {status === 'running' ? (
          <button type="button" onClick={() => void cancelBatch(id)}>
            {texts.batch.cancel}
          </button>
        ) : (
          <FileLink id={id} file="results.zip" name={`${id}.zip`} text={texts.batch.results} />
        )}
        <FileLink id={id} file="report" name={`${id}.html`} text={texts.batch.report} />
      </div>
    </section>
  );
}

// A link is saved as it comes, however large; where an API key is asked for, the page fetches the file with it.
function FileLink({ id, file, name, text }: { id: string; file: BatchFile; name: string; text: string }) {
  const fetched = async (): Promise<void> => {
    const content = await fileOf(id, file);
    if (content) save(name, content);
  };
  return (
    <a
      href={`${base}/v1/batches/${id}/${file}`}
      download={name}
      onClick={(event) => {
        if (apiKey.value === '') return;
        event.preventDefault();
        void fetched();
      }}
    >
      {text}
    </a>
  );
}

function Durations({ shortest, mean, longest, histogram }: NonNullable<Batch['summary']['duration']>) {
  return (
    <Histogram
      title={texts.batch.durations}
      label={texts.batch.histogram(seconds(shortest), seconds(mean), seconds(longest))}
      written={seconds}
      least={shortest}
      mean={mean}
      most={longest}
      edges={equalParts(shortest, longest, histogram.length)}
      counts={histogram}
    />
  );
}
