// What stands around the robot and what it carries, with margins around it, and the pair that comes nearest.
import {
  BufferGeometry,
  CanvasTexture,
  DoubleSide,
  Float32BufferAttribute,
  Group,
  Line,
  LineBasicMaterial,
  Mesh,
  MeshBasicMaterial,
  MeshStandardMaterial,
  Points,
  PointsMaterial,
} from 'three';
import type { ColorRepresentation, Object3D, Vector3 } from 'three';
import { mergeGeometries } from 'three/examples/jsm/utils/BufferGeometryUtils.js';
import type { Placed } from '../scene/objects';
import type { SceneShape } from '../service/types';
import { grownGeometry } from './geometry';
import { ball } from './marks';

export interface ObstacleColours {
  thing: string;
  margin: string;
}

// Things that move together, so few objects that thousands are drawn at once. `extent` is how large a plane is drawn.
export function obstacles(placed: readonly Placed[], extent: number, { thing, margin }: ObstacleColours): Group {
  const group = new Group();
  const solid = placed.filter(({ shape }) => shape.kind !== 'half_space' && shape.kind !== 'point_cloud');
  const body = merged(solid, extent, () => 0);
  const shell = merged(
    solid.filter((one) => one.margin > 0),
    extent,
    (one) => one.margin,
  );
  if (body) group.add(new Mesh(body, new MeshStandardMaterial({ color: thing, roughness: 0.8, ...veil(0.55) })));
  if (shell) group.add(new Mesh(shell, new MeshBasicMaterial({ color: margin, ...veil(0.16) })));
  for (const one of placed) {
    if (one.shape.kind === 'half_space') group.add(...planes(one, extent, thing, margin));
    if (one.shape.kind === 'point_cloud') group.add(...cloud(one, one.shape, thing, margin));
  }
  return group;
}

function merged(placed: readonly Placed[], extent: number, marginOf: (one: Placed) => number): BufferGeometry | null {
  const parts = placed.flatMap((one) => {
    const grown = grownGeometry(one.shape, marginOf(one), extent);
    if (!grown) return [];
    const part = grown.index ? grown.toNonIndexed() : grown;
    part.deleteAttribute('uv');
    return [part.applyMatrix4(one.matrix)];
  });
  return parts.length > 0 ? mergeGeometries(parts) : null;
}

function veil(opacity: number): { transparent: true; opacity: number; depthWrite: false } {
  return { transparent: true, opacity, depthWrite: false };
}

function planes(one: Placed, extent: number, thing: ColorRepresentation, margin: ColorRepresentation): Mesh[] {
  const layers =
    one.margin > 0
      ? ([
          [0, thing, 0.3],
          [one.margin, margin, 0.08],
        ] as const)
      : ([[0, thing, 0.3]] as const);
  return layers.map(([by, color, opacity]) => {
    const geometry = grownGeometry(one.shape, by, extent)!.applyMatrix4(one.matrix);
    const mesh = new Mesh(geometry, new MeshBasicMaterial({ color, side: DoubleSide, ...veil(opacity) }));
    mesh.userData.endless = true;
    return mesh;
  });
}

type Cloud = Extract<SceneShape, { kind: 'point_cloud' }>;

// The points as discs that face the viewer, as large as the balls that they stand for.
function cloud(one: Placed, { points, radius }: Cloud, thing: ColorRepresentation, margin: ColorRepresentation): Points[] {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new Float32BufferAttribute(points.flat(), 3));
  geometry.applyMatrix4(one.matrix);
  const map = disc();
  const body = new Points(geometry, new PointsMaterial({ color: thing, size: 2 * radius, map, alphaTest: 0.5 }));
  if (one.margin === 0) return [body];
  const shell = new PointsMaterial({ color: margin, size: 2 * (radius + one.margin), map, alphaTest: 0.01, ...veil(0.05) });
  return [body, new Points(geometry, shell)];
}

function disc(): CanvasTexture {
  const canvas = Object.assign(document.createElement('canvas'), { width: 64, height: 64 });
  const context = canvas.getContext('2d')!;
  context.fillStyle = 'white';
  context.arc(32, 32, 31, 0, 2 * Math.PI);
  context.fill();
  return new CanvasTexture(canvas);
}

// A line between the nearest points of two things, seen through them.
export function gapMark([from, to]: readonly [Vector3, Vector3], size: number, colour: string): Group {
  const line = new Line(new BufferGeometry().setFromPoints([from, to]), new LineBasicMaterial({ color: colour, depthTest: false }));
  const ends = [from, to].map((at): Object3D => {
    const end = ball(at.toArray(), size, colour);
    (end.material as MeshBasicMaterial).depthTest = false;
    return end;
  });
  for (const part of [line, ...ends]) part.renderOrder = 2;
  return new Group().add(line, ...ends);
}
