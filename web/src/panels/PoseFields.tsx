// A pose as a person writes it: its position, roll, pitch and yaw.
import { quaternionOf, quaternionOfRpy, rpyOfQuaternion } from '../request/rotations';
import type { Quaternion, Vector } from '../request/rotations';
import type { Pose } from '../service/types';
import { texts } from '../texts';
import { VectorField } from './fields';

interface PoseProps {
  pose: Pose;
  onTyping?: (pose: Pose) => void;
  onPose: (pose: Pose) => void;
}

export function PoseFields({ pose, onTyping, onPose }: PoseProps) {
  const turn = quaternionOf(pose.orientation);
  const moved = (values: number[]): Pose => ({ ...pose, position: values });
  const turned = (xyzw: Quaternion): Pose => ({ ...pose, orientation: { kind: 'quaternion', xyzw } });
  return (
    <>
      <VectorField
        label={texts.editor.position}
        unit="m"
        names={['x', 'y', 'z']}
        values={pose.position}
        onTyping={onTyping && ((values) => onTyping(moved(values)))}
        onValues={(values) => onPose(moved(values))}
      />
      {turn ? (
        <TurnFields turn={turn} onTyping={onTyping && ((next) => onTyping(turned(next)))} onTurn={(next) => onPose(turned(next))} />
      ) : (
        <p class="hint">
          {texts.editor.anyOrientation}{' '}
          <button type="button" class="link" onClick={() => onPose(turned([0, 0, 0, 1]))}>
            {texts.editor.orient}
          </button>
        </p>
      )}
    </>
  );
}

interface TurnProps {
  turn: Quaternion;
  onTyping?: (turn: Quaternion) => void;
  onTurn: (turn: Quaternion) => void;
}

// An orientation as roll, pitch and yaw.
export function TurnFields({ turn, onTyping, onTurn }: TurnProps) {
  return (
    <VectorField
      label={texts.editor.orientation}
      unit="rad"
      names={texts.jog.axes.slice(3)}
      values={rpyOfQuaternion(turn)}
      onTyping={onTyping && ((values) => onTyping(quaternionOfRpy(values as Vector)))}
      onValues={(values) => onTurn(quaternionOfRpy(values as Vector))}
    />
  );
}
