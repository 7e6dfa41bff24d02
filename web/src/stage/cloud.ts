// Where the tool can be, as a cloud of points; it may be cut open, so that what is nearer to the viewer than its middle goes.
import { BufferGeometry, Float32BufferAttribute, Plane, Points, PointsMaterial, Vector3 } from 'three';
import type { Camera } from 'three';
import type { WorkspaceAnswer } from '../service/types';
import { shareColour } from './colours';

const SIZE = 3; // pixels
const OPACITY = 0.6;
const ROUND = '#include <clipping_planes_fragment>\nif (length(gl_PointCoord - 0.5) > 0.5) discard;';

export class Cloud {
  readonly object: Points;
  private readonly plane = new Plane();
  private readonly middle: Vector3; // in the base frame

  // The colours go from the least distance from the base's origin to the largest.
  constructor({ points, minimum_reach, maximum_reach }: WorkspaceAnswer, isCut: boolean, dark: boolean) {
    const [least, most] = [minimum_reach.value, maximum_reach.value];
    const shares = points.map((point) => (Math.hypot(...point) - least) / Math.max(most - least, 1e-9));
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new Float32BufferAttribute(points.flat(), 3));
    geometry.setAttribute(
      'color',
      new Float32BufferAttribute(
        shares.flatMap((share) => shareColour(share, dark).toArray()),
        3,
      ),
    );
    geometry.computeBoundingBox();
    this.middle = geometry.boundingBox!.getCenter(new Vector3());
    const material = new PointsMaterial({
      size: SIZE * Math.min(devicePixelRatio, 2),
      sizeAttenuation: false,
      vertexColors: true,
      transparent: true,
      opacity: OPACITY,
      depthWrite: false,
    });
    material.clippingPlanes = isCut ? [this.plane] : null;
    material.onBeforeCompile = (shader) =>
      (shader.fragmentShader = shader.fragmentShader.replace('#include <clipping_planes_fragment>', ROUND));
    this.object = new Points(geometry, material);
  }

  // Turns the cut towards the viewer.
  face(camera: Camera): void {
    const middle = this.object.localToWorld(this.middle.clone());
    this.plane.setFromNormalAndCoplanarPoint(camera.getWorldDirection(new Vector3()), middle);
  }
}
