// Several robots in one cell.
export const ofCells = {
  cells: {
    label: 'Robots of the cell',
    add: '+ Robot',
    addSame: 'One like this',
    addProject: 'From a project of this browser',
    name: 'Name in the cell',
    base: 'Base in the world',
    margin: 'Least distance',
    skew: 'Start skew up to',
    skewHint: 'A controller may start before or after another by so much.',
    meetings: 'The robots wait for each other at',
    hint: 'A robot waits where it stops, so that no two robots come nearer than this, also with the skew.',
    remove: (name: string) => `Delete the robot ${name}`,
    wait: (time: string, waypoint: number) => `waits ${time} at ${waypoint}`,
    noWait: 'no wait',
    found: 'Between the robots',
    clear: (robots: readonly string[], distance: string, skew: string) =>
      `${robots.join(' and ')}: ${distance} apart or more, proved at all times and for a skew of ±${skew}; nearest at`,
    meet: (robots: readonly string[], name: string) => `${robots.join(' and ')} meet at “${name}” until`,
    ofRobot: (name: string) => `The robot ${name}`,
    waiting: (time: string) => `Waits ${time} for another robot`,
    exported: (name: string) => `Files are of the robot ${name}, with its waits. All programs start at once.`,
    compared: (name: string) => `This compares the robot ${name} by itself, without waits.`,
  },
};
