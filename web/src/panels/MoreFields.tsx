// All other fields: of the chosen waypoint with its motion, of the request, and of its back end.
import { useEffect, useState } from 'preact/hooks';
import { jointPosition } from '../state/jointPosition';
import { toolAt } from '../plan/tools';
import { toolPose } from '../robot/tool_pose';
import type { PlanRequest, Robot } from '../service/types';
import { edit } from '../state/draft';
import { show } from '../state/actions';
import { loadSchemas, schemas } from '../state/schemas';
import { texts } from '../texts';
import { alternatives, fits } from '../request/schema';
import { withoutEmpty } from '../request/edits';
import { ObjectFields } from './SchemaFields';
import type { Forms } from './SchemaFields';

const OF_WAYPOINT = ['name', 'position', 'pose', 'frame', 'move', 'motion', 'duration', 'dwell', 'transition', 'configuration'];
const OF_MOTION = ['optimise', 'time_budget', 'keep']; // beside the choice of the motion
const OF_REQUEST = ['robot', 'waypoints', 'scene', 'speed_zones', 'include', 'picture', 'backend'];

interface Props {
  request: PlanRequest;
  robot: Robot;
}

export function MoreOfWaypoint({ request, robot, index }: Props & { index: number }) {
  const waypoint = request.waypoints[index]!;
  const { motion } = waypoint;
  const hasShape = motion?.kind === 'circular' || motion?.kind === 'polyline' || motion?.kind === 'spline';
  return (
    <More key={`${index} ${hasShape}`} label={texts.fields.ofWaypoint} isOpen={hasShape}>
      {() => (
        <>
          {motion && (
            <Options
              name="Motion"
              value={motion}
              skip={OF_MOTION}
              forms={formsOf(request, robot, index)}
              onValue={(next) => edit({ motion: next })}
            />
          )}
          <Options
            name="Waypoint"
            value={waypoint}
            skip={OF_WAYPOINT}
            forms={formsOf(request, robot, index)}
            onValue={(next) => edit({ ...cleared(waypoint), ...next })}
          />
        </>
      )}
    </More>
  );
}

export function MoreOfRequest({ request, robot }: Props) {
  const forms = (): Forms => formsOf(request, robot, 0);
  const { backend } = request;
  return (
    <More label={texts.fields.ofRequest}>
      {() => (
        <>
          {backend && (
            <fieldset class="group">
              <legend>{texts.fields.ofBackend(backend.kind)}</legend>
              <Options
                name="Backend"
                value={backend}
                forms={forms()}
                onValue={(next) => show({ ...request, backend: next as typeof backend })}
              />
            </fieldset>
          )}
          <ObjectFields
            schema={schemas.value!.PlanRequest!}
            value={request}
            skip={OF_REQUEST}
            forms={forms()}
            onValue={(next) => show(next as PlanRequest)}
          />
        </>
      )}
    </More>
  );
}

// Undefined for every field, so that one that has gone goes.
function cleared(value: object): object {
  return Object.fromEntries(Object.keys(value).map((name) => [name, undefined]));
}

interface OptionsProps {
  name: string;
  value: { kind: string };
  skip?: readonly string[];
  forms: Forms;
  onValue: (value: object) => void;
}

// The fields of one kind of several.
function Options({ name, value, skip, forms, onValue }: OptionsProps) {
  const schema = alternatives(forms.schemas[name]!, forms.schemas).find((one) => fits(value, one));
  return schema ? (
    <ObjectFields schema={schema} value={value} skip={skip} forms={forms} onValue={(next) => onValue(withoutEmpty(next))} />
  ) : null;
}

function formsOf(request: PlanRequest, robot: Robot, index: number): Forms {
  const stands = jointPosition.peek().length === robot.joints.length;
  const pose = stands ? toolPose(robot, jointPosition.peek(), toolAt(request, index)) : { position: [0, 0, 0] };
  return { schemas: schemas.value!, joints: robot.joints, pose };
}

interface MoreProps {
  label: string;
  isOpen?: boolean;
  onClose?: () => void;
  children: () => preact.ComponentChildren;
}

// A part of a form that is made when somebody opens it, when the service has described its fields.
export function More({ label, isOpen = false, onClose, children }: MoreProps) {
  const [opened, setOpened] = useState(isOpen);
  useEffect(() => {
    if (opened) loadSchemas();
    else onClose?.();
  }, [opened]);
  return (
    <details class="more" open={opened} onToggle={(event) => setOpened(event.currentTarget.open)}>
      <summary>{label}</summary>
      {opened && (schemas.value ? <div class="more-fields">{children()}</div> : <p class="hint">{texts.workspace.asking}</p>)}
    </details>
  );
}
