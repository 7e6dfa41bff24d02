// The robot as a tree of shapes that follow its joints.
import { Color, Group, LinearSRGBColorSpace, Mesh, MeshStandardMaterial } from 'three';
import type { BufferGeometry, ColorRepresentation, Object3D, Vector3 } from 'three';
import type { Robot } from '../service/types';
import { jointMatrices } from '../robot/chain';
import type { Shape } from '../robot/shapes';
import { geometryOf } from './geometry';
import { cornersOfBox } from './views';

const SWEPT = 12; // steps

export class Arm {
  readonly object = new Group();
  position: readonly number[] = []; // of the joints
  private readonly links: Group[];
  private meshes: Mesh[] = [];

  // With a colour and an opacity it is a ghost.
  constructor(
    private readonly robot: Robot,
    shapes: readonly Shape[],
    private readonly look?: { colour: ColorRepresentation; opacity: number },
  ) {
    this.links = Array.from({ length: robot.chain.length + 1 }, () => new Group());
    for (const link of this.links) {
      link.matrixAutoUpdate = false;
      this.object.add(link);
    }
    this.dress(shapes);
  }

  // Draws the links by other shapes.
  dress(shapes: readonly Shape[]): void {
    this.meshes.forEach((mesh) => {
      mesh.geometry.dispose();
      mesh.removeFromParent();
    });
    this.meshes = shapes.map((shape) => {
      const mesh = new Mesh(geometryOf(shape.form), this.look ? ghostly(this.look) : materialOf(shape));
      mesh.matrixAutoUpdate = false;
      mesh.matrix.copy(shape.matrix);
      this.links[shape.after]!.add(mesh);
      return mesh;
    });
  }

  pose(position: readonly number[]): void {
    this.position = position;
    jointMatrices(this.robot, position).forEach((matrix, index) => {
      this.links[index]!.matrix.copy(matrix);
      this.links[index]!.matrixWorldNeedsUpdate = true;
    });
  }

  // Points in the world around the arm, and what it carries, at some positions of a path: the corners of the shapes' boxes.
  swept(path: readonly (readonly number[])[]): Vector3[] {
    const [points, before]: [Vector3[], readonly number[]] = [[], this.position];
    for (let k = 0; k <= SWEPT; k += 1) {
      this.pose(path[Math.round((k * (path.length - 1)) / SWEPT)]!);
      this.object.updateWorldMatrix(true, true);
      this.object.traverse((node) => points.push(...cornersOf(node)));
    }
    this.pose(before);
    return points;
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

function cornersOf(node: Object3D): Vector3[] {
  if (!(node instanceof Mesh)) return [];
  const { geometry, matrixWorld } = node as Mesh;
  geometry.computeBoundingBox();
  return cornersOfBox(geometry.boundingBox!).map((corner) => corner.applyMatrix4(matrixWorld));
}

const BODY = new MeshStandardMaterial({ color: '#e8833a', roughness: 0.5, metalness: 0.1 });
const JOINT = new MeshStandardMaterial({ color: '#4a525c', roughness: 0.55, metalness: 0.2 });

function materialOf({ after, colour }: Shape): MeshStandardMaterial {
  if (!colour) return after === 0 ? JOINT : BODY;
  const [red, green, blue, opacity] = colour;
  const color = new Color().setRGB(red, green, blue, LinearSRGBColorSpace);
  return new MeshStandardMaterial({ color, opacity, transparent: opacity < 1, roughness: 0.5, metalness: 0.1 });
}

function ghostly({ colour, opacity }: { colour: ColorRepresentation; opacity: number }): MeshStandardMaterial {
  return new MeshStandardMaterial({ color: colour, transparent: true, opacity, depthWrite: false });
}
