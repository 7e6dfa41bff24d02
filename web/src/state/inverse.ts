// The ways in which the tool gets to a pose, as the service has them: those at which nothing is in the way come first.
import { toolAt } from '../plan/tools';
import { surroundingsOf } from '../request/surroundings';
import { client, outcome } from '../service/client';
import type { Outcome } from '../service/client';
import type { InverseKinematicsResult, PlanRequest, Pose, PositionCollision, Robot } from '../service/types';
import { scene } from './surroundings';

// Asks about a pose of the tool at a waypoint, in the base frame; ways are sorted by their distance to the reference, too.
export async function waysTo(
  pose: Pose,
  request: PlanRequest,
  index: number,
  robot: Robot,
  reference: readonly number[] | undefined,
): Promise<Outcome<InverseKinematicsResult>> {
  const body = {
    robot: robot.id,
    poses: [pose],
    solutions: 'all' as const,
    reference: reference && [...reference],
    tool: toolAt(request, index),
    ...surroundingsOf(request, scene.value ?? null, index, robot),
  };
  const { answer, problem } = await outcome(client.POST('/v1/kinematics/inverse', { body }));
  return answer ? { answer: answer.results[0]! } : { problem };
}

// What is in the way at a joint position; null: nothing is known to be.
export async function hindranceAt(
  position: readonly number[],
  request: PlanRequest,
  index: number,
  robot: Robot,
): Promise<PositionCollision | null> {
  const body = {
    robot: robot.id,
    positions: [[...position]],
    tool: toolAt(request, index),
    ...surroundingsOf(request, scene.value ?? null, index, robot),
  };
  const { answer } = await outcome(client.POST('/v1/collisions/check', { body }));
  const found = answer?.results[0]?.collision;
  return found ? { pair: found.pair, depth: found.depth ?? 0 } : null;
}
