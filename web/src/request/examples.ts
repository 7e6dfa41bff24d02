// The examples of the documents, loaded when they are chosen.
import type { CellRequest, OrderRequest, PlanRequest, RobotUpload } from '../service/types';
import { shownOf } from './cells';

const FILES = import.meta.glob<PlanRequest>(['../../../examples/*.json', '../../../examples/jobs/*.json'], {
  import: 'default',
});

const CELLS = import.meta.glob<CellRequest>('../../../examples/cell/*.json', { import: 'default' });

const TASKS = import.meta.glob<OrderRequest>('../../../examples/tasks/*.json', { import: 'default' });

// The robots of examples that no catalogue has, by their ids: bodies of POST /v1/robots.
const ROBOTS = import.meta.glob<RobotUpload>('../../../examples/robots/*.json', { import: 'default' });

// The body that adds the robot of an example; null: the examples have none of that id.
export async function exampleRobot(id: string): Promise<RobotUpload | null> {
  return (await ROBOTS[`../../../examples/robots/${id}.json`]?.()) ?? null;
}

export interface Example {
  name: string;
  group: 'documents' | 'features' | 'jobs' | 'cells';
  load: () => Promise<PlanRequest>;
}

const OF_DOCUMENTS = /^(refuelling|welding|three_joint_arm|date_sorting)/;

const OF_REQUESTS = Object.entries(FILES).map(([path, load]): Example => {
  const name = nameOf(path);
  const group = path.includes('/jobs/') ? 'jobs' : OF_DOCUMENTS.test(name) ? 'documents' : 'features';
  return { name, group, load };
});

const OF_CELLS = Object.entries(CELLS).map(([path, load]): Example => {
  return { name: nameOf(path), group: 'cells', load: async () => shownOf(await load(), 0) };
});

export const EXAMPLES: readonly Example[] = [...OF_REQUESTS, ...OF_CELLS];

// Tasks in any order, which the service puts in order.
export const TASK_EXAMPLES = Object.entries(TASKS).map(([path, load]) => ({ name: nameOf(path), load }));

function nameOf(path: string): string {
  return path.replace(/^.*\//, '').replace('.json', '');
}

export const FIRST_EXAMPLE = 'refuelling_case_1_poses';
