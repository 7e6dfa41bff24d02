"""Names of the branches of the inverse kinematics: on which side shoulder, elbow and wrist are.

The terms come from Lee and Ziegler (1984). Each is the sign of one quantity that is zero only where the arm is
singular. So a name changes only at a singularity.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planner.kinematics.screws import Screws, meeting_point, screws_of
from planner.last_used import LastUsed
from planner.robots import Robot
from planner.robots.derived.standing import foot_at_zero
from planner.spatial import FloatArray
from planner.tolerances import SAME_SOLUTION

Shoulder = Literal["left", "right"]
Elbow = Literal["up", "down"]
Wrist = Literal["flip", "no_flip"]

SINGULAR_SIDE = 1e-6
"""Limit of singular joint positions: sine of the wrist angle, and distance of the wrist centre from axis 1 relative to
the arm's length.

It is about the accuracy of the inverse kinematics.
"""

NO_SIDES = np.array([SINGULAR_SIDE, 0.5 * SAME_SOLUTION, SINGULAR_SIDE])
"""The quantities of shoulder, m, elbow and wrist up to which a joint position is on neither side."""

PARALLEL_AXES_SINE = 1e-4
"""Sine of the angle of axes that count as parallel, and relative distance of axes that count as meeting.

Robot models give angles with few digits (1.5708).
"""

SHIFT = 0.03
"""Distance from a singular joint position that proves a configuration: an angle, rad, and a fraction of the arm's
length.

