// A pose as a person writes it: mm, roll, pitch and yaw in degrees.
import { degrees, radians } from '../plan/units';
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
  const moved = (values: number[]): Pose => ({ ...pose, position: values.map((value) => value / 1000) });
  const turned = (values: number[]): Pose => {
    const xyzw = quaternionOfRpy(values.map(radians) as Vector);
    return { ...pose, orientation: { kind: 'quaternion', xyzw } };
  };
  return (
    <>
      <VectorField
        label={texts.editor.position}
        names={['x', 'y', 'z']}
        values={pose.position.map((value) => value * 1000)}
        onTyping={onTyping && ((values) => onTyping(moved(values)))}
        onValues={(values) => onPose(moved(values))}
      />
      {turn ? (
        <VectorField
          label={texts.editor.orientation}
          names={texts.jog.axes.slice(3)}
          values={rpyOfQuaternion(turn).map(degrees)}
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
