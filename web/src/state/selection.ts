// The waypoint that is chosen.
import { selected } from './store';

export function select(index: number): void {
  selected.value = index;
}
