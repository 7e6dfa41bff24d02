// Where the tool can be, asked of the service while somebody wants to see it.
import { computed, effect, signal } from '@preact/signals';
import { client, outcome } from '../service/client';
import type { Outcome } from '../service/client';
import type { WorkspaceAnswer } from '../service/types';
import { playing } from './playback';
import { request, robot } from './store';
import { shownTool } from './surroundings';

const POINTS = 8000;

export const isShown = signal(false);
export const isCut = signal(true); // open towards the viewer

export function showWorkspace(isWanted: boolean): void {
  isShown.value = isWanted;
}

export function cutWorkspace(isWanted: boolean): void {
  isCut.value = isWanted;
}

const found = signal<{ robot: string; asked: string; outcome: Outcome<WorkspaceAnswer> } | null>(null);

// Of the robot and the tool that are shown; a text, which is equal while they are.
const asked = computed(() =>
  robot.value && request.value?.robot === robot.value.id ? JSON.stringify({ robot: robot.value.id, tool: shownTool.value }) : null,
);

// What the service says of the robot that is shown; null: it has not been asked, or has not answered yet.
export const workspace = computed(() =>
  isShown.value && found.value && found.value.robot === robot.value?.id ? found.value.outcome : null,
);

// Asks for another robot or tool; while a motion is played, nothing is asked. A report, which has no service, does without.
export function followWorkspace(): void {
  effect(() => {
    const subject = asked.value;
    if (isShown.value && !playing.value && subject !== null && subject !== found.peek()?.asked) void ask(subject);
  });
}

// The answer of a call that asks for JSON, of all the forms that the document lists.
type AsJson<T> = T extends Promise<infer R> ? Promise<Omit<R, 'data'> & { data?: WorkspaceAnswer }> : never;

async function ask(subject: string): Promise<void> {
  const { robot: id, tool } = JSON.parse(subject) as Pick<NonNullable<typeof request.value>, 'robot' | 'tool'>;
  const call = client.POST('/v1/kinematics/workspace', { body: { robot: id, tool, samples: POINTS } });
  const answered = await outcome(call as AsJson<typeof call>);
  if (asked.value === subject) found.value = { robot: id, asked: subject, outcome: answered };
}
