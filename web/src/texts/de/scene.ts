import type { ofScene as english } from '../en/scene';

export const ofScene: typeof english = {
  scene: {
    label: (objects) => `Szene (${objects === 1 ? '1 Objekt' : `${objects} Objekte`})`,
    shown: 'Szene',
    none: 'keine',
    own: 'in dieser Anfrage',
    objects: 'Objekte der Szene',
    more: (count) => `${count} weitere Objekte werden als JSON unter „Anfrage“ bearbeitet.`,
    add: '+ Objekt',
    remove: 'Objekt löschen',
    frame: 'Im Koordinatensystem',
    frames: { world: 'Welt', base: 'Basis' },
    margin: 'Abstand der Szene',
    taken: (name) => (name === '' ? 'Ein Objekt braucht einen Namen.' : `Ein anderes Objekt heißt „${name}“.`),
    unit: 'Einheit der Datei',
    file: 'STL, OBJ, PLY, PCD laden',
    fault: (name, why) => `${name} kann nicht geladen werden: ${why}`,
    faults: {
      unknown: () => 'Der Name muss auf .stl, .obj, .ply oder .pcd enden.',
      empty: () => 'Die Datei hat keine Dreiecke oder Punkte.',
      unreadable: () => 'Der Inhalt ist nicht lesbar.',
      points: (count) => `Sie hat ${count} Punkte, mehr als 200000.`,
      triangles: (count) => `Sie hat ${count} Dreiecke, mehr als 100000.`,
      vertices: (count) => `Sie hat ${count} Ecken, mehr als 100000.`,
    },
    id: 'Name auf dem Dienst',
    save: 'Szene speichern',
  },
};
