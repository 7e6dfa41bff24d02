// Notes on path files: the service's sentences, and what they say in German.
import type { ofMessages as english } from '../en/messages';

const LEFT_OUT: Record<string, string> = {
  dwells: 'Verweilzeiten',
  'tool lengths: the `tool` of the request has them': 'Werkzeuglängen; das Werkzeug steht in der Anfrage',
  'M codes, such as spindle and coolant': 'M-Befehle, etwa Spindel und Kühlung',
  'spindle speeds': 'Spindeldrehzahlen',
  'tool numbers': 'Werkzeugnummern',
  'extruder positions': 'Stellungen des Extruders',
};

const lines = (numbers: string): string => `Zeile ${numbers.replace(' and others', ' und weitere')}`;

export const notes: (typeof english)['messages']['notes'] = [
  [
    /^the drawing names no known unit: its lengths are taken as mm$/,
    () => 'Die Zeichnung nennt keine bekannte Einheit: Längen gelten in mm.',
  ],
  [
    /^left out ([^:]+): only (.+) are read; explode or convert others$/,
    (kinds, read) => `Weggelassen: ${kinds}. Gelesen werden nur ${read}; anderes vorher zerlegen oder umwandeln.`,
  ],
  [/^left out columns? (.+)$/, (names) => `Spalten ohne Wirkung: ${names}.`],
  [
    /^(\d+) moves? straight from shape to shape, (.+)$/,
    (count, how) => `Gerade Bewegungen von Form zu Form: ${count}, ${how === 'without `lift`' ? 'ohne Anheben' : 'angehoben'}.`,
  ],
  [
    /^line (\d+): no waypoint, since (.+) had no value yet$/,
    (line, axes) => `${lines(line)}: kein Wegpunkt, denn ohne Wert: ${axes.replaceAll(' and ', ', ')}.`,
  ],
  [
    /^lines? (.+): no feed F, so no limit on the speed of the tool$/,
    (of) => `${lines(of)}: kein Vorschub F, also keine Grenze für das Werkzeug.`,
  ],
  [/^lines? ([^:]+): left out (.+)$/, (of, what) => `${lines(of)}: weggelassen sind ${LEFT_OUT[what] ?? what}.`],
];
