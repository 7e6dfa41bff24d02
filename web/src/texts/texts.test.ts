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
  !/^\/(fields\/words|measures|messages\/(refusals|figures|warnings|findings|notes|words))\//.test(place); // in place of the service's own

test('every text exists in both languages', () => {
  expect(places(german).filter(isWord).sort()).toEqual(places(english).filter(isWord).sort());
});

test('no text is empty, and German texts are not the English ones', () => {
  const all = (texts: object): string[] =>
    Object.values(texts).flatMap((text: unknown) => (typeof text === 'object' && text !== null ? all(text) : [text as string]));
  const [ofGerman, ofEnglish] = [all({ ...german, fields: {} }), all({ ...english, fields: {} })];
  expect(ofGerman.filter((text) => text === '')).toEqual([]);
  const same = ofGerman.filter((text, i) => typeof text === 'string' && text.includes(' ') && text === ofEnglish[i]);
  expect(same).toEqual([]);
});
