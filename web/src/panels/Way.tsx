// How the robot gets to the chosen waypoint and how it passes.
import { motionOf, MOTIONS } from '../request/motions';
import { endsOf } from '../state/ends';
import { halfWay } from '../state/half_way';
import type { Limits, PlanRequest, Robot, Transition } from '../service/types';
import { texts } from '../texts';
import { Choice, NumberField } from './fields';
import { FreeFields } from './FreeFields';
import { KeptFields } from './KeptFields';

interface WayProps {
  request: PlanRequest;
  robot: Robot;
  index: number;
  change: (changes: object) => void;
}

export function Way({ request, robot, index, change }: WayProps) {
  const waypoint = request.waypoints[index]!;
  const { motion, transition, limits } = waypoint;
  const isLast = index === request.waypoints.length - 1;
  const limit = (changes: Limits): void => {
    const next = Object.entries<unknown>({ ...limits, ...changes }).filter(([, value]) => value !== undefined);
    change({ limits: next.length > 0 ? Object.fromEntries(next) : undefined });
  };
  return (
    <div class="way">
      {index > 0 && (
        <>
          <Choice
            label={texts.editor.motion}
            value={motion?.kind ?? 'joint'}
            options={MOTIONS.map((kind) => [kind, texts.editor.motions[kind]] as const)}
            onValue={(kind) => change({ motion: motionOf(kind, halfWay(request, robot, index)) })}
          />
          {motion?.kind === 'free' && <FreeFields motion={motion} index={index} change={(changed) => change({ motion: changed })} />}
          {motion?.kind === 'free' && (
            <KeptFields motion={motion} ends={() => endsOf(request, robot, index)} change={(changed) => change({ motion: changed })} />
          )}
          <NumberField
            label={texts.editor.duration}
            unit="s"
            value={waypoint.duration}
            placeholder={texts.editor.fast}
            min={0}
            onValue={(duration) => change({ duration })}
          />
          <NumberField
            label={texts.editor.toolSpeed}
            unit="m/s"
            value={limits?.tcp_linear_velocity}
            placeholder={texts.editor.none}
            min={0}
            onValue={(value) => limit({ tcp_linear_velocity: value })}
          />
          <NumberField
            label={texts.editor.velocityScale}
            unit="%"
            value={limits?.velocity_scale}
            placeholder="100"
            min={0}
            max={1}
            onValue={(value) => limit({ velocity_scale: value })}
          />
        </>
      )}
      {index > 0 && !isLast && (
        <Choice
          label={texts.editor.transition}
          value={transition?.kind ?? 'stop'}
          options={TRANSITIONS}
          onValue={(kind) => change({ transition: transitionOf(kind), ...(kind === 'stop' ? {} : { dwell: undefined }) })}
        />
      )}
      {transition?.kind === 'blend' && (
        <NumberField
          label={texts.editor.radius}
          unit="m"
          value={transition.radius}
          min={0}
          onValue={(radius) => radius && change({ transition: { kind: 'blend', radius } })}
        />
      )}
      {(transition?.kind ?? 'stop') === 'stop' && (
        <NumberField
          label={texts.editor.dwell}
          unit="s"
          value={waypoint.dwell}
          placeholder="0"
          min={0}
          onValue={(dwell) => change({ dwell })}
        />
      )}
    </div>
  );
}

const TRANSITIONS = (['stop', 'through', 'blend'] as const).map((kind) => [kind, texts.editor.transitions[kind]] as const);

function transitionOf(kind: Transition['kind']): Transition | undefined {
  if (kind === 'stop') return undefined;
  return kind === 'through' ? { kind } : { kind: 'blend', radius: 0.02 };
}
