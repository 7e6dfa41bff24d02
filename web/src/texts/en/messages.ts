// Messages of the service: they are English, so that this language needs none of its own.
export interface Said {
  title: string;
  cause: string;
  remedy: string;
}

export interface Figures {
  joint: string | null;
  quantity: string | null;
  value: string;
  limit: string;
}

export const ofMessages = {
  messages: {
    original: 'Original text',
    refusals: {} as Record<string, Said>, // by code; in place of the service's own title and detail
    figures: {} as Record<string, (figures: Figures) => string>, // by code
    enclosed: (names: readonly string[]) => `Enclosed by ${names.join(', ')}.`,
    searched: (checks: number) => `The search checked ${checks} motions.`,
    fields: 'Fields at fault:',
    warnings: {} as Record<string, string>, // by code; in place of the service's own message
    findings: {} as Record<string, string>, // of robots, likewise
    likewise: (names: readonly string[]) => `(likewise ${names.join(', ')})`,
    // Of path files: the service's sentences, and what is shown instead, made from their groups.
    notes: [] as readonly (readonly [RegExp, (...groups: string[]) => string])[],
    robotNotes: {} as Record<string, string>, // of the catalogue, by the catalogue's own sentence
    // Words for fields and values of a change; others are those of the request.
    words: { tcp: 'tool', ik: 'inverse kinematics', null: 'none', true: 'yes', false: 'no' } as Record<string, string>,
  },
};
