// Pairs of links and objects that may touch.
import { useState } from 'preact/hooks';
import { withAllowedPair, withoutAllowedPair } from '../../request/scenes';
import type { Robot, Scene } from '../../service/types';
import { editScene } from '../../state/scene_editing';
import { texts } from '../../texts';
import { linksOf, NameChoice, Removable } from './names';

const MOST_NAMES = 500; // of objects: thousands may stand in a scene

export function AllowedPairs({ scene, robot }: { scene: Scene; robot: Robot }) {
  const [[first, second], choose] = useState(['', '']);
  const { objects = [], attached = [], allowed_pairs: pairs = [] } = scene;
  const names = [...linksOf(robot), ...attached.map(({ id }) => id), ...objects.slice(0, MOST_NAMES).map(({ id }) => id)];
  return (
    <fieldset class="group">
      <legend>{texts.scene.pairs}</legend>
      <ul class="names" aria-label={texts.scene.pairs}>
        {pairs.map((pair, index) => (
          <Removable key={pair.join(' ')} text={pair.join(' – ')} onRemove={() => editScene(withoutAllowedPair(scene, index))} />
        ))}
      </ul>
      <NameChoice label={texts.scene.first} names={names} value={first} onValue={(name) => choose([name, second])} />
      <NameChoice
        label={texts.scene.second}
        names={names.filter((name) => name !== first)}
        value={second}
        onValue={(name) => choose([first, name])}
      />
      <button
        type="button"
        disabled={!first || !second || first === second}
        onClick={() => {
          editScene(withAllowedPair(scene, first, second));
          choose(['', '']);
        }}
      >
        {texts.scene.allow}
      </button>
    </fieldset>
  );
}
