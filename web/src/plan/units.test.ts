import { expect, test, vi } from 'vitest';
import { ANGLES, chooseAngle, chooseLength, LENGTHS } from '../state/units';
import type { Angle, Length } from '../state/units';
import { decimal, inService, lengthAbove, lengthBelow, shownIn, withUnit, written } from './units';

vi.stubGlobal('localStorage', { setItem: () => undefined });

const METRES: Record<Length, number> = { mm: 0.001, m: 1, in: 0.0254 }; // of one, by definition
const RADIANS: Record<Angle, number> = { '°': Math.PI / 180, rad: 1 };
const random = (): number => (Math.random() < 0.5 ? -1 : 1) * 10 ** (4 * Math.random() - 2);

test.each(Object.keys(LENGTHS) as Length[])('lengths in %s are those of the service, there and back', (unit) => {
  chooseLength(unit);
  for (const power of ['', '/s', '/s^2', '/s^3']) {
    const value = random();
    const { factor, name } = shownIn(`m${power}`);
    expect(factor * METRES[unit]).toBeCloseTo(1, 12);
    expect(name).toBe(unit + power.replace('^2', '²').replace('^3', '³'));
    expect(inService(value * factor, `m${power}`)).toBeCloseTo(value, 10);
    expect(withUnit('Speed', `m${power}`)).toBe(`Speed (${name})`);
  }
  const length = Math.abs(random());
  const [below, above] = [lengthBelow, lengthAbove].map((round) => parseFloat(round(length)) * METRES[unit]);
  expect(below!).toBeLessThanOrEqual(length + 1e-9);
  expect(above!).toBeGreaterThanOrEqual(length - 1e-9);
  expect(above! - below!).toBeLessThanOrEqual(1.001 * METRES[unit] * 10 ** -LENGTHS[unit].decimals);
});

test.each(Object.keys(ANGLES) as Angle[])('angles in %s are those of the service, there and back', (unit) => {
  chooseAngle(unit);
  const value = random();
  expect(parseFloat(written(value, 'rad', 12)) * RADIANS[unit]).toBeCloseTo(value, 9);
  expect(inService(value / RADIANS[unit], 'rad/s')).toBeCloseTo(value, 9);
  expect(parseFloat(decimal(value, 'rad')) * RADIANS[unit]).toBeCloseTo(value, 2);
});

test.each(['N m', 'kg', 's', 'W', 'kg m^2', ''])('numbers in "%s" stay as they are', (unit) => {
  chooseLength('in');
  expect(shownIn(unit)).toMatchObject({ factor: 1, name: unit.replace('^2', '²') });
  expect(inService(12345678901234, unit)).toBe(12345678901234);
});
