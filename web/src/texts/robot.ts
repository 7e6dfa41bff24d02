// The robot: its joints, its limits, where it can be.
export const ofRobot = {
  robot: {
    sliders: 'Joints by hand',
    add: 'Add as waypoint',
    limits: 'Limits and where they come from',
    fromTo: (lower: string, upper: string) => `${lower} to ${upper}`,
    aboutRobot: 'Notes on this robot',
    notes: (count: number) => `Notes (${count})`,
    readNotes: (robot: string, count: number) => `Read ${count === 1 ? 'the note' : `the ${count} notes`} on ${robot}`,
    unlimited: (names: readonly string[], areAll: boolean) =>
      areAll ? 'No joint has position limits: check that the machine can go there.' : `Without position limits: ${names.join(', ')}.`,
    upload: 'A robot of your own',
    urdf: 'URDF',
    srdf: 'SRDF (optional)',
    meshes: 'Meshes as zip (optional)',
    id: 'Id',
    idHint: 'after the file',
    add_robot: 'Add robot',
    uploading: 'Adding …',
    added: (id: string) => `${id} is added.`,
    refused: 'The robot was refused',
    severities: { error: 'Error:', warning: 'Warning:', info: 'Note:' } as Record<string, string>,
  },
  workspace: {
    label: 'Workspace',
    show: 'Show where the tool can be',
    cut: 'Cut open towards the viewer',
    asking: 'Asking the service …',
    colours: 'From the base:',
    figures: {
      minimum_reach: 'Nearest to the base',
      maximum_reach: 'Farthest from the base',
      minimum_height: 'Lowest',
      maximum_height: 'Highest',
      minimum_radius: 'Nearest to the z axis',
      maximum_radius: 'Farthest from the z axis',
    },
    go: 'Show',
    goTo: (figure: string) => `Show the robot there: ${figure}`,
    hint: (points: number) =>
      `${points} points within the position limits, with the tool that is shown, in the base frame; collisions are not looked at.`,
  },
};
