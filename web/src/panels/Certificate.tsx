// The certificate as a table: what uses how much of its limit, where and when; and the warnings.
import type { Check, Clearance, Robot, SpeedZoneAnswer } from '../service/types';
import { estimateOf } from '../plan/estimates';
import { titleOf, unitOfQuantity } from '../plan/quantities';
import { lengthBelow, short, shownIn, written } from '../plan/units';
import { zoneNotes } from '../plan/zones';
import { fieldInWords, pointerOf } from '../request/changes';
import { warningOf } from '../request/messages';
import { seek } from '../state/playback';
import { robot, shownPlan } from '../state/store';
import { goToNearest, KINDS, marginOf } from '../state/surroundings';
import type { Kind } from '../state/surroundings';
import { texts } from '../texts';
import { Original } from './Message';

export function Certificate() {
  const [planned, arm] = [shownPlan.value, robot.value];
  if (!planned || !arm) return <p class="hint">{texts.result.none}</p>;
  const { certificate, warnings } = planned.answer;
  return (
    <>
      <table class="certificate">
        <thead>
          <tr>
            <th scope="col">{texts.result.quantity}</th>
            <th scope="col">{texts.result.used}</th>
            <th scope="col" class="number">
              {texts.result.peak}
            </th>
            <th scope="col" class="number">
              {texts.result.at}
            </th>
          </tr>
        </thead>
        <tbody>
          {certificate.checks.map((check) => (
            <Line key={`${check.quantity} ${check.joint ?? ''}`} check={check} arm={arm} />
          ))}
          {KINDS.map(
            (kind) => certificate.clearance?.[kind] && <ClearanceLine key={kind} kind={kind} clearance={certificate.clearance[kind]} />,
          )}
          {certificate.speed_zones?.map((zone, index) => (
            <ZoneLine key={index} zone={zone} />
          ))}
        </tbody>
      </table>
      <p class="hint">{texts.result.exact}</p>
      {warnings.length > 0 && (
        <>
          <h3>{texts.result.warnings}</h3>
          <ul class="warnings">
            {warnings.map((warning) => {
              const { text, original } = warningOf(warning);
              return (
                <li key={warning.code + warning.message}>
                  {text}
                  <Original texts={original === null ? [] : [original]} />
                </li>
              );
            })}
          </ul>
        </>
      )}
    </>
  );
}

// A waypoint as the page names it.
function place(index: number): string {
  return texts.waypoints.place(index, shownPlan.value?.request.waypoints[index]?.name ?? null);
}

function Line({ check, arm }: { check: Check; arm: Robot }) {
  const used = check.ratio === null ? null : Math.abs(check.ratio) * 100;
  return (
    <tr class={check.enforced ? '' : 'reported'} title={check.enforced ? '' : texts.result.reported}>
      <th scope="row">
        {titleOf(check.quantity)}
        {check.joint && <small>{check.joint}</small>}
        {!check.enforced && <small>{texts.result.reported}</small>}
        <small title={texts.result.methodTitles[check.method]}>{texts.result.methods[check.method]}</small>
        {check.relaxed_by && <small>{texts.result.relaxedBy(check.relaxed_by.map((name) => fieldInWords(pointerOf(name), place)))}</small>}
      </th>
      <td>{used === null ? '–' : <Meter used={used} enforced={check.enforced} />}</td>
      <td class="number figures">{figures(check, arm)}</td>
      <td class="number">
        <Moment time={check.time} onGo={() => seek(check.time)} />
      </td>
    </tr>
  );
}

// How near things come: the margin is what is asked of it, so that little is used of it where there is much room.
function ClearanceLine({ kind, clearance }: { kind: Kind; clearance: Clearance }) {
  const { lower, pair, time } = clearance;
  const estimate = estimateOf(clearance);
  const margin = kind === 'scene' && pair ? marginOf(pair) : 0;
  return (
    <tr>
      <th scope="row">
        {texts.clearance.names[kind]}
        {pair && <small>{texts.clearance.proved(pair)}</small>}
        {estimate && <small class="estimate">{estimate}</small>}
      </th>
      <td>{margin > 0 ? <Meter used={Math.min(100, (100 * margin) / lower)} enforced /> : '–'}</td>
      <td class="number">{texts.clearance.least(lengthBelow(lower), margin > 0 ? lengthBelow(margin) : null)}</td>
      <td class="number">{time !== null && <Moment time={time} onGo={() => goToNearest(kind)} />}</td>
    </tr>
  );
}

// How fast the robot is near objects, with what, and in which times it counts as near.
function ZoneLine({ zone }: { zone: SpeedZoneAnswer }) {
  const { clearance, peak, limit, ratio, time } = zone;
  const { about, fastest, exceeded } = zoneNotes(zone);
  const { factor } = shownIn('m/s');
  return (
    <tr>
      <th scope="row">
        {texts.zones.checked(written(clearance, 'm'))}
        <small>{about}</small>
        {fastest && <small>{fastest}</small>}
        {exceeded && <small class="exceeded">{exceeded}</small>}
      </th>
      <td>
        <Meter used={ratio * 100} enforced />
      </td>
      <td class="number figures">
        {short(peak * factor, 3)} / {written(limit, 'm/s', 3)}
      </td>
      <td class="number">{time === null ? '–' : <Moment time={time} onGo={() => seek(time)} />}</td>
    </tr>
  );
}

function Moment({ time, onGo }: { time: number; onGo: () => void }) {
  const text = `${time.toFixed(2)} s`;
  return (
    <button type="button" class="link" aria-label={texts.result.goTo(text)} onClick={onGo}>
      {text}
    </button>
  );
}

function Meter({ used, enforced }: { used: number; enforced: boolean }) {
  const grade = used > 100.01 ? (enforced ? 'over' : 'reported') : used > 95 ? 'full' : '';
  return (
    <span class={`meter ${grade}`}>
      <span class="bar" style={{ width: `${Math.min(used, 100)}%` }} />
      <span class="percent">{used < 9.95 ? used.toFixed(1) : Math.round(used)} %</span>
    </span>
  );
}

const NEGLIGIBLE = 5e-4; // the share of a limit that is shown as 0.0 %

function figures(check: Check, arm: Robot): string {
  const { peak, limit, bounded } = check;
  const joint = arm.joints.find(({ name }) => name === check.joint);
  const unit = unitOfQuantity(check.quantity, joint);
  const isRounding = limit !== null && Math.abs(peak) < NEGLIGIBLE * Math.abs(limit);
  const top = bounded ? short(isRounding ? 0 : peak * shownIn(unit).factor, 3) : texts.result.unbounded;
  return `${top} / ${limit === null ? texts.result.unlimited : written(limit, unit, 3).replaceAll(' ', '\u00a0')}`;
}
