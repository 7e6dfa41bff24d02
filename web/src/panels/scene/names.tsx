// Names of things in a scene: that of the chosen one, and choices among links and objects.
import { useEffect, useState } from 'preact/hooks';
import type { Robot } from '../../service/types';
import { renameObject } from '../../state/scene_editing';
import { texts } from '../../texts';
import { Choice, TextField } from '../fields';

export function NameOfThing({ id }: { id: string }) {
  const [taken, setTaken] = useState<string | null>(null);
  useEffect(() => setTaken(null), [id]);
  return (
    <>
      <TextField
        key={`${id} ${taken ?? ''}`}
        label={texts.fields.name}
        value={id}
        onValue={(name) => setTaken(name === id || renameObject(id, name) ? null : name)}
      />
      {taken !== null && (
        <p class="wrong-text" role="alert">
          {texts.scene.taken(taken)}
        </p>
      )}
    </>
  );
}

const WORLD = 'universe'; // Pinocchio's name of the world, which is no link

export function linksOf({ frames }: Robot): string[] {
  return frames.filter((name) => name !== WORLD);
}

interface ChoiceProps {
  label: string;
  names: readonly string[];
  value?: string;
  onValue: (name: string) => void;
}

// One of these names; none is chosen at first.
export function NameChoice({ label, names, value = '', onValue }: ChoiceProps) {
  const options = [['', texts.scene.choose] as const, ...names.map((name) => [name, name] as const)];
  return <Choice label={label} value={value} options={options} onValue={onValue} />;
}

interface NamedProps {
  text: string;
  onRemove: () => void;
}

// A row of a list, which may be taken away.
export function Removable({ text, onRemove }: NamedProps) {
  return (
    <li>
      {text}
      <button type="button" class="remove" aria-label={texts.fields.remove(text)} title={texts.fields.remove(text)} onClick={onRemove}>
        ✕
      </button>
    </li>
  );
}
