// The visual meshes of a robot, from the binary glTF of the service: below the node of a link stand its meshes.
import { Matrix4, Quaternion, Vector3 } from 'three';
import type { Robot } from '../service/types';
import { matrixOf } from './chain';
import type { VisualShape } from './shapes';

const MAGIC = 0x46546c67; // glTF
const HEADER = 12; // bytes
const CHUNK = 8; // bytes before the content of a part

interface Node {
  name?: string;
  translation?: number[];
  rotation?: number[];
  mesh?: number;
  children?: number[];
}

interface Gltf {
  nodes: Node[];
  meshes?: { primitives: { attributes: { POSITION: number }; indices: number; material: number }[] }[];
  materials?: { name?: string; pbrMetallicRoughness: { baseColorFactor: [number, number, number, number] } }[];
  accessors?: { bufferView: number; count: number }[];
  bufferViews?: { byteOffset: number; byteLength: number }[];
}

// The links are those of the robot, wherever its joints are: a derived robot has the meshes of the other one.
export function visualShapes(robot: Robot, file: ArrayBuffer): VisualShape[] {
  const head = new DataView(file);
  if (file.byteLength < HEADER + CHUNK || head.getUint32(0, true) !== MAGIC) return [];
  const length = head.getUint32(HEADER, true);
  const text = new Uint8Array(file, HEADER + CHUNK, length);
  const { nodes, meshes = [], materials = [], accessors = [], bufferViews = [] } = JSON.parse(new TextDecoder().decode(text)) as Gltf;
  const start = HEADER + CHUNK + length + CHUNK;
  const place = (accessor: number): [number, number] => {
    const view = bufferViews[accessors[accessor]!.bufferView]!;
    return [start + view.byteOffset, view.byteLength / 4];
  };
  return nodes.flatMap(({ name: link = '', children = [] }) => {
    const placement = robot.placements.find(({ frame }) => frame === link);
    return children.flatMap((child): VisualShape[] => {
      const node = nodes[child]!;
      const primitive = node.mesh === undefined ? undefined : meshes[node.mesh]?.primitives[0];
      if (!placement || !primitive) return [];
      const material = materials[primitive.material];
      return [
        {
          link,
          after: placement.after,
          matrix: matrixOf(placement).multiply(localOf(node)),
          form: {
            kind: 'triangles',
            vertices: new Float32Array(file, ...place(primitive.attributes.POSITION)),
            faces: new Uint32Array(file, ...place(primitive.indices)),
          },
          colour: material && !material.name ? material.pbrMetallicRoughness.baseColorFactor : undefined, // named: none of its own
        },
      ];
    });
  });
}

function localOf({ translation = [0, 0, 0], rotation = [0, 0, 0, 1] }: Node): Matrix4 {
  return new Matrix4().compose(new Vector3().fromArray(translation), new Quaternion().fromArray(rotation), new Vector3(1, 1, 1));
}