It exceeds the shift of singular joint positions by axes that are parallel or meet only up to `PARALLEL_AXES_SINE`,
some square root of it.
"""

POINT_JOINTS = 3
"""Number of joints of an arm that brings a point of the tool somewhere, however it is turned."""

POSE_JOINTS = 6
"""Number of joints of an arm that brings the tool to poses, in as many ways as have names."""

WRIST = 4
"""Index of the joint of such an arm that tells the sides of its wrist."""

BYTES = 1024
"""Memory of what tells the configurations of one robot apart, bytes, about."""

CONFIGURATION_CACHE_BYTES = 2**18
"""Largest memory of cached data of the robots last used, bytes."""

BEHIND = ("left", "down", "flip")
"""The names of shoulder, elbow and wrist where their quantities are negative."""

POSITIVE_NAMES = ("right", "up", "no_flip")
"""The names of shoulder, elbow and wrist where their quantities are positive."""


@dataclass(frozen=True)
class Configuration:
    """The branches of shoulder, elbow and wrist, either requested or of a joint position.

    - `shoulder`: the sign of x. It is a coordinate of the wrist centre in the frame of the first joint, along the
      normal of the first two axes. If axis 2 has an offset from axis 1, `right` is the side of axis 2 (KUKA's basic
      area; `left` is the overhead area). If the plane of the links has a larger offset than axis 2, as in a UR or a
      PUMA, the plane decides. `right` then means that the plane is to the right of axis 1, seen towards the wrist
      centre, with the arm upright. If axes and links meet, `right` is the side where the second joint, turned forwards,
      lifts the wrist centre. For a prismatic joint, it is the side where the joint extends.
    - `elbow`: `up` means that the elbow is above the line from axis 2 to the wrist centre (of a UR to axis 4). The view
      is from the side, with the wrist centre in front of axis 1, which points upwards, against gravity. Its quantity is
      the sine of the angle between the links.
    - `wrist`: `no_flip` means that sin(q5 - q5*) is positive. At q5*, axes 4, 5 and 6 lie in one plane. Of two such
      angles it is the one nearest to joint position 0, or -pi/2 of -pi/2 and pi/2. For most arms q5* = 0: `flip` is a
      fifth joint between -pi and 0.

    Examples:
        >>> import planner
        >>> robot = planner.load_robot("kuka_kr16_2")
        >>> planner.configurations(robot, [[0.0, -1.5, 1.5, 0.0, 0.5, 0.0]])
        [Configuration(shoulder='right', elbow='up', wrist='no_flip')]

    Attributes:
        shoulder: None in a request: either side. None of a joint position: it is singular and belongs to both sides, or
            the arm has no such name.
        elbow: Likewise; None at a singular shoulder, too.
        wrist: Likewise.
    """

    shoulder: Shoulder | None = None
    elbow: Elbow | None = None
    wrist: Wrist | None = None

    def __str__(self) -> str:
        """Return the names in words."""
        return ", ".join(f"{part} {name}" for part, name in self.names.items()) or "any configuration"

    @property
    def names(self) -> dict[str, str]:
        """The names by part, without None."""
        named = {field.name: getattr(self, field.name) for field in fields(self)}
        return {part: name for part, name in named.items() if name is not None}

    def of_parts(self, parts: Collection[str]) -> Configuration:
        """Return the names of some parts alone."""
        return replace(self, **{field.name: None for field in fields(self) if field.name not in parts})

    def allows(self, other: Configuration) -> bool:
        """Tell whether these requested names allow a joint position with the names `other`."""
        found = other.names
        return all(found.get(part, name) == name for part, name in self.names.items())


def configurations(robot: Robot, positions: ArrayLike) -> list[Configuration]:
    """Name the configurations of joint positions.

    Args:
        robot: The robot. For an arm with three joints, the tool's point replaces the wrist centre. External axes do not
            count; the upward direction for the elbow is taken with them at 0.
        positions: (N, joints), rad or m.
    """
    q = np.asarray(positions, dtype=np.float64).reshape(-1, robot.dof)
    named: list[Configuration] = []
    for row in sides_of(robot, q).tolist():
        names = [POSITIVE_NAMES[i] if side > 0.0 else BEHIND[i] if side < 0.0 else None for i, side in enumerate(row)]
        named.append(Configuration(*names))  # type: ignore[arg-type] # the names stand in the order of the fields
    return named


def sides_of(robot: Robot, positions: FloatArray) -> FloatArray:
    """Return the quantities (N, 3) of shoulder, elbow and wrist, whose signs are the configurations.

    At 0 the part is singular; NaN: the arm has no such name.
    """
    return _parts_of(robot).sides(_of_arm(robot, positions))


def named_parts(robot: Robot) -> tuple[str, ...]:
    """Return the parts, of shoulder, elbow and wrist, that distinguish the configurations of a robot."""
    sides = _parts_of(robot).sides(_of_arm(robot, robot.middle[None]))[0].tolist()
    return tuple(field.name for field, side in zip(fields(Configuration), sides, strict=True) if not np.isnan(side))


def keeps_configuration(robot: Robot, position: FloatArray, velocity: FloatArray, time: float) -> bool:
    """Tell whether no motion of a given time from a position changes the configuration or meets a singularity.

    A pose has at most one solution of a configuration, whole turns aside, if the arm has all three names and no slides:
    x and the wrist's angle are given up to their signs, and two links reach a point with the elbow up or down. So two
    solutions are further from each other than that.

    Args:
        robot: The robot; of one without all three names, with external axes or a fixed tool, nothing is known.
        position: (joints,), rad.
        velocity: (joints,), rad/s, that times are measured by: the norm of the joints' times counts.
        time: The longest, s.
    """
    parts = _parts_of(robot)
    if parts.links is None or parts.straight is None or robot.external_axes or robot.holds_workpiece:
        return False
    wrist = _off_half_turns(float(position[WRIST]) - parts.straight)
    return wrist > SHIFT + time * float(velocity[WRIST]) and parts.links.keep(position, velocity, time)


def straight_wrist(robot: Robot) -> float | None:
    """Return the position, rad, of joint `WRIST` with a singular wrist; None: it has no such wrist.

    Half turns from there it is singular, too. With external axes or a fixed tool the joint is another one, and the
    answer is None.
    """
    return None if robot.external_axes or robot.holds_workpiece else _parts_of(robot).straight


def in_configuration(robot: Robot, solutions: Iterable[FloatArray], wanted: Configuration) -> tuple[FloatArray, ...]:
    """Select the joint positions (joints,) that have a configuration, or belong to it and to another."""
    solutions = tuple(solutions)
    if not wanted.names or not solutions:
        return solutions
    found = configurations(robot, np.array(solutions))
    return tuple(q for q, configuration in zip(solutions, found, strict=True) if wanted.allows(configuration))


@dataclass(frozen=True, eq=False)
class _Links:
    """The links that move in the plane across axes 2 and 3, as complex numbers x + i z: x in front of the first axis.

    Attributes:
        offset: From axis 1 to axis 2, m.
        carried: (links,), m, at joint position 0: what joint 2 turns, what joints 2 and 3 turn, and so on.
        senses: (links,): 1, or -1 of a joint whose axis points the other way than that of joint 2.
        aside: Offset of the plane of the links from axis 1, m: to the right of it if x points forwards.
    """

    offset: complex
    carried: np.ndarray
    senses: FloatArray
    aside: float

    @classmethod
    def between(cls, screws: Screws, points: Sequence[FloatArray], up: FloatArray) -> _Links | None:
        """Return the links between points (3,), m: on axes 2, 3 and so on, then the wrist centre.

        Args:
            screws: The arm.
            points: Two or more.
            up: (3,), upwards; of a first axis that does not stand upright its own direction counts.

        Returns:
            None: their axes are not parallel, or the arm stands like a SCARA with all axes upright.
        """
        origin, (first, second), turning = screws.points[0], screws.axes[:2], screws.axes[1 : len(points)]
        upwards = -first if first @ up < -PARALLEL_AXES_SINE * np.linalg.norm(up) else first
        vertical = upwards - (upwards @ second) * second
        height = float(np.linalg.norm(vertical))
        if height <= PARALLEL_AXES_SINE or np.abs(np.cross(turning, second)).max() > PARALLEL_AXES_SINE:
            return None
        frame = (np.cross(vertical, second) + 1j * vertical) / height
        seen = (np.array(points) - origin) @ frame
        aside = float((points[-1] - origin) @ second)
        return cls(complex(seen[0]), np.diff(seen), np.sign(turning @ second), aside)

    @cached_property
    def length(self) -> float:
        """The length of all links, m."""
        return float(np.abs(self.carried).sum())

    @cached_property
    def right(self) -> float:
        """The sign of x where the shoulder is right."""
        radial, aside = self.offset.real, self.aside
        if max(abs(radial), abs(aside)) <= PARALLEL_AXES_SINE * self.length:
            return 1.0
        return float(np.sign(radial if abs(radial) >= abs(aside) else aside))

    def sides(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the quantities (N,) of shoulder, m, and elbow, without unit, for positions (N, joints)."""
        turned = np.cumsum(self.senses * positions[:, 1 : 1 + len(self.carried)], axis=1)
        links = self.carried * np.exp(1j * turned)
        x = self.offset.real + links.real.sum(axis=1)
        upper, fore = links[:, 0], links[:, 1]
        sine = (fore.conj() * upper).imag / abs(self.carried[0] * self.carried[1])
        shoulder = np.where(np.abs(x) > self.nowhere, x, 0.0)
        return self.right * shoulder, sine * np.sign(shoulder)

    @cached_property
    def nowhere(self) -> float:
        """The magnitude of x up to which the wrist centre is neither in front of axis 1 nor behind it, m.

        Beside the axis the two solutions come together there, and are one from `SAME_SOLUTION` on.
        """
        return max(SINGULAR_SIDE * self.length, 0.5 * SAME_SOLUTION * abs(self.aside))

    def keep(self, position: FloatArray, velocity: FloatArray, time: float) -> bool:
        """Tell whether shoulder and elbow keep their sides on every motion of a given time from a position.

        A revolute joint moves the links behind it by at most its angle times their length. By the inequality of
        Cauchy and Schwarz x changes by at most the time times the norm of the lengths carried times the velocities.

        Args:
            position: (joints,), rad.
            velocity: (joints,), rad/s, that times are measured by: the norm of the joints' times counts.
            time: The longest, s.
        """
        turned = np.cumsum(self.senses * position[1 : 1 + len(self.carried)])
        x = self.offset.real + float((self.carried * np.exp(1j * turned)).real.sum())
        lengths = np.cumsum(np.abs(self.carried)[::-1])[::-1]
        change = time * float(np.linalg.norm(lengths * velocity[1 : 1 + len(lengths)]))
        bend = cmath.phase(self.carried[1] / self.carried[0]) + float(self.senses[1] * position[2])
        return abs(x) > SHIFT * self.length + change and _off_half_turns(bend) > SHIFT + time * float(velocity[2])


