// A path from a CSV, G-code or DXF file: its options and what it comes to, before it is added.
import { noteOf } from '../request/messages';
import { extentOf } from '../request/paths';
import { decimal, shownIn, written } from '../plan/units';
import {
  closePath,
  isReading,
  missed,
  openPath,
  pathFile,
  pathOptions,
  pathProblem,
  setPathOptions,
  shownPath,
  takePath,
} from '../state/path_import';
import { texts } from '../texts';
import { Choice, NumberField } from './fields';
import { Original, ProblemText } from './Message';
import { More } from './MoreFields';
import { PoseFields } from './PoseFields';

const SUFFIXES = '.csv,.nc,.ngc,.gcode,.gc,.tap,.cnc,.dxf';
const UNITS = ['', 'mm', 'm', 'inch'] as const;
const MOST_NAMED = 8; // waypoints out of reach

export function PathImport() {
  return (
    <More label={texts.path.label} onClose={closePath}>
      {() => (
        <>
          <label class="file">
            {texts.path.file}
            <input
              type="file"
              accept={SUFFIXES}
              onChange={(event) => {
                const input = event.currentTarget;
                const [file] = input.files ?? [];
                if (file) void openPath(file).then(() => (input.value = ''));
              }}
            />
          </label>
          {pathFile.value && <Options name={pathFile.value.name} />}
          {pathProblem.value && (
            <div class="wrong-text" role="alert">
              <ProblemText problem={pathProblem.value} />
              {pathProblem.value.errors?.map(({ message }) => (
                <p key={message} lang="en">
                  {message}
                </p>
              ))}
            </div>
          )}
          {isReading.value && <p class="hint">{texts.workspace.asking}</p>}
          {shownPath.value && <Preview />}
        </>
      )}
    </More>
  );
}

function Options({ name }: { name: string }) {
  const { units, angle, blend, lift, at } = pathOptions.value;
  const set = (changes: Parameters<typeof setPathOptions>[0]): void => void setPathOptions(changes);
  return (
    <fieldset class="group">
      <legend>{name}</legend>
      <Choice
        label={texts.path.units}
        value={units ?? ''}
        options={UNITS.map((one) => [one, one === '' ? texts.path.ofFile : one] as const)}
        onValue={(next) => set({ units: next || null })}
      />
      {/\.csv$/i.test(name) && (
        <Choice
          label={texts.path.angle}
          value={angle}
          options={[['deg', '°'] as const, ['rad', 'rad'] as const]}
          onValue={(next) => set({ angle: next })}
        />
      )}
      <NumberField
        label={texts.path.blend}
        unit="m"
        value={blend}
        placeholder={texts.editor.none}
        min={0}
        onValue={(next) => set({ blend: next || null })}
      />
      {/\.dxf$/i.test(name) && (
        <NumberField label={texts.path.lift} unit="m" value={lift} min={0} onValue={(next) => set({ lift: next ?? 0 })} />
      )}
      <PoseFields pose={at} onPose={(next) => set({ at: next })} />
    </fieldset>
  );
}

function Preview() {
  const { waypoints, notes, line, poses } = shownPath.value!;
  const extent = extentOf(line);
  const [lost, said] = [missed.value, notes.map(noteOf)];
  return (
    <section class="preview" aria-label={texts.path.preview}>
      <p>
        <strong>{texts.path.count(waypoints.length)}</strong>
        {extent && (
          <>
            {', '}
            {texts.path.extent(sizeOf(extent.from, extent.to))}
          </>
        )}
      </p>
      {extent && <p class="hint">{texts.path.place(pointOf(extent.from), pointOf(extent.to))}</p>}
      {lost && poses.length > 0 && (
        <p class={lost.length > 0 ? 'wrong-text' : 'hint'}>
          {texts.path.missed(lost.length, lost.slice(0, MOST_NAMED).join(', ') + (lost.length > MOST_NAMED ? ' …' : ''))}
        </p>
      )}
      {said.length > 0 && (
        <ul class="warnings">
          {said.map(({ text }) => (
            <li key={text}>{text}</li>
          ))}
        </ul>
      )}
      <Original texts={said.flatMap(({ original }) => original ?? [])} />
      <div class="buttons wrap">
        <button type="button" class="primary" onClick={() => takePath(false)}>
          {texts.path.replace}
        </button>
        <button type="button" onClick={() => takePath(true)}>
          {texts.path.add}
        </button>
        <button type="button" onClick={closePath}>
          {texts.path.cancel}
        </button>
      </div>
    </section>
  );
}

function sizeOf(from: readonly number[], to: readonly number[]): string {
  return `${to.map((value, axis) => decimal(value - from[axis]!, 'm')).join(' × ')} ${shownIn('m').name}`;
}

function pointOf(point: readonly number[]): string {
  return point.map((value) => written(value, 'm')).join(', ');
}
