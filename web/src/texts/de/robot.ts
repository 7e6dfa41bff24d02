import type { ofRobot as english } from '../en/robot';

export const ofRobot: typeof english = {
  robot: {
    sliders: 'Gelenke von Hand',
    add: 'Als Wegpunkt hinzufügen',
    limits: 'Grenzen und ihre Herkunft',
    fromTo: (lower, upper) => `${lower} bis ${upper}`,
    aboutRobot: 'Hinweise zu diesem Roboter',
    notes: (count) => `Hinweise (${count})`,
    readNotes: (robot, count) => `${count === 1 ? 'Den Hinweis' : `Die ${count} Hinweise`} zu ${robot} lesen`,
    unlimited: (names, areAll) =>
      areAll
        ? 'Kein Gelenk hat Positionsgrenzen: Bitte prüfen, ob die Maschine dorthin fahren kann.'
        : `Ohne Positionsgrenzen: ${names.join(', ')}.`,
    upload: 'Ein eigener Roboter',
    urdf: 'URDF',
    srdf: 'SRDF (freiwillig)',
    meshes: 'Netze als zip (freiwillig)',
    id: 'Kennung',
    idHint: 'nach der Datei',
    add_robot: 'Roboter hinzufügen',
    uploading: 'Wird hinzugefügt …',
    added: (id) => `${id} ist hinzugefügt.`,
    refused: 'Der Roboter wurde abgelehnt',
    severities: { error: 'Fehler:', warning: 'Warnung:', info: 'Hinweis:' },
    sources: { published: 'veröffentlicht', datasheet: 'Datenblatt', estimate: 'geschätzt', default: 'üblich', owner: 'eigene' },
  },
  jog: {
    label: 'Werkzeug von Hand',
    frame: 'Entlang der Achsen von',
    distance: 'Schritt',
    angle: 'Drehung',
    axes: ['x', 'y', 'z', 'Rollen', 'Nicken', 'Gieren'],
    less: (axis) => `Weniger ${axis}`,
    more: (axis) => `Mehr ${axis}`,
  },
  workspace: {
    label: 'Arbeitsraum',
    show: 'Zeigen, wo das Werkzeug sein kann',
    cut: 'Zum Betrachter hin aufgeschnitten',
    asking: 'Fragt den Dienst …',
    colours: 'Von der Basis:',
    figures: {
      minimum_reach: 'Der Basis am nächsten',
      maximum_reach: 'Von der Basis am weitesten',
      minimum_height: 'Am tiefsten',
      maximum_height: 'Am höchsten',
      minimum_radius: 'Der z-Achse am nächsten',
      maximum_radius: 'Von der z-Achse am weitesten',
    },
    go: 'Zeigen',
    goTo: (figure) => `Den Roboter dort zeigen: ${figure}`,
    hint: (points) =>
      `${points} Punkte innerhalb der Positionsgrenzen, mit dem gezeigten Werkzeug, im Basiskoordinatensystem; Kollisionen sind nicht geprüft.`,
  },
};
