"""A quick look at whether postures collide, which spares a proof where they do. Its `no` proves nothing.

Pinocchio and coal look at a posture in some 20 microseconds, where a proof takes a millisecond for its many postures.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from planner.scene import CONTACT_TOLERANCE
from planner.shapes import Shape

if TYPE_CHECKING:
    from planner.robots import Robot
    from planner.scene import CollisionChecker
    from planner.spatial import FloatArray


class QuickCheck:
    """Looks for collisions at single postures; clusters of points it does not see."""

    def __init__(self, robot: Robot, checker: CollisionChecker, room: float = 0.0) -> None:
        """Prepare the checks.

        Args:
            robot: The arm.
            checker: The arm and what is around it.
            room: How much more than their margins pairs have to keep, m.
        """
        # Everything that the manager points into is kept here: it is no owner of what it is made of.
        self._model, self._data = robot.model, robot.model.createData()
        self._geometry = pin.GeometryModel()
        for number, piece in enumerate(checker.bodies.pieces):
            self._add(f"body {number}", piece.joint, piece.shape, piece.rotation, piece.translation)
        seen = [number for number, obstacle in enumerate(checker.obstacles.all) if isinstance(obstacle.shape, Shape)]
        for number in seen:
            obstacle = checker.obstacles.all[number]
            if isinstance(obstacle.shape, Shape):
                self._add(f"obstacle {number}", 0, obstacle.shape, obstacle.rotation, obstacle.translation)
        bodies, count = len(checker.bodies.pieces), self._geometry.ngeoms
        margins = np.full((count, count), -np.inf)
        margins[np.minimum(checker.first, checker.second), np.maximum(checker.first, checker.second)] = 0.0
        margins[:bodies, bodies:] = checker.margins[:, seen]
        self._geometry.setCollisionPairs(np.isfinite(margins))
        self._request = self._geometry.createData()
        for pair, request in zip(self._geometry.collisionPairs, self._request.collisionRequests, strict=True):
            request.security_margin = margins[pair.first, pair.second] + room - CONTACT_TOLERANCE
        self._manager = pin.BroadPhaseManager_DynamicAABBTreeCollisionManager(
            self._model, self._geometry, self._request
        )

    def sees_collision(self, positions: FloatArray) -> bool:
        """Whether a collision, or less than a margin, is seen at any of some joint positions (positions, joints)."""
        return any(
            pin.computeCollisions(self._model, self._data, self._manager, position, True) for position in positions
        )

    def _add(self, name: str, joint: int, shape: Shape, rotation: FloatArray, translation: FloatArray) -> None:
        placement = pin.SE3(rotation, np.asarray(translation, dtype=np.float64))
        self._geometry.addGeometryObject(pin.GeometryObject(name, joint, placement, shape.geometry))
