"""What programs of robots share: six turning joints, and motions from rest to rest as points and times."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import floor

import numpy as np

from planner.errors import UnsupportedFormat
from planner.export.base import ExportOptions
from planner.kinematics import FloatArray
from planner.plans.result import Plan
from planner.problems.actions import SetOutput
from planner.robots import Robot
from planner.timing.action_times import TimedAction
from planner.tolerances import NEGLIGIBLE_SHARE

JOINTS = 6
"""The number of joints of the arms that these programs move."""

AT_START = 0.01
"""Largest distance of a joint from the start, rad or m, from which a program moves there; otherwise it halts."""

AT_SAME_POSITION = 1e-9
"""Largest distance between two joint positions or tools that are the same, rad or m."""

APPROACH = 1.0
"""Time, s, in which a robot so near to the start goes there, before the first point that has a time: none jumps."""

MILLIMETRES = 1e3
"""Millimetres in a metre: the unit in which programs have axes that slide."""

PROGRAM_SAMPLE_PERIOD = 0.004
"""The shortest sample period that programs take, s: controllers interpolate points no faster than that."""


@dataclass(frozen=True, eq=False)
class Move:
    """A motion from rest to rest, and the rest after it.

    Attributes:
        time: (N,), s from the start of the motion, strictly increasing from 0; N is 1 where there is only a rest.
        position: (N, joints), in degrees and millimetres, as `axes_first` orders them.
        rest: Duration of the rest at its end, s.
        outputs: The outputs that are set in the rest, each with the time since it began, s, in their order.
    """

    time: FloatArray
    position: FloatArray
    rest: float
    outputs: tuple[tuple[float, SetOutput], ...] = ()

    def steps_of_the_rest(self) -> Iterator[float | SetOutput]:
        """Yield what happens in the rest, in order: waits, s, and outputs that are set."""
        waited = 0.0
        for time, output in self.outputs:
            if time > waited:
                yield time - waited
            waited = max(time, waited)
            yield output
        if self.rest > waited:
            yield self.rest - waited


def moves(plan: Plan, language: str, period: float, most_external: int = 0) -> list[Move]:
    """Cut a plan where the robot rests, and sample each motion.

    Args:
        plan: The plan of an arm with six joints that turn, perhaps on external axes.
        language: The name of the language, for the refusal.
        period: The time between points, s; the last point of a motion is at its end.
        most_external: The most external axes that the language has.

    Raises:
        UnsupportedFormat: The arm is another, the trajectory begins or ends in motion, an output is set in motion, or
            the period is too short.
    """
    robot = plan.path.robot
    external = len(robot.external_axes)
    if robot.dof - external != JOINTS or not robot.is_angle[external:].all() or external > most_external:
        axes = f" and {most_external} external axes at most" if most_external else ""
        raise UnsupportedFormat(f"{language} moves arms of {JOINTS} joints that turn{axes}, which {robot.id} is not")
    if period < PROGRAM_SAMPLE_PERIOD:
        raise UnsupportedFormat(f"{language} takes points {PROGRAM_SAMPLE_PERIOD:g} s apart or more, not {period:g} s")
    outputs = [timed for timed in plan.actions if isinstance(timed.action, SetOutput)]
    return list(_between(plan, stops(plan, language), period, outputs, language))


def stops(plan: Plan, language: str) -> list[int]:
    """Return the indices of the waypoints at which the robot rests, the first and the last one among them.

    Raises:
        UnsupportedFormat: The trajectory begins or ends in motion.
    """
    trajectory = plan.trajectory
    peak = max((check.peak for check in plan.certificate.checks if check.quantity == "velocity"), default=0.0)
    speeds = np.abs(trajectory.evaluate(trajectory.arrivals, [1])[0]).max(axis=1)
    is_stop = speeds <= NEGLIGIBLE_SHARE * max(peak, 1.0)
    if not (is_stop[0] and is_stop[-1]):
        raise UnsupportedFormat(f"{language} begins and ends at rest, which this trajectory does not")
    found: list[int] = np.flatnonzero(is_stop).tolist()
    return found


@dataclass(frozen=True)
class Loop:
    """The statements of a language around a part of a program that runs several times.

    Attributes:
        language: The name of the language, for the refusal.
        counted: The lines before the part and behind it, with `{count}` for the number of times.
        endless: The lines around a part that runs until an operator stops it.
    """

    language: str
    counted: tuple[tuple[str, ...], tuple[str, ...]]
    endless: tuple[tuple[str, ...], tuple[str, ...]]


def repeated(plan: Plan, options: ExportOptions, loop: Loop, lines: Iterable[str]) -> list[str]:
    """Put the lines of a whole trajectory into the requested loop, indented.

    Raises:
        UnsupportedFormat: The trajectory ends at another joint position or with another tool than it starts with, or
            objects of its scene move.
    """
    if options.repeat == 1:
        return list(lines)
    scene = plan.problem.scene
    if scene is not None and scene.moving:
        raise UnsupportedFormat(
            f"{loop.language} repeats trajectories beside static objects: {scene.moving[0].id!r} is elsewhere when the "
            "next run begins. Set `repeat` to 1."
        )
    ends = plan.path.positions[[0, -1]]
    first, last = plan.problem.robots[0].tool_in_tip, plan.problem.robots[-1].tool_in_tip
    if np.abs(ends[1] - ends[0]).max() > AT_SAME_POSITION or not first.isApprox(last, AT_SAME_POSITION):
        where = "joint position" if first.isApprox(last, AT_SAME_POSITION) else "tool"
        raise UnsupportedFormat(
            f"{loop.language} repeats trajectories that end with the {where} of their start. "
            "Add a last waypoint like the first one, or set `repeat` to 1."
        )
    before, after = loop.counted if options.repeat else loop.endless
    inside = (f"  {line}" for line in lines)
    return [*(line.format(count=options.repeat) for line in before), *inside, *after]


def axes_first(robot: Robot, positions: FloatArray) -> FloatArray:
    """Return positions (N, joints) in degrees and millimetres: first the axes of the arm, then the external ones."""
    units = np.where(robot.is_angle, np.degrees(1.0), MILLIMETRES)
    found: FloatArray = (positions * units)[:, program_order(robot)]
    return found


def program_order(robot: Robot) -> list[int]:
    """Return the joints in the order of programs: arm, axes in front of it, positioner, each from its foot on."""
    numbers, carrying = list(range(robot.dof)), len(robot.positioner)
    if robot.holds_workpiece:
        return numbers[::-1]
    external = len(robot.external_axes)
    return [*numbers[external:], *numbers[carrying:external], *reversed(numbers[:carrying])]


def units_of(robot: Robot) -> list[str]:
    """Return the units of the external axes in programs: `deg` or `mm`."""
    external = program_order(robot)[robot.dof - len(robot.external_axes) :]
    return ["deg" if is_angle else "mm" for is_angle in robot.is_angle[external]]


def tolerances_of(robot: Robot) -> list[float]:
    """Return the largest distance of each axis from the start, degrees or mm, in the order of `axes_first`."""
    found: list[float] = axes_first(robot, np.full((1, robot.dof), AT_START))[0].tolist()
    return found


def _between(plan: Plan, stops: list[int], period: float, outputs: list[TimedAction], language: str) -> Iterator[Move]:
    """Make a motion between each two stops."""
    trajectory = plan.trajectory
    arrivals, departures = trajectory.arrivals, trajectory.departures
    for before, after in zip([stops[0], *stops], stops, strict=False):
        start, end = (arrivals[after], arrivals[after]) if before == after else (departures[before], arrivals[after])
        count = max(int(np.ceil((end - start) / period * (1.0 - NEGLIGIBLE_SHARE))), 0)
        time = np.append(start + np.arange(count) * period, end)
        position = axes_first(plan.path.robot, trajectory.evaluate(time, [0])[0])
        only_rests = bool((position == position[0]).all())
        begin = float(start if only_rests else end)
        rest = float(departures[after]) - begin
        rounding = NEGLIGIBLE_SHARE * trajectory.duration
        if outputs and outputs[0].time < begin - rounding:
            moment = f"{outputs[0].time:.6g} s"
            raise UnsupportedFormat(f"{language} sets outputs where the robot rests; at {moment} it moves")
        here = []
        while outputs and outputs[0].time <= begin + rest + rounding:
            timed = outputs.pop(0)
            assert isinstance(timed.action, SetOutput)  # noqa: S101 - they are all
            here.append((max(timed.time - begin, 0.0), timed.action))
        if only_rests:
            yield Move(np.zeros(1), position[:1], rest, tuple(here))
        else:
            yield Move(time - start, position, rest, tuple(here))


def origin(plan: Plan) -> str:
    """Describe the origin of a program in one line, for a comment."""
    return f"{on_one_line(plan.path.robot.id)}, {plan.backend.kind}, {plan.trajectory.duration!r} s"


def on_one_line(name: str) -> str:
    """Replace unprintable characters of a name by spaces: text after a line break would be a statement."""
    return "".join(letter if letter.isprintable() else " " for letter in name)


def name_of(output: SetOutput, pattern: str, language: str, example: str) -> re.Match[str]:
    """Match the name of an output with the names of a language.

    Raises:
        UnsupportedFormat: It has no such name.
    """
    found = re.fullmatch(pattern, output.name, re.ASCII)
    if found is None:
        raise UnsupportedFormat(f"{language} has no output called {output.name!r}; a name is like {example}")
    return found


def numbers(values: FloatArray, decimals: int = 6) -> list[str]:
    """Write numbers with so many decimals, without an exponent, which not every controller reads."""
    return [f"{value:.{decimals}f}" for value in values.tolist()]


def rounded_down(value: float, decimals: int) -> str:
    """Round a positive number down; the smallest one that has these decimals is the least."""
    return f"{max(floor(value * 10**decimals), 1) / 10**decimals:.{decimals}f}"
