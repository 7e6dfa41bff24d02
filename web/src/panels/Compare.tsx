// Several back ends side by side; their paths are ghosts on the stage.
import { short, shownIn, withUnit } from '../plan/units';
import { jointColour } from '../plots/colours';
import { messageOf } from '../request/messages';
import { chooseBackend } from '../state/actions';
import { compare } from '../state/planning';
import { compared, comparing, request } from '../state/store';
import type { Compared } from '../state/store';
import { texts } from '../texts';

export function Compare() {
  return (
    <>
      <button type="button" class="primary" disabled={comparing.value || !request.value} onClick={() => void compare()}>
        {comparing.value ? texts.compare.running : texts.compare.start}
      </button>
      {request.value?.cell && <p class="hint">{texts.cells.compared(request.value.cell.name)}</p>}
      {compared.value && (
        <>
          <table class="compare">
            <thead>
              <tr>
                <th scope="col">{texts.compare.backend}</th>
                <th scope="col">{texts.compare.duration}</th>
                <th scope="col">{texts.compare.effort}</th>
                <th scope="col">{texts.compare.power}</th>
                <th scope="col">{texts.compare.energy}</th>
                <th scope="col">{texts.compare.jerk}</th>
                <th scope="col">{withUnit(texts.compare.deviation, 'm')}</th>
                <th scope="col">{texts.compare.took}</th>
              </tr>
            </thead>
            <tbody>
              {compared.value.map((entry, index) => (
                <Entry key={entry.backend} entry={entry} index={index} />
              ))}
            </tbody>
          </table>
          <p class="hint">{texts.compare.hint}</p>
        </>
      )}
    </>
  );
}

function Entry({ entry, index }: { entry: Compared; index: number }) {
  const { backend, duration, mean_effort, peak_jerk, jerk_is_bounded, path_deviation, problem, took } = entry;
  const { peak_power, mechanical_energy } = entry;
  return (
    <tr>
      <th scope="row">
        <span class="swatch" style={{ background: jointColour(index) }} />{' '}
        <button type="button" aria-label={`${texts.compare.use} ${backend}`} onClick={() => chooseBackend(backend)}>
          {backend}
        </button>
      </th>
      {problem ? (
        <td colSpan={7}>{messageOf(problem).title}</td>
      ) : (
        <>
          <td class="number">{figure(duration, 4)}</td>
          <td class="number">{figure(mean_effort)}</td>
          <td class="number">{figure(peak_power)}</td>
          <td class="number">{figure(mechanical_energy)}</td>
          <td class="number">{jerk_is_bounded === false ? <abbr title={texts.result.unbounded}>∞</abbr> : figure(peak_jerk)}</td>
          <td class="number">{figure(path_deviation === null ? null : path_deviation * shownIn('m').factor)}</td>
          <td class="number">{figure(took === null ? null : Math.round(took * 1000), 6)}</td>
        </>
      )}
    </tr>
  );
}

function figure(value: number | null, digits = 3): string {
  return value === null ? '–' : short(value, digits);
}
