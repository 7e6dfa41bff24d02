// A planning that takes long: how long it has taken, and a button that ends it.
import { cancelPlanning } from '../state/planning';
import { waited } from '../state/store';
import { texts } from '../texts';

const LONG = 2; // s

export function Waiting() {
  if (waited.value < LONG) return null;
  return (
    <div class="waiting">
      <span>{texts.header.waited(waited.value)}</span>
      <button type="button" onClick={cancelPlanning}>
        {texts.header.cancel}
      </button>
    </div>
  );
}
