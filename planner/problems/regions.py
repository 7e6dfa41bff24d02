"""What of a pose is left open: ranges along its axes and about them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Literal

import numpy as np

from planner.fields import FieldPath
from planner.spatial import FloatArray, Pose, rotation_x, rotation_y, rotation_z

Range = tuple[float, float]
"""The lower and the upper end of a range, m or rad."""

TURNS = {"rotation_x": rotation_x, "rotation_y": rotation_y, "rotation_z": rotation_z}
"""The rotation by an angle about each axis of a tolerance region."""


WIDEST = {"rotation_x": 1.5708, "rotation_y": 1.5708, "rotation_z": 3.1416}
"""The largest angles of a region, rad: a quarter turn and half a turn, rounded up to allow rounded input."""


@dataclass(frozen=True)
class Region:
    """A tolerance region: a pose T may become T D, D = Trans(x, y, z) Rx(rotation_x) Ry(rotation_y) Rz(rotation_z).

    D is in the axes of the pose. A coordinate without a range is 0.

    Attributes:
        x: Range of the shift along the x axis of the pose, m; None: fixed.
        y: Likewise.
        z: Likewise.
        rotation_x: Range of the turn about the x axis, rad, within a quarter of a turn to either side.
        rotation_y: Range of the turn about the y axis that x has turned, likewise.
        rotation_z: Range of the turn about the z axis of the tool itself, within half a turn to either side.
    """

    x: Range | None = None
    y: Range | None = None
    z: Range | None = None
    rotation_x: Range | None = None
    rotation_y: Range | None = None
    rotation_z: Range | None = None

    @property
    def ranges(self) -> dict[str, Range]:
        """The ranges that are set, by the names of their coordinates."""
        known = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: ends for name, ends in known.items() if ends is not None}

    def pose(self, requested: Pose, offsets: FloatArray) -> Pose:
        """Return the pose at offsets (ranges,) within the region of a requested pose with a rotation."""
        assert requested.rotation is not None  # noqa: S101 - the check of the problem refuses others
        shift, turn = np.zeros(3), np.eye(3)
        for name, offset in zip(self.ranges, offsets.tolist(), strict=True):
            if name in TURNS:
                turn = turn @ TURNS[name](offset)
            else:
                shift["xyz".index(name)] = offset
        return Pose(requested.position + requested.rotation @ shift, requested.rotation @ turn)

    def offsets(self, requested: Pose, reached: Pose) -> dict[str, float]:
        """Compute the offsets of a pose within the region of the requested pose, m or rad, by coordinate."""
        assert requested.rotation is not None and reached.rotation is not None  # noqa: S101 - as above
        x, y, z = (requested.rotation.T @ (reached.position - requested.position)).tolist()
        turn = requested.rotation.T @ reached.rotation
        found = {
            "x": x,
            "y": y,
            "z": z,
            "rotation_x": float(np.arctan2(-turn[1, 2], turn[2, 2])),
            "rotation_y": float(np.arcsin(np.clip(turn[0, 2], -1.0, 1.0))),
            "rotation_z": float(np.arctan2(-turn[0, 1], turn[0, 0])),
        }
        return {name: found[name] for name in self.ranges}


Free = Literal["rotation_z"] | Region
"""Type of a tolerance region: all turns about the tool's z axis, as of a drill or a round nozzle, or a region."""

ANY_TURN = Region(rotation_z=(-np.pi, np.pi))
"""The region of all turns about the tool's own z axis."""


def region_of(free: Free) -> Region:
    """Return the tolerance region."""
    return ANY_TURN if free == "rotation_z" else free


def region_faults(region: Region, field: FieldPath, *, with_zero: bool = False) -> Iterator[tuple[FieldPath, str]]:
    """Find the faults of a region in a field.

    Args:
        region: The tolerance region.
        field: Path of the field that has it.
        with_zero: Whether its ranges must contain 0.
    """
    if not region.ranges:
        yield field, "must have at least one range"
    for name, (lower, upper) in region.ranges.items():
        widest = WIDEST.get(name, np.inf)
        if not -np.inf < lower <= upper < np.inf:
            yield (*field, name), "must be a finite lower end and an upper end not below it"
        elif not -widest <= lower <= upper <= widest:
            yield (*field, name), f"must be within {widest:g} rad to either side"
        elif with_zero and not lower <= 0.0 <= upper:
            yield (*field, name), "must contain 0: the poses at the ends of a motion are fixed"
