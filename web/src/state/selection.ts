// The waypoint that is chosen. The time stands at it, also after the next plans, until a person seeks or plays.
import { goTo, isAnchored, playing } from './playback';
import { chosenObject, selected } from './store';

export function select(index: number): void {
  selected.value = index;
  chosenObject.value = null;
  playing.value = false;
  isAnchored.value = true;
  goTo(index);
}