def _off_half_turns(angle: float) -> float:
    """Return the distance of an angle from the nearest multiple of pi, rad."""
    return abs(math.remainder(angle, math.pi))


class _Slide(NamedTuple):
    """Two prismatic joints behind a revolute one, and the distance of the wrist centre in front of its axis.

    Attributes:
        offset: This distance at joint position 0, m.
        ways: (2,): change of the distance with each joint.
    """

    offset: float
    ways: FloatArray

    @classmethod
    def behind(cls, screws: Screws, centre: FloatArray) -> _Slide | None:
        """Return the slides of joints 2 and 3 that bring a point (3,), m, somewhere; None: neither goes outwards."""
        slides, rises = screws.axes[1:3], screws.axes[1:3] @ screws.axes[0]
        outwards = rises[0] * slides[1] - rises[1] * slides[0]
        length = float(np.linalg.norm(outwards)) * np.sign(rises[0] or 1.0)
        if abs(length) <= PARALLEL_AXES_SINE:
            return None
        outwards = outwards / length
        return cls(float((centre - screws.points[0]) @ outwards), slides @ outwards)


class _Parts(NamedTuple):
    """What tells the configurations of one robot apart.

    Attributes:
        links: The links of shoulder and elbow, if they move in a plane.
        slide: The slides in their place, if there are.
        straight: The fifth joint at which the wrist is singular, rad; None: the arm has no wrist.
    """

    links: _Links | None = None
    slide: _Slide | None = None
    straight: float | None = None

    def sides(self, positions: FloatArray) -> FloatArray:
        """Return the quantities (N, 3) of shoulder, elbow and wrist; 0: singular; NaN: the arm has none."""
        sides = np.full((len(positions), 3), np.nan)
        if self.links is not None:
            sides[:, 0], sides[:, 1] = self.links.sides(positions)
        if self.slide is not None:
            sides[:, 0] = self.slide.offset + positions[:, 1:3] @ self.slide.ways
        if self.straight is not None:
            sides[:, 2] = np.sin(positions[:, WRIST] - self.straight)
        sides[np.abs(sides) <= NO_SIDES] = 0.0
        return sides


