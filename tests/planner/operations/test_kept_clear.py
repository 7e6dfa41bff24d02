"""Results of operations are proved clear of a scene: checked against dense samples."""

from __future__ import annotations

import numpy as np
import pytest

import planner
from planner.errors import Collision
from planner.operations import kept_clear, retime_trajectory, reverse_trajectory
from planner.scene import Scene, SceneObject
from planner.shapes import Sphere
from planner.spatial import Pose
from tests.planner.capsule_arm import CAPSULE_ARM
from tests.planner.scene.brute_force import least_distance

ARM = CAPSULE_ARM
POINTS = [[-0.6, -0.9, 1.2, 0.0, 0.8, 0.0], [0.0, -1.2, 1.4, 0.0, 0.8, 0.0], [0.6, -0.9, 1.2, 0.0, 0.8, 0.0]]


def beside_the_way(gap: float) -> Scene:
    """Return a ball above the tool at the middle point, with this clearance beyond its margin."""
    tool = planner.tool_pose(ARM, POINTS[1]).position
    ball = SceneObject("ball", [Sphere(0.1)], Pose(np.add(tool, [0.6, 0.0, 0.0])))
    room = least_distance(ARM, Scene([ball]), retime_trajectory(ARM, np.array(POINTS), planner.Quintic()).trajectory)
    return Scene([ball], margin=room - gap)


@pytest.mark.parametrize("gap", [2e-3, -2e-3])
def test_clearances_of_operations_are_those_of_dense_samples(gap: float) -> None:
    """A trajectory through smoothed points and its reverse: refused, or proved within 2 mm of dense samples."""
    scene = beside_the_way(gap)
    retimed = retime_trajectory(ARM, np.array(POINTS), planner.Quintic())
    for done in (retimed, reverse_trajectory(ARM, retimed.trajectory)):
        if gap < 0.0:
            with pytest.raises(Collision):
                kept_clear(done, scene, self_collision=False)
            continue
        clearance = kept_clear(done, scene, self_collision=False).certificate.clearance
        assert clearance is not None and clearance.scene is not None
        truth = least_distance(ARM, scene, done.trajectory)
        assert clearance.scene.lower <= truth + 1e-6 and truth - 2e-3 <= clearance.scene.lower
        assert kept_clear(done, None) is done
