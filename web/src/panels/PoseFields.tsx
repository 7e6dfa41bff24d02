// A pose as a person writes it: its position, roll, pitch and yaw.
import { quaternionOf, quaternionOfRpy, rpyOfQuaternion } from '../request/rotations';
import type { Vector } from '../request/rotations';
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
  const turned = (values: number[]): Pose => {
    const xyzw = quaternionOfRpy(values as Vector);
    return { ...pose, orientation: { kind: 'quaternion', xyzw } };
  };
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
        <VectorField
          label={texts.editor.orientation}
          unit="rad"
          names={texts.jog.axes.slice(3)}
          values={rpyOfQuaternion(turn)}
          onTyping={onTyping && ((values) => onTyping(turned(values)))}
          onValues={(values) => onPose(turned(values))}
        />
      ) : (
        <p class="hint">
          {texts.editor.anyOrientation}{' '}
          <button type="button" class="link" onClick={() => onPose(turned([0, 0, 0]))}>
            {texts.editor.orient}
          </button>
        </p>
      )}
    </>
  );
}
