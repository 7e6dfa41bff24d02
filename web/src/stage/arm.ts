// The robot as a tree of shapes that follow its joints.
import {
  BoxGeometry,
  BufferGeometry,
  CapsuleGeometry,
  CylinderGeometry,
  Float32BufferAttribute,
  Group,
  Mesh,
  MeshStandardMaterial,
  SphereGeometry,
} from 'three';
import type { ColorRepresentation, Object3D } from 'three';
import type { Robot } from '../service/types';
import { jointMatrices } from '../robot/chain';
import type { Form, Shape } from '../robot/shapes';

export class Arm {
  readonly object = new Group();
  private readonly links: Group[];

  // With a colour and an opacity it is a ghost.
  constructor(
    private readonly robot: Robot,
    shapes: readonly Shape[],
    ghost?: { colour: ColorRepresentation; opacity: number },
  ) {
    this.links = Array.from({ length: robot.chain.length + 1 }, () => new Group());
    for (const link of this.links) {
      link.matrixAutoUpdate = false;
      this.object.add(link);
    }
    shapes.forEach((shape) => {
      const mesh = new Mesh(geometryOf(shape.form), ghost ? ghostly(ghost) : materialOf(shape.after));
      mesh.matrixAutoUpdate = false;
      mesh.matrix.copy(shape.matrix);
      if (shape.form.kind === 'cylinder' || shape.form.kind === 'capsule') mesh.geometry.rotateX(Math.PI / 2);
      this.links[shape.after]!.add(mesh);
    });
  }

  pose(position: readonly number[]): void {
    jointMatrices(this.robot, position).forEach((matrix, index) => {
      this.links[index]!.matrix.copy(matrix);
      this.links[index]!.matrixWorldNeedsUpdate = true;
    });
  }

  // Carries an object behind so many joints.
  attach(after: number, object: Object3D): void {
    this.links[after]!.add(object);
  }

  dispose(): void {
    this.object.traverse((node) => {
      if (node instanceof Mesh) (node.geometry as BufferGeometry).dispose();
    });
    this.object.removeFromParent();
  }
}

function geometryOf(form: Form): BufferGeometry {
  switch (form.kind) {
    case 'box':
      return new BoxGeometry(...form.size);
    case 'cylinder':
      return new CylinderGeometry(form.radius, form.radius, form.length, 32);
    case 'capsule':
      return new CapsuleGeometry(form.radius, form.length, 6, 20);
    case 'sphere':
      return new SphereGeometry(form.radius, 28, 18);
    case 'convex':
      return hull(form.vertices, form.faces);
  }
}

// Each triangle has corners of its own, so that its edges are seen.
function hull(vertices: readonly (readonly number[])[], faces: readonly (readonly number[])[]): BufferGeometry {
  const geometry = new BufferGeometry();
  const corners = faces.flatMap((face) => face.flatMap((corner) => [...vertices[corner]!]));
  geometry.setAttribute('position', new Float32BufferAttribute(corners, 3));
  geometry.computeVertexNormals();
  return geometry;
}

const BODY = new MeshStandardMaterial({ color: '#e8833a', roughness: 0.5, metalness: 0.1 });
const JOINT = new MeshStandardMaterial({ color: '#4a525c', roughness: 0.55, metalness: 0.2 });

function materialOf(after: number): MeshStandardMaterial {
  return after === 0 ? JOINT : BODY;
}

function ghostly({ colour, opacity }: { colour: ColorRepresentation; opacity: number }): MeshStandardMaterial {
  return new MeshStandardMaterial({ color: colour, transparent: true, opacity, depthWrite: false });
}
