// What came out: certificate, refusals, comparisons, files.
export const ofResult = {
  result: {
    label: 'Result',
    tabs: { certificate: 'Certificate', compare: 'Compare', request: 'Request', exports: 'Exports', robot: 'Robot', batch: 'Batch' },
    none: 'Nothing is planned yet.',
    certified: (duration: string) => `Certified, ${duration}`,
    certifiedBy: (backend: string, solver: string | null, took: number) =>
      `by ${backend}${solver ? ` (${solver})` : ''}, planned and checked in ${Math.round(took * 1000)} ms`,
    meets: (object: string, arrival: string, latest: string | null) =>
      `Meets ${object} at ${arrival}.${latest === null ? '' : ` The program may begin until ${latest}.`}`,
    shortened: (first: string, last: string, candidates: number) => `Shortened from ${first} to ${last}, ${candidates} trajectories tried.`,
    reported: 'reported, not enforced',
    quantity: 'Quantity',
    joint: 'Worst joint',
    used: 'Used',
    peak: 'Peak / limit',
    at: 'At',
    warnings: 'Warnings',
    goTo: (time: string) => `${time}: go there`,
    exact: 'Exact: the extrema of polynomials. Bounded: exceeded at no time. Sampled: the largest of fine samples.',
    methods: { exact: 'exact', bounded: 'bounded', sampled: 'sampled' },
    methodTitles: {
      exact: 'The peak is an extremum of the polynomials.',
      bounded: 'The quantity exceeds this peak at no time, between samples either.',
      sampled: 'The peak is the largest of fine samples.',
    },
    relaxedBy: (fields: readonly string[]) => `binds; wider with ${fields.join(' or ')}`,
    unlimited: 'no limit',
    unbounded: 'unbounded',
  },
  measures: {} as Record<string, string>, // titles of quantities in place of the planner's own
  clearance: {
    note: (pair: readonly string[], distance: string, time: number) =>
      `nearest: ${pair.join(' and ')}, ${distance} at ${time.toFixed(2)} s`,
    names: { scene: 'Clear of the scene', itself: 'Clear of itself', contacts: 'Where things are taken' },
    proved: (pair: readonly string[]) => `${pair.join(' and ')}, proved at all times`,
    estimate: (margin: string, isKept: boolean) =>
      isKept
        ? `Estimate: the clearance covers the ${margin} by which the machine may stick out of its estimated shapes.`
        : `Estimate: the machine may stick out of its estimated shapes by ${margin}. Plan with a margin of at least ${margin}.`,
    least: (distance: string, margin: string | null) => (margin === null ? distance : `${distance} / at least ${margin}`),
  },
  refusal: {
    label: 'Refusal',
    segment: (index: number, from: string, to: string) => `segment ${index}, from ${from} to ${to}`,
    last: 'Shown below is the last plan there was.',
    remedies: 'What would help',
    hints: 'What would lead further, though not yet to a plan',
    apply: 'Apply',
    json: 'As JSON',
    ways: { durations: 'Longer durations', limits: 'Wider limits', payload: 'A lighter payload', other: 'A change' },
    nearest: (distance: string) => `The nearest that the tool gets is ${distance} away; the robot is shown there in red.`,
    place: 'The robot is shown there in red.',
    pair: (pair: readonly string[], depth: string, time: string | null) =>
      `${pair.join(' and ')}: ${depth} too near${time === null ? '' : `, from ${time} on`}.`,
    show: 'Show the waypoint',
    at: (time: string) => `at ${time}`,
  },
  compare: {
    start: 'Compare all back ends',
    running: 'Comparing …',
    backend: 'Back end',
    duration: 'Time (s)',
    effort: 'Effort per second',
    power: 'Peak power (W)',
    energy: 'Energy (J)',
    jerk: 'Peak jerk',
    deviation: 'Off path',
    took: 'Com\u00adputed (ms)',
    use: 'Use',
    hint: 'The paths are shown as dashed lines in the colours of the table. Click the name of a back end to use it.',
  },
  exports: {
    files: 'As a file',
    report: 'report',
    code: 'As code',
    copy: 'Copy',
    copied: 'Copied',
    languages: { curl: 'curl', python: 'Python', typescript: 'TypeScript' },
  },
  projects: {
    browser: {
      label: 'Projects in this browser',
      hint: 'A project is the request that is shown. Others see it by a link or a file.',
    },
    service: {
      label: 'Projects on the service',
      hint: 'Other browsers see these projects; where the service asks for keys, only those with the same key.',
    },
    name: 'Name of the project',
    form: 'Without /, and not beginning with a full stop or a space.',
    save: 'Save project',
    opened: (name: string) => `Project ${name} opened`,
    remove: (name: string) => `Delete ${name}`,
    full: 'This browser has no room for the project: save its scene on the service, or save a file.',
    changed: (name: string) => `The project ${name} was changed elsewhere, such as in another tab or browser.`,
    overwrite: 'Overwrite it',
    openOther: 'Open the other version',
  },
  json: {
    label: 'The request as JSON',
    apply: 'Use this request',
    open: 'Open file',
    save: 'Save file',
    wrong: 'This is no request:',
  },
};
