// The request that is shown, sent with some of its fields varied.
import { signal } from '@preact/signals';
import { gridOf, sizeOf } from '../request/grid';
import type { Varied } from '../request/grid';
import { sendGrid } from '../state/batches';
import { request } from '../state/store';
import { texts } from '../texts';

const FIELDS = ['/limits/velocity_scale', '/limits/acceleration_scale', '/backend/kind', '/payload/mass', '/waypoints/1/duration'];
const FIRST: Varied = { pointer: FIELDS[0]!, values: '0.25, 0.5, 0.75, 1' };

const rows = signal<readonly Varied[]>([FIRST]);

export function BatchGrid() {
  const size = sizeOf(rows.value);
  const wrong = request.value && size !== null ? gridOf(request.value, rows.value).wrong : undefined;
  const change = (index: number, changes: Partial<Varied>): void => {
    rows.value = rows.value.map((row, i) => (i === index ? { ...row, ...changes } : row));
  };
  return (
    <section class="grid" aria-label={texts.batch.grid}>
      <h3>{texts.batch.grid}</h3>
      <datalist id="fields">
        {FIELDS.map((field) => (
          <option key={field} value={field} />
        ))}
      </datalist>
      {rows.value.map(({ pointer, values }, index) => (
        <div key={index} class="varied">
          <label>
            {texts.batch.field}{' '}
            <input list="fields" value={pointer} onInput={(event) => change(index, { pointer: event.currentTarget.value })} />
          </label>
          <label>
            {texts.batch.values} <input value={values} onInput={(event) => change(index, { values: event.currentTarget.value })} />
          </label>
          <button
            type="button"
            aria-label={texts.batch.remove(index + 1)}
            disabled={rows.value.length === 1}
            onClick={() => (rows.value = rows.value.filter((_, i) => i !== index))}
          >
            ✕
          </button>
        </div>
      ))}
      {wrong !== undefined && (
        <p class="wrong-text" role="alert">
          {texts.batch.noField(wrong)}
        </p>
      )}
      <div class="buttons wrap">
        <button
          type="button"
          onClick={() => (rows.value = [...rows.value, { pointer: FIELDS[rows.value.length % FIELDS.length]!, values: '' }])}
        >
          {texts.batch.another}
        </button>
        <button
          type="button"
          class="primary"
          disabled={size === null || wrong !== undefined || !request.value}
          onClick={() => void sendGrid(rows.value)}
        >
          {size === null ? texts.batch.unreadable : texts.batch.send(size)}
        </button>
      </div>
    </section>
  );
}
