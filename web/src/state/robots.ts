// The robots that the service has.
import { exampleRobot } from '../request/examples';
import { client, outcome } from '../service/client';
import type { Outcome } from '../service/client';
import type { Problem, RobotSummary } from '../service/types';
import { robots } from './store';

export async function loadRobots(): Promise<Outcome<RobotSummary[]>> {
  const { answer, problem } = await outcome(client.GET('/v1/robots', { params: { query: { limit: 1000 } } }));
  if (!answer) return { problem };
  robots.value = answer.robots;
  return { answer: answer.robots };
}

// Adds the robot of an example unless the service has it; null: there was nothing to add.
export async function addExampleRobot(id: string): Promise<Problem | 'added' | null> {
  if (robots.value.some((known) => known.id === id)) return null;
  const body = await exampleRobot(id).catch(() => null);
  if (!body) return null;
  const { problem } = await outcome(client.POST('/v1/robots', { body }));
  if (problem) return problem.status === 409 ? null : problem; // 409: somebody else has added it
  await loadRobots();
  return 'added';
}
