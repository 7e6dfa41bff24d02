// Keys that work everywhere but in fields: space plays, Ctrl+Z and Ctrl+Y undo and redo, Ctrl+Enter plans.
import { redo, undo } from './actions';
import { planNow } from './planning';
import { togglePlaying } from './playback';

const FIELDS = 'input, textarea, select';

export function listenToKeys(): void {
  addEventListener('keydown', (event) => {
    const target = event.target as Element;
    const isText = target.matches(FIELDS) && !target.matches('[type=range], [type=checkbox]');
    const withControl = event.ctrlKey || event.metaKey;
    if (withControl && event.key === 'Enter') void planNow();
    else if (isText) return;
    else if (withControl && event.key.toLowerCase() === 'z') (event.shiftKey ? redo : undo)();
    else if (withControl && event.key.toLowerCase() === 'y') redo();
    else if (event.key === ' ' && !target.matches('button, a, [type=checkbox]')) togglePlaying();
    else return;
    event.preventDefault();
  });
}
