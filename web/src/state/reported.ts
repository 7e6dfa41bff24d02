// The plan that a report shows.
import { batch } from '@preact/signals';
import type { LinkShape, PlanAnswer, PlanRequest, Robot } from '../service/types';
import { playing, time } from './playback';
import { links, plan, request, robot } from './store';

export interface AskedPlan {
  request: PlanRequest;
  answer: PlanAnswer;
}

export interface Arm {
  robot: Robot;
  links: readonly LinkShape[];
}

// Makes a plan the one that is shown.
export function showPlan(asked: AskedPlan, arm: Arm): void {
  if (plan.peek()?.answer === asked.answer) return;
  batch(() => {
    playing.value = false;
    time.value = 0;
    links.value = arm.links;
    robot.value = arm.robot;
    request.value = asked.request;
    plan.value = { request: asked.request, answer: asked.answer, took: 0 };
  });
}
