// Objects of the scene from a person's files.
import { signal } from '@preact/signals';
import { addObject } from './scene_editing';
import { idOf } from './uploading';
import type { Fault } from '../scene/import';

export const importFault = signal<(Fault & { name: string }) | null>(null);

// Adds the object in a file whose numbers are so many m each; the loaders are fetched when somebody imports.
export async function importObject(file: File, metres: number): Promise<void> {
  const { shapeOfFile } = await import('../scene/import');
  const found = shapeOfFile(file.name, await file.arrayBuffer(), metres);
  importFault.value = 'fault' in found ? { name: file.name, ...found } : null;
  if (!('fault' in found)) addObject(idOf(file.name) || 'object', found);
}
