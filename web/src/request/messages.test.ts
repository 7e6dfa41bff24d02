import { beforeEach, describe, expect, test, vi } from 'vitest';
import type { Finding, Joint, Problem } from '../service/types';
import document from '../service/openapi.json';
import { german } from '../texts/de';

vi.mock('../texts', async () => ({ texts: (await import('../texts/de')).german, language: 'de' }));

const { findingsOf, messageOf, noteOf, warningOf } = await import('./messages');
const { changeInWords } = await import('./changes');
const { lengthUnit, angleUnit } = await import('../state/units');

const joint = { name: 'joint_2', kind: 'revolute' } as Joint;
const problem = (fields: Partial<Problem>): Problem =>
  ({ type: '', title: 'T', status: 422, detail: 'D.', instance: '', ...fields }) as Problem;

beforeEach(() => {
  lengthUnit.value = 'mm';
  angleUnit.value = '°';
});

test('every code of the service has a title, a cause and a way out in German', () => {
  const codes = document.components.schemas.ProblemDocument.properties.code.enum;
  expect(codes.length).toBeGreaterThan(40);
  expect(Object.keys(german.messages.refusals).sort()).toEqual([...codes, 'no_answer'].sort());
  for (const { title, cause, remedy } of Object.values(german.messages.refusals)) {
    expect(title).toMatch(/^[A-ZÄÖÜ].*[^.]$/);
    for (const sentence of [cause, remedy]) expect(sentence).toMatch(/^[A-ZÄÖÜ].*\.$/);
  }
});

describe('a refusal in German', () => {
  test('has the value and the limit in the units that a person chose', () => {
    const refused = problem({ code: 'joint_position_limit', joint: 'joint_2', value: Math.PI, limit: 2.5 });
    expect(messageOf(refused, [joint]).sentences[0]).toBe('joint_2 käme auf 180 °; die Grenze ist 143.2 °.');
    angleUnit.value = 'rad';
    expect(messageOf(refused, [joint]).sentences[0]).toBe('joint_2 käme auf 3.142 rad; die Grenze ist 2.5 rad.');
  });

  test.each([
    ['the velocity of joint_2 would reach 3, its limit is 2', 'Geschwindigkeit von joint_2 wäre 3 rad/s; die Grenze ist 2 rad/s.'],
    [
      'the requested velocity of joint_2 at waypoint 1 is 3, beyond its limit 2',
      'Geschwindigkeit von joint_2 wäre 3 rad/s; die Grenze ist 2 rad/s.',
    ],
  ])('names the quantity of "%s"', (detail, sentence) => {
    angleUnit.value = 'rad';
    const refused = problem({ code: 'limits_unsatisfiable', detail, joint: 'joint_2', value: 3, limit: 2 });
    expect(messageOf(refused, [joint]).sentences[0]).toBe(sentence);
  });

  test('says the usual cause where a number has no known unit', () => {
    const refused = problem({ code: 'limits_unsatisfiable', detail: 'gravity is too strong', value: 3, limit: 2 });
    expect(messageOf(refused, [joint]).sentences[0]).toBe(german.messages.refusals.limits_unsatisfiable!.cause);
  });

  test('tells two numbers apart that are nearly the same', () => {
    const refused = problem({ code: 'infeasible_duration', value: 1, limit: 1.00000123 });
    expect(messageOf(refused).sentences[0]).toBe('Verlangt sind 1 s; die Grenzen brauchen mindestens 1.000001 s.');
  });

  test('leaves the usual way out to remedies that are proved, and keeps the original', () => {
    const refused = problem({ code: 'no_path_found', checks: 20_000, remedies: [{ change: '/duration', value: 1, explanation: '' }] });
    expect(messageOf(refused).sentences).toEqual([
      german.messages.refusals.no_path_found!.cause,
      'Die Suche hat 20000 Bewegungen geprüft.',
    ]);
    expect(messageOf(refused).original).toEqual(['T: D.']);
    expect(messageOf({ ...refused, remedies: null }).sentences.at(-1)).toBe(german.messages.refusals.no_path_found!.remedy);
  });

  test('with a code of a later service is the original', () => {
    expect(messageOf(problem({ code: 'new_code' as never }))).toEqual({ title: 'T', sentences: ['D.'], original: [] });
  });
});

test('a service that does not answer is said in German', () => {
  expect(messageOf(problem({ code: 'internal_error', status: 0 })).title).toBe('Der Dienst antwortet nicht');
});

test('warnings are in German, with their original', () => {
  const message = 'the trajectory ends in motion';
  expect(warningOf({ code: 'ends_in_motion', message })).toEqual({ text: 'Die Trajektorie endet in Bewegung.', original: message });
  expect(warningOf({ code: 'new', message })).toEqual({ text: message, original: null });
});

test('findings of one kind are one line in German, with all originals', () => {
  const finding = (code: string, subject: string | null, message: string): Finding => ({ code, severity: 'info', subject, message });
  const given = [
    finding('default_limits', 'j1', 'limits of j1 by the default rule: 1'),
    finding('no_masses', null, 'nothing has a mass'),
    finding('default_limits', 'j2', 'limits of j2 by the default rule: 2'),
    finding('new', 'j1', 'j1 is new'),
    finding('new', 'j2', 'j2 is new'),
    finding('new', 'j1', 'j1 is other'),
  ];
  expect(findingsOf(given)).toEqual([
    { severity: 'info', text: `j1, j2: ${german.messages.findings.default_limits!}`, original: [given[0]!.message, given[2]!.message] },
    { severity: 'info', text: german.messages.findings.no_masses!, original: [given[1]!.message] },
    { severity: 'info', text: 'j1 is new (ebenso j2)', original: [] },
    { severity: 'info', text: 'j1 is other', original: [] },
  ]);
});

test.each([
  ['lines 6, 9: no feed F, so no limit on the speed of the tool', 'Zeile 6, 9: kein Vorschub F, also keine Grenze für das Werkzeug.'],
  ['line 4: left out dwells', 'Zeile 4: weggelassen sind Verweilzeiten.'],
  ['3 moves straight from shape to shape, lifted by 0.05 m', 'Gerade Bewegungen von Form zu Form: 3, angehoben.'],
  ['left out column `tool`', 'Spalten ohne Wirkung: `tool`.'],
])('the note "%s" is in German', (note, text) => {
  expect(noteOf(note)).toEqual({ text, original: note });
  expect(noteOf(`${note}!?\n`)).toEqual({ text: `${note}!?\n`, original: null });
});

test.each([
  ['/waypoints/2/duration', 1.23456, 'Wegpunkt 2, Dauer: 1.235 s'],
  ['/limits/tcp_linear_velocity', 0.25, 'Grenzen, Werkzeuggeschwindigkeit: 250 mm/s'],
  ['/waypoints/1/transition', { kind: 'blend', radius: 0.05 }, 'Wegpunkt 1, Übergang: Überschleifen, Radius 50 mm'],
  ['/waypoints/3/motion/kind', 'free', 'Wegpunkt 3, Bewegung, Art: um Hindernisse'],
  ['/self_collision', false, 'Prüfung auf Selbstkollision: nein'],
])('the change %s = %j reads "%s"', (pointer, value, words) => {
  expect(changeInWords(pointer, value, (index) => `Wegpunkt ${index}`)).toBe(words);
});
