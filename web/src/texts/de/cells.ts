import type { ofCells as english } from '../en/cells';

export const ofCells: typeof english = {
  cells: {
    label: 'Roboter der Zelle',
    add: '+ Roboter',
    addSame: 'Noch einer wie dieser',
    addProject: 'Aus einem Projekt in diesem Browser',
    name: 'Name in der Zelle',
    base: 'Sockel in der Welt',
    margin: 'Mindestabstand',
    skew: 'Startversatz bis',
    skewHint: 'So viel früher oder später als eine andere darf eine Steuerung starten.',
    meetings: 'Die Roboter warten aufeinander bei',
    hint: 'Ein Roboter wartet dort, wo er hält, damit keine zwei einander näher kommen, auch mit dem Versatz.',
    remove: (name) => `Roboter ${name} löschen`,
    wait: (time, waypoint) => `wartet ${time} bei ${waypoint}`,
    noWait: 'wartet nie',
    found: 'Zwischen den Robotern',
    clear: (robots, distance, skew) =>
      `${robots.join(' und ')}: mindestens ${distance} Abstand, bewiesen zu jeder Zeit und für einen Versatz von ±${skew}; am nächsten bei`,
    meet: (robots, name) => `${robots.join(' und ')} treffen sich bei „${name}“ bis`,
    ofRobot: (name) => `Der Roboter ${name}`,
    waiting: (time) => `Wartet ${time} auf einen anderen Roboter`,
    exported: (name) => `Die Dateien sind vom Roboter ${name}, mit seinen Wartezeiten. Alle Programme starten zugleich.`,
    compared: (name) => `Verglichen wird der Roboter ${name} für sich, ohne Wartezeiten.`,
  },
};
