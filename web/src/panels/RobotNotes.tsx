// What a user of a robot should know: as a list where the robot is chosen, as a hint by the plan.
import { robotNoteOf } from '../request/messages';
import type { Robot } from '../service/types';
import { texts } from '../texts';

export function RobotNotes({ arm }: { arm: Robot }) {
  const unlimited = unlimitedJoints(arm);
  const notes = arm.notes ?? []; // of the catalogue
  if (!unlimited && notes.length === 0) return null;
  return (
    <details class="robot-notes">
      <summary>{texts.robot.notes(notes.length + (unlimited ? 1 : 0))}</summary>
      <ul>
        {unlimited && <li>{unlimited}</li>}
        {notes.map((note) => (
          <RobotNote key={note} note={note} />
        ))}
      </ul>
    </details>
  );
}

// A sentence of the catalogue in the language of the page, else in English.
export function RobotNote({ note }: { note: string }) {
  const { text, original } = robotNoteOf(note);
  return <li lang={original === null ? 'en' : undefined}>{text}</li>;
}

export function RobotHint({ arm, onNotes }: { arm: Robot; onNotes: () => void }) {
  const [unlimited, count] = [unlimitedJoints(arm), arm.notes?.length ?? 0];
  if (!unlimited && count === 0) return null;
  return (
    <p class="hint">
      {unlimited}{' '}
      {count > 0 && (
        <button type="button" class="link" onClick={onNotes}>
          {texts.robot.readNotes(arm.id, count)}
        </button>
      )}
    </p>
  );
}

// Which joints no position limit holds; null: each has limits.
function unlimitedJoints({ joints }: Robot): string | null {
  const names = joints.filter(({ lower, upper }) => lower === null && upper === null).map(({ name }) => name);
  return names.length === 0 ? null : texts.robot.unlimited(names, names.length === joints.length);
}
