// How fast the robot may be near objects of the scene.
import { useState } from 'preact/hooks';
import { aboutObject, withAnotherZone, withoutZone, withZone, withZones, zonesOf } from '../request/zones';
import type { PlanRequest, SpeedZone } from '../service/types';
import { show } from '../state/actions';
import { scene } from '../state/surroundings';
import { texts } from '../texts';
import { NumberField } from './fields';

const LEAST = 0.001; // m and m/s, of the service

export function SpeedZones({ request }: { request: PlanRequest }) {
  const zones = zonesOf(request);
  return (
    <section class="zones" aria-label={texts.zones.label}>
      <h3>{texts.zones.label}</h3>
      {zones.map((zone, index) => (
        <Zone key={index} request={request} zone={zone} index={index} />
      ))}
      <p class="hint">{texts.zones.hint}</p>
      <button type="button" onClick={() => show(withAnotherZone(request))}>
        {texts.zones.add}
      </button>
    </section>
  );
}

interface ZoneProps {
  request: PlanRequest;
  zone: SpeedZone;
  index: number;
}

function Zone({ request, zone, index }: ZoneProps) {
  const [isOpen, setOpen] = useState(false);
  const turn = (id: string, isIn: boolean): void => {
    show(
      withZones(
        request,
        zonesOf(request).map((other, i) => (i === index ? aboutObject(zone, id, isIn) : other)),
      ),
    );
  };
  return (
    <fieldset class="zone">
      <legend>{texts.zones.number(index)}</legend>
      <NumberField
        label={texts.zones.clearance}
        unit="m"
        value={zone.clearance}
        min={LEAST}
        onValue={(value) => value && show(withZone(request, index, { clearance: value }))}
      />
      <NumberField
        label={texts.zones.speed}
        unit="m/s"
        value={zone.speed}
        min={LEAST}
        onValue={(value) => value && show(withZone(request, index, { speed: value }))}
      />
      <button
        type="button"
        aria-label={texts.zones.remove(index)}
        title={texts.zones.remove(index)}
        onClick={() => show(withoutZone(request, index))}
      >
        ✕
      </button>
      <details onToggle={(event) => setOpen(event.currentTarget.open)}>
        <summary>{texts.zones.about(zone.objects ?? null)}</summary>
        {isOpen && <Objects zone={zone} turn={turn} />}
      </details>
    </fieldset>
  );
}

// Thousands of objects may stand in a scene: they are listed when somebody wants to choose among them.
function Objects({ zone, turn }: { zone: SpeedZone; turn: (id: string, isIn: boolean) => void }) {
  const ids = new Set([...(scene.value?.objects ?? []).map(({ id }) => id), ...(zone.objects ?? [])]);
  return (
    <ul>
      {[...ids].map((id) => (
        <li key={id}>
          <label>
            <input
              type="checkbox"
              checked={zone.objects?.includes(id) ?? false}
              onChange={(event) => turn(id, event.currentTarget.checked)}
            />{' '}
            {id}
          </label>
        </li>
      ))}
    </ul>
  );
}
