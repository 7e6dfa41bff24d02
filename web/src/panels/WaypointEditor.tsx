// The form of the chosen waypoint: where it is, how the robot gets there, how it passes.
import type { PlanRequest, PoseWaypoint, RelativeWaypoint, Robot } from '../service/types';
import { unitOf } from '../plan/units';
import { edit, endSketch, sketch } from '../state/draft';
import { draft } from '../state/store';
import { texts } from '../texts';
import { Configurations } from './Configurations';
import { Choice, NumberField, VectorField } from './fields';
import { Options } from './Options';
import { MoreOfWaypoint } from './MoreFields';
import { PoseFields } from './PoseFields';
import { Way } from './Way';

interface EditorProps {
  request: PlanRequest;
  robot: Robot;
  index: number;
}

export function WaypointEditor({ request, robot, index }: EditorProps) {
  const waypoint = draft.value ?? request.waypoints[index];
  if (!waypoint) return null;
  return (
    <form class="editor" aria-label={texts.editor.label} onSubmit={(event) => event.preventDefault()} onFocusOut={endSketch}>
      <h3>{texts.waypoints.number(index)}</h3>
      {waypoint.kind !== 'named' && (
        <span class="field wide">
          <label for="waypoint-name">{texts.editor.name}</label>
          <input
            id="waypoint-name"
            value={waypoint.name ?? ''}
            onChange={(event) => edit({ name: event.currentTarget.value || undefined })}
          />
        </span>
      )}
      {waypoint.kind === 'joint' && <Joints robot={robot} position={waypoint.position} />}
      {waypoint.kind === 'pose' && (
        <PoseFields pose={waypoint.pose} onTyping={(pose) => sketch({ pose })} onPose={(pose) => edit({ pose })} />
      )}
      {waypoint.kind === 'pose' && <Frame waypoint={waypoint} frames={Object.keys(request.frames ?? {})} />}
      {waypoint.kind === 'pose' && <Configurations request={request} robot={robot} index={index} />}
      {waypoint.kind === 'relative' && <Relative waypoint={waypoint} />}
      {waypoint.kind === 'any_of' && <Options goalSet={waypoint} index={index} />}
      {waypoint.kind !== 'any_of' && <Way request={request} robot={robot} index={index} change={edit} />}
      <MoreOfWaypoint request={request} robot={robot} index={index} />
    </form>
  );
}

interface JointsProps {
  robot: Robot;
  position: readonly number[];
}

function Joints({ robot, position }: JointsProps) {
  return (
    <div class="joints">
      {robot.joints.map((joint, index) => {
        const value = position[index] ?? 0;
        const [low, high] = [joint.lower ?? -Math.PI, joint.upper ?? Math.PI];
        const changed = (next: number): object => ({ position: position.map((old, i) => (i === index ? next : old)) });
        return (
          <div key={joint.name} class="joint">
            <NumberField
              label={joint.name}
              unit={unitOf(joint, 'position')}
              value={value}
              onTyping={(next) => next !== undefined && sketch(changed(next))}
              onValue={(next) => next !== undefined && edit(changed(next))}
            />
            <input
              type="range"
              aria-label={joint.name}
              min={low}
              max={high}
              step={(high - low) / 1000}
              value={value}
              onInput={(event) => sketch(changed(event.currentTarget.valueAsNumber))}
              onChange={(event) => edit(changed(event.currentTarget.valueAsNumber))}
            />
          </div>
        );
      })}
    </div>
  );
}

function Frame({ waypoint, frames }: { waypoint: PoseWaypoint; frames: readonly string[] }) {
  if (frames.length === 0) return null;
  return (
    <Choice
      label={texts.editor.frameOfPose}
      value={waypoint.frame ?? ''}
      options={[['', texts.editor.baseFrame] as const, ...frames.map((name) => [name, name] as const)]}
      onValue={(frame) => edit({ frame: frame || undefined })}
    />
  );
}

function Relative({ waypoint }: { waypoint: RelativeWaypoint }) {
  const { move } = waypoint;
  return (
    <>
      {move.kind === 'cartesian' ? (
        <VectorField
          label={texts.editor.translation}
          unit="m"
          names={['x', 'y', 'z']}
          values={move.translation}
          onValues={(translation) => edit({ move: { ...move, translation } })}
        />
      ) : (
        <p class="hint">{texts.editor.asJson}</p>
      )}
      <Choice
        label={texts.editor.frame}
        value={waypoint.frame}
        options={[['tool', texts.editor.frames.tool] as const, ['base', texts.editor.frames.base] as const]}
        onValue={(frame) => edit({ frame })}
      />
    </>
  );
}
