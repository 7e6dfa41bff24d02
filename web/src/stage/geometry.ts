// Shapes as triangles: those of robots, those of a scene, and how far their margins reach.
import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CapsuleGeometry,
  CylinderGeometry,
  Float32BufferAttribute,
  LatheGeometry,
  PlaneGeometry,
  SphereGeometry,
  Vector2,
  Vector3,
} from 'three';
import { ConvexGeometry } from 'three/examples/jsm/geometries/ConvexGeometry.js';
import { RoundedBoxGeometry } from 'three/examples/jsm/geometries/RoundedBoxGeometry.js';
import type { Form } from '../robot/shapes';
import type { SceneShape } from '../service/types';

const ROUND = 32; // sides of what is round
const CORNER = 3; // rows of triangles around a rounded edge

// A shape of a robot; lengths are along z.
export function geometryOf(form: Form): BufferGeometry {
  switch (form.kind) {
    case 'box':
      return new BoxGeometry(...form.size);
    case 'cylinder':
      return new CylinderGeometry(form.radius, form.radius, form.length, ROUND).rotateX(Math.PI / 2);
    case 'capsule':
      return new CapsuleGeometry(form.radius, form.length, 6, 20).rotateX(Math.PI / 2);
    case 'sphere':
      return new SphereGeometry(form.radius, 28, 18);
    case 'convex':
      return trianglesOf(form.vertices, form.faces);
    case 'triangles':
      return facetsOf(form.vertices, form.faces);
  }
}

// A mesh whose edges are seen.
function facetsOf(vertices: Float32Array, faces: Uint32Array): BufferGeometry {
  const geometry = new BufferGeometry().setAttribute('position', new BufferAttribute(vertices, 3)).setIndex(new BufferAttribute(faces, 1));
  const facets = geometry.toNonIndexed();
  facets.computeVertexNormals();
  return facets;
}

// A shape of a scene, larger by a margin all around; null: it has no surface.
export function grownGeometry(shape: SceneShape, margin: number, extent: number): BufferGeometry | null {
  switch (shape.kind) {
    case 'box': {
      const [x, y, z] = shape.size.map((side) => side + 2 * margin) as [number, number, number];
      return margin > 0 ? new RoundedBoxGeometry(x, y, z, CORNER, margin) : new BoxGeometry(x, y, z);
    }
    case 'sphere':
      return new SphereGeometry(shape.radius + margin, ROUND, 20);
    case 'capsule':
      return new CapsuleGeometry(shape.radius + margin, shape.length, 8, ROUND).rotateX(Math.PI / 2);
    case 'cylinder':
      return new LatheGeometry(profile(shape.radius, shape.length / 2, margin), ROUND).rotateX(Math.PI / 2);
    case 'half_space':
      return plane(shape.normal, (shape.offset ?? 0) + margin, extent);
    case 'convex':
      return hullOf(shape.vertices.flatMap((corner) => around(corner, margin)));
    case 'mesh':
      return grown(trianglesOf(shape.vertices, shape.triangles), margin);
    case 'point_cloud':
      return null;
  }
}

// The convex hull of points; null: they lie on a line.
function hullOf(points: Vector3[]): BufferGeometry | null {
  try {
    return new ConvexGeometry(points);
  } catch {
    return null;
  }
}

// Half of the outline of a cylinder whose edges are rounded by its margin.
function profile(radius: number, half: number, margin: number): Vector2[] {
  const quarter = Array.from({ length: 7 }, (_, i) => (Math.PI / 2) * (i / 6));
  const top = quarter.map((angle) => new Vector2(radius + margin * Math.cos(angle), half + margin * Math.sin(angle)));
  const bottom = [...top].reverse().map(({ x, y }) => new Vector2(x, -y));
  return [new Vector2(0, -half - margin), ...bottom, ...top, new Vector2(0, half + margin)];
}

function plane(normal: readonly number[], offset: number, extent: number): BufferGeometry {
  const out = new Vector3().fromArray(normal).normalize();
  const size = 2.4 * extent;
  const geometry = new PlaneGeometry(size, size).lookAt(out);
  return geometry.translate(...out.multiplyScalar(offset).toArray());
}

// A corner as so many points on a ball around it.
function around(corner: readonly number[], margin: number): Vector3[] {
  const at = new Vector3().fromArray(corner);
  if (margin === 0) return [at];
  const steps = [-1, 0, 1];
  const directions = steps.flatMap((x) => steps.flatMap((y) => steps.map((z) => new Vector3(x, y, z))));
  return directions.filter((one) => one.lengthSq() > 0).map((one) => one.setLength(margin).add(at));
}

function grown(geometry: BufferGeometry, margin: number): BufferGeometry {
  const [points, normals] = [geometry.getAttribute('position'), geometry.getAttribute('normal')];
  for (let i = 0; margin > 0 && i < points.count; i += 1) {
    points.setXYZ(
      i,
      points.getX(i) + margin * normals.getX(i),
      points.getY(i) + margin * normals.getY(i),
      points.getZ(i) + margin * normals.getZ(i),
    );
  }
  return geometry;
}

// Each triangle has corners of its own, so that its edges are seen.
function trianglesOf(vertices: readonly (readonly number[])[], faces: readonly (readonly number[])[]): BufferGeometry {
  const geometry = new BufferGeometry();
  const corners = faces.flatMap((face) => face.flatMap((corner) => [...(vertices[corner] ?? [0, 0, 0])]));
  geometry.setAttribute('position', new Float32BufferAttribute(corners, 3));
  geometry.computeVertexNormals();
  return geometry;
}
