// Options of goal sets: each edit returns the changed fields of the waypoint.
import type { GoalSet } from '../service/types';

export function withoutOption({ options }: GoalSet, index: number): Partial<GoalSet> {
  return { options: options.toSpliced(index, 1) };
}

export function optionChosen({ options }: GoalSet, index: number): Partial<GoalSet> {
  return { options: [options[index]!] };
}
