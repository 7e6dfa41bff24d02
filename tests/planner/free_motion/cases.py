"""An arm, two sides of a wall, and the wall between them."""

from __future__ import annotations

import numpy as np

from planner.scene import SceneObject
from planner.shapes import Box
from planner.spatial import Pose
from tests.planner.capsule_arm import CAPSULE_ARM

ARM = CAPSULE_ARM
LEFT = np.array([0.9, -0.9, 1.2, 0.0, 0.8, 0.0])
RIGHT = np.array([-0.9, *LEFT[1:]])

WALL = SceneObject("wall", [Box([0.8, 0.1, 1.6])], Pose([1.3, 0.0, 0.8]))
"""What stands between the two, in the plane of their symmetry."""
