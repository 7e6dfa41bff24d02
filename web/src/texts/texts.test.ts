import { expect, test } from 'vitest';
import { german } from './de';
import { english } from './en';

// The paths of all texts, with the number of parts that a text is made of.
function places(texts: object, at = ''): string[] {
  return Object.entries(texts).flatMap(([name, text]: [string, unknown]) => {
    const here = `${at}/${name}`;
    if (typeof text === 'function') return [`${here}(${text.length})`];
    return typeof text === 'object' && text !== null ? places(text, here) : [here];
  });
}

const isWord = (place: string): boolean =>
  !/^\/(fields\/words|measures|messages\/(refusals|figures|warnings|findings|notes|robotNotes|words))\//.test(place); // in place of the service's own

test('every text exists in both languages', () => {
  expect(places(german).filter(isWord).sort()).toEqual(places(english).filter(isWord).sort());
});

const CATALOGUE = import.meta.glob<{ notes?: string[] }>('../../../planner/robots/data/**/*.json', { import: 'default', eager: true });

test('every note on a robot of the catalogue exists in German, and no other', () => {
  const notes = Object.values(CATALOGUE).flatMap((robot) => robot.notes ?? []);
  expect(notes.length).toBeGreaterThan(40);
  expect(Object.keys(german.messages.robotNotes).sort()).toEqual([...new Set(notes)].sort());
});

test('no text is empty, and German texts are not the English ones', () => {
  const all = (texts: object): string[] =>
    Object.values(texts).flatMap((text: unknown) => (typeof text === 'object' && text !== null ? all(text) : [text as string]));
  const [ofGerman, ofEnglish] = [all({ ...german, fields: {} }), all({ ...english, fields: {} })];
  expect(ofGerman.filter((text) => text === '')).toEqual([]);
  const same = ofGerman.filter((text, i) => typeof text === 'string' && text.includes(' ') && text === ofEnglish[i]);
  expect(same).toEqual([]);
});
