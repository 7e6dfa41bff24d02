// The examples of the documents, loaded when they are chosen.
import type { PlanRequest } from '../service/types';

const FILES = import.meta.glob<PlanRequest>(['../../../examples/*.json', '../../../examples/jobs/*.json'], {
  import: 'default',
});

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
