// Plans, meets a problem, fetches a file and runs a batch with the generated client; prints what came of it.
import { createBatch, exportTrajectory, getBatch, getBatchResults, planTrajectory } from './planner_client';
import type { PlanRequest } from './planner_client';
import { client } from './planner_client/client.gen';

const request = (robot: string): PlanRequest => ({
  robot,
  waypoints: [
    { kind: 'joint', position: [0.1, 0.2, 0.3] },
    { kind: 'joint', position: [0.3, 0.1, 0.5] },
  ],
  backend: { kind: 'quintic' },
});

const present = <T>(value: T | undefined): T => {
  if (value === undefined) throw new Error('there is no answer');
  return value;
};

const main = async (url: string): Promise<void> => {
  client.setConfig({ baseUrl: url });
  const plan = present((await planTrajectory({ body: request('three_dof_arm') })).data);
  const problem = present((await planTrajectory({ body: request('nobody') })).error);
  const file = present(
    (await exportTrajectory({ body: request('three_dof_arm'), query: { format: 'csv' }, parseAs: 'blob' })).data,
  );
  const requests = [request('three_dof_arm'), request('nobody')];
  let batch = present((await createBatch({ body: { requests } })).data);
  while (batch.status === 'running') {
    await new Promise((resolve) => setTimeout(resolve, 100));
    batch = present((await getBatch({ path: { id: batch.id } })).data);
  }
  const results = present((await getBatchResults({ path: { id: batch.id } })).data);
  const lines = (await file.text()).trimEnd().split('\r\n').length;
  const statuses: string[] = results.results.map((result) => result.status);
  console.log(JSON.stringify({ duration: plan.duration, code: problem.code, lines, batch: statuses }));
};

void main(process.argv[2] ?? '');