def _parts_of(robot: Robot) -> _Parts:
    """Return what tells the configurations of a robot apart, without its external axes."""
    carried = len(robot.external_axes)
    point = robot.tool_in_tip.translation if robot.dof - carried == POINT_JOINTS else None
    gravity = robot.model.gravity.linear
    key = robot.kinematic_content, carried, gravity.tobytes(), None if point is None else point.tobytes()

    def read() -> _Parts:
        if robot.holds_workpiece:
            return _read_parts(screws_of(robot).reversed(), None, -foot_at_zero(robot).rotation.T @ gravity)
        return _read_parts(screws_of(robot).without_first(carried), point, -gravity)

    return _known.get(key, read)


def _of_arm(robot: Robot, positions: FloatArray) -> FloatArray:
    """Return the positions (N, joints) of the joints of the arm, from its base on."""
    return positions[:, ::-1] if robot.holds_workpiece else positions[:, len(robot.external_axes) :]


def _read_parts(screws: Screws, point: FloatArray | None, up: FloatArray) -> _Parts:
    """Read what tells configurations apart; `point` (3,), in the tip frame, is that of an arm with three joints."""
    joints, turning = len(screws.axes), screws.is_angle
    if point is not None and turning.all():
        return _Parts(_Links.between(screws, [*screws.points[1:], screws.position + screws.rotation @ point], up))
    if joints != POSE_JOINTS or not turning[[0, 3, 4, 5]].all():
        return _Parts()
    straight = _straight(screws)
    if (centre := _common_point(screws, 3)) is not None:
        if turning.all():
            return _Parts(_Links.between(screws, [*screws.points[1:3], centre], up), None, straight)
        return _Parts(None, None if turning[1:3].any() else _Slide.behind(screws, centre), straight)
    if turning.all() and (centre := _common_point(screws, 4)) is not None:
        links = _Links.between(screws, [*screws.points[1:4], centre], up)
        return _Parts() if links is None else _Parts(links, None, straight)
    return _Parts()


def _common_point(screws: Screws, first: int) -> FloatArray | None:
    """Return the point (3,), m, where the axes from one on meet; None: they do not."""
    axes, points = screws.axes[first:], screws.points[first:]
    centre = meeting_point(axes, points)
    away = np.linalg.norm(np.cross(axes, centre - points), axis=1).max()
    reach = np.linalg.norm(np.diff(screws.points, axis=0), axis=1).sum()
    return centre if away <= PARALLEL_AXES_SINE * reach else None


def _straight(screws: Screws) -> float:
    """Return the fifth joint, rad in [-pi / 2, pi / 2), with axes 4, 5 and 6 in one plane."""
    fourth, fifth, sixth = screws.axes[3:]
    normal = np.cross(fourth, fifth)
    angle = float(np.arctan2(-(normal @ sixth), normal @ np.cross(fifth, sixth)))
    angle -= np.pi * round(angle / np.pi)
    return angle - np.pi if angle > np.pi / 2.0 - PARALLEL_AXES_SINE else angle


_known: LastUsed[_Parts] = LastUsed(CONFIGURATION_CACHE_BYTES, lambda parts: BYTES)
