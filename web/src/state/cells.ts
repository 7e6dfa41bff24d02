// The cell that is shown: which of its robots is edited, and where the others are.
import { batch, computed } from '@preact/signals';
import { robotsOf, showing, withWaits } from '../request/cells';
import type { CellAnswer, PlanAnswer, PlanRequest } from '../service/types';
import { settle } from './actions';
import { describe, described, describedRobot } from './described';
import { isAnchored } from './playback';
import { chosenObject, compared, isStale, links, plan, planning, problem, request, robot, selected, shownPlan } from './store';

// Shows another robot of the cell: what is planned is the same.
export function chooseRobotOfCell(index: number): void {
  const shown = request.value;
  if (!shown?.cell || shown.cell.index === index) return;
  const next = showing(shown, index);
  const [before, isCurrent] = [plan.value, problem.value !== null || (!isStale.value && !planning.value)];
  batch(() => {
    selected.value = 0;
    chosenObject.value = null;
    isAnchored.value = false;
    compared.value = null;
    const own = before?.cell?.robots[index]?.plan;
    if (before && own) plan.value = { ...before, answer: own, request: before.request === shown ? next : showing(before.request, index) };
    request.value = next;
    const arm = describedRobot(next.robot);
    if (arm && arm !== robot.value) {
      robot.value = arm;
      links.value = arm.geometry?.length ? [] : (described.value.get(arm.id)?.links ?? []);
    }
  });
  if (!isCurrent || robot.value?.id !== next.robot) void settle();
  else void describe(next.cell!.others.map((other) => other.robot));
}

// A robot of the cell, as it is planned if it is.
export interface RobotOfCell {
  index: number;
  request: PlanRequest;
  answer: PlanAnswer | null;
}

const members = computed((): readonly RobotOfCell[] => {
  if (!request.value?.cell) return [];
  const planned = plan.value?.cell?.robots ?? [];
  return robotsOf(request.value).map((own, index) => {
    const answer = planned[index]?.plan;
    return { index, request: own, answer: answer?.robot === own.robot ? answer : null };
  });
});

export const others = computed(() => members.value.filter(({ index }) => index !== request.value?.cell?.index));

// What is said of the cell as it is planned; null: it has changed since, or has no plan.
export const currentCell = computed<CellAnswer | null>(() => (isStale.value ? null : (shownPlan.value?.cell ?? null)));

// When all robots of a meeting have arrived, by the index of the waypoint of one robot.
export function meetingsOf(cell: CellAnswer | undefined, name: string): ReadonlyMap<number, number> {
  return new Map((cell?.meetings ?? []).flatMap(({ waypoints, time }) => (name in waypoints ? [[waypoints[name]!, time] as const] : [])));
}

// The request that is written as files: of a robot of a cell it has the waits. Null: the cell is not planned.
export function exportedRequest(): PlanRequest | null {
  const shown = request.value;
  if (!shown?.cell) return shown;
  const own = currentCell.value?.robots[shown.cell.index];
  return own ? withWaits(shown, own.waits) : null;
}
