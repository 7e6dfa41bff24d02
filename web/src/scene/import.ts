// Objects from files: STL and OBJ as meshes, PLY as a mesh or a point cloud, PCD as a point cloud.
import { BufferGeometry, Mesh } from 'three';
import type { Object3D } from 'three';
import { OBJLoader } from 'three/examples/jsm/loaders/OBJLoader.js';
import { PCDLoader } from 'three/examples/jsm/loaders/PCDLoader.js';
import { PLYLoader } from 'three/examples/jsm/loaders/PLYLoader.js';
import { STLLoader } from 'three/examples/jsm/loaders/STLLoader.js';
import type { SceneShape } from '../service/types';

const MOST = { points: 200_000, triangles: 100_000, vertices: 100_000 }; // of the service

// Why a file is no object; of what it has too many, how many it has.
export interface Fault {
  fault: 'unknown' | 'empty' | 'unreadable' | keyof typeof MOST;
  count: number;
}

// The shape in a file whose numbers are so many m each.
export function shapeOfFile(name: string, content: ArrayBuffer, metres: number): SceneShape | Fault {
  let geometries: BufferGeometry[];
  try {
    geometries = geometriesOf(name.replace(/^.*\./, '').toLowerCase(), content);
  } catch {
    return faulty('unreadable');
  }
  if (geometries.length === 0) return faulty('unknown');
  const corners = geometries.flatMap((geometry) => cornersOf(geometry, metres));
  if (corners.length === 0) return faulty('empty');
  if (!corners.every((corner) => corner.every(Number.isFinite))) return faulty('unreadable');
  const isCloud = geometries.every((geometry) => geometry.userData.isCloud as boolean);
  return isCloud ? cloudOf(corners) : meshOf(corners);
}

function faulty(fault: Fault['fault'], count = 0): Fault {
  return { fault, count };
}

function geometriesOf(suffix: string, content: ArrayBuffer): BufferGeometry[] {
  switch (suffix) {
    case 'stl':
      return [new STLLoader().parse(content)];
    case 'obj':
      return meshesOf(new OBJLoader().parse(new TextDecoder().decode(content)));
    case 'ply': {
      const geometry = new PLYLoader().parse(content);
      geometry.userData.isCloud = geometry.index === null;
      return [geometry];
    }
    case 'pcd': {
      const { geometry } = new PCDLoader().parse(content);
      geometry.userData.isCloud = true;
      return [geometry];
    }
    default:
      return [];
  }
}

function meshesOf(object: Object3D): BufferGeometry[] {
  const found: BufferGeometry[] = [];
  object.traverse((node) => {
    if (node instanceof Mesh && node.geometry instanceof BufferGeometry) found.push(node.geometry as BufferGeometry);
  });
  return found.length > 0 ? found : [new BufferGeometry()];
}

// The points of a cloud, or three corners for each triangle, m.
function cornersOf(geometry: BufferGeometry, metres: number): number[][] {
  const { position } = geometry.attributes;
  if (!position) return [];
  const order = geometry.index ? Array.from(geometry.index.array) : Array.from({ length: position.count }, (_, i) => i);
  return order.map((i) => [position.getX(i), position.getY(i), position.getZ(i)].map((value) => Number((value * metres).toFixed(6))));
}

// A mesh whose equal corners are one; triangles with two equal corners are left out.
function meshOf(corners: readonly number[][]): SceneShape | Fault {
  const numbers = new Map<string, number>();
  const vertices: number[][] = [];
  const indices = corners.map((corner) => {
    const key = corner.join();
    if (!numbers.has(key)) numbers.set(key, vertices.push(corner) - 1);
    return numbers.get(key)!;
  });
  const triangles = Array.from({ length: Math.floor(indices.length / 3) }, (_, i) => indices.slice(3 * i, 3 * i + 3));
  const sound = triangles.filter((triangle) => new Set(triangle).size === 3);
  if (sound.length === 0) return faulty('empty');
  if (sound.length > MOST.triangles) return faulty('triangles', sound.length);
  if (vertices.length > MOST.vertices) return faulty('vertices', vertices.length);
  return { kind: 'mesh', vertices, triangles: sound };
}

function cloudOf(points: number[][]): SceneShape | Fault {
  if (points.length > MOST.points) return faulty('points', points.length);
  return { kind: 'point_cloud', points, radius: radiusOf(points) };
}

// A first radius, by the surface of the box around the points: a person sees and changes it.
function radiusOf(points: readonly number[][]): number {
  const extent = (axis: number): number => {
    const [low, high] = points.reduce<[number, number]>(
      ([least, most], point) => [Math.min(least, point[axis]!), Math.max(most, point[axis]!)],
      [Infinity, -Infinity],
    );
    return high - low;
  };
  const [x, y, z] = [extent(0), extent(1), extent(2)];
  const spacing = Math.sqrt((2 * (x * y + y * z + z * x)) / points.length);
  return Number(Math.min(0.1, Math.max(0.001, spacing)).toFixed(4));
}
