// Clicks into the view, which are no drags, and what they hit.
import { Raycaster, Vector2 } from 'three';
import type { Camera, Object3D } from 'three';

const STILL = 4; // pixels; who moves further drags

export function listenToClicks(canvas: HTMLCanvasElement, onClick: (event: PointerEvent) => void): void {
  canvas.addEventListener('pointerdown', (down) => {
    const up = (event: PointerEvent): void => {
      if (Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) < STILL) onClick(event);
    };
    canvas.addEventListener('pointerup', up, { once: true });
  });
}

// The number of the foremost instance under the pointer.
export function instanceAt(event: PointerEvent, canvas: HTMLCanvasElement, camera: Camera, objects: Object3D[]): number | undefined {
  const box = canvas.getBoundingClientRect();
  const at = new Vector2((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
  const ray = new Raycaster();
  ray.setFromCamera(at, camera);
  return ray.intersectObjects(objects).find(({ instanceId }) => instanceId !== undefined)?.instanceId;
}
