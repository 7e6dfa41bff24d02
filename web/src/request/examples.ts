// The examples of the documents, loaded when they are chosen.
import type { PlanRequest, RobotUpload } from '../service/types';

const FILES = import.meta.glob<PlanRequest>(['../../../examples/*.json', '../../../examples/jobs/*.json'], {
  import: 'default',
});

// The robots of examples that no catalogue has, by their ids: bodies of POST /v1/robots.
const ROBOTS = import.meta.glob<RobotUpload>('../../../examples/robots/*.json', { import: 'default' });

// The body that adds the robot of an example; null: the examples have none of that id.
export async function exampleRobot(id: string): Promise<RobotUpload | null> {
  return (await ROBOTS[`../../../examples/robots/${id}.json`]?.()) ?? null;
}

export interface Example {
  name: string;
  group: 'documents' | 'features' | 'jobs';
  load: () => Promise<PlanRequest>;
}

const OF_DOCUMENTS = /^(refuelling|welding|three_joint_arm|date_sorting)/;

export const EXAMPLES: readonly Example[] = Object.entries(FILES).map(([path, load]) => {
  const name = path.replace(/^.*\//, '').replace('.json', '');
  const group = path.includes('/jobs/') ? 'jobs' : OF_DOCUMENTS.test(name) ? 'documents' : 'features';
  return { name, group, load };
});

export const FIRST_EXAMPLE = 'refuelling_case_1_poses';
