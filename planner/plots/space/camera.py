"""How points in space become points of a picture, and from where they are seen."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.spatial import FloatArray


@dataclass(frozen=True, eq=False)
class Camera:
    """A projection onto a picture, in perspective or along straight parallel lines.

    Attributes:
        matrix: (3, 4), takes homogeneous coordinates in the base frame, m, to those of the picture, to the right and
            up; the third is positive of what is in front of the camera.
    """

    matrix: FloatArray

    @classmethod
    def onto(cls, columns: tuple[int, ...]) -> Camera:
        """Make the camera that shows two coordinates, to the right and up."""
        matrix = np.zeros((3, 4))
        matrix[[0, 1], columns] = 1.0
        matrix[2, 3] = 1.0
        return cls(matrix)

    @cached_property
    def eye(self) -> FloatArray:
        """The point (4,) that it looks from, homogeneous: the last is 0 of parallel lines, coming from that direction.

        It is the one point that the matrix takes to nothing (Hartley and Zisserman, Multiple View Geometry in Computer
        Vision, section 6.2.4), by Cramer's rule.
        """
        minors = [np.linalg.det(np.delete(self.matrix, column, axis=1)) for column in range(4)]
        eye = np.array(minors) * [1.0, -1.0, 1.0, -1.0]
        scale = np.linalg.norm(eye[:3])
        if abs(eye[3]) <= 1e-12 * scale:
            return np.append(eye[:3] / scale, 0.0)
        return np.asarray(eye / eye[3], dtype=np.float64)

    def project(self, points: FloatArray) -> FloatArray:
        """Return where points (N, 3), m, are in the picture (N, 2)."""
        seen = points @ self.matrix[:, :3].T + self.matrix[:, 3]
        return np.asarray(seen[:, :2] / seen[:, 2:], dtype=np.float64)

    def sides(self, normals: FloatArray, offsets: FloatArray) -> FloatArray:
        """Tell on which side of planes n . x = d the eye is: positive on that to which n points.

        Args:
            normals: Unit vectors n (N, 3).
            offsets: d (N,), m.

        Returns:
            (N,), the distance of an eye that is somewhere, m; of one that is infinitely far the cosine between n and
            the line of sight.
        """
        sides: FloatArray = normals @ self.eye[:3] - self.eye[3] * offsets
        return sides

    def nearness(self, point: FloatArray) -> float:
        """Return how near the eye a point (3,), m, is, m, in comparison with other points."""
        if self.eye[3] == 0.0:
            return float(self.eye[:3] @ point)
        return -float(np.linalg.norm(self.eye[:3] - point))
