// The light on the stage: from all sides, and from two lamps.
import { AmbientLight, DirectionalLight } from 'three';
import type { Light } from 'three';

const LAMPS = [
  [2, -3, 5, 2.2],
  [-4, 2, 3, 0.9],
] as const; // x, y, z and strength

export function lights(): Light[] {
  const lamps = LAMPS.map(([x, y, z, strength]) => {
    const lamp = new DirectionalLight('#ffffff', strength);
    lamp.position.set(x, y, z);
    return lamp;
  });
  return [new AmbientLight('#ffffff', 1.4), ...lamps];
}
