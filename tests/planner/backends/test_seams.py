"""Seams at a few mm/s: their durations follow from speed and ramps, with every back end."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from planner.backends import BACKENDS, Trapezoidal
from planner.errors import ConfigurationChange, JointPositionLimit, SingularPath, UnreachableWaypoint
from planner.kinematics import Pose, forward_kinematics
from planner.limits import Limits
from planner.planning import plan
from planner.problems.problem import CircularMotion, LinearMotion, PlanningProblem, PoseWaypoint
from planner.problems.transitions import BlendTransition, StopTransition
from planner.robots import load_robot
from planner.spatial import rotation_from_quaternion
from tests.sizes import SIZE

POSITIONS = {
    "ur5": ((0.0, -1.57, 1.57, -1.57, -1.57, 0.0), (0.0, -1.2, 1.9, -0.7, -1.57, 0.0)),
    "kuka_kr16_2": ((0.0, -1.57, 1.57, 0.0, 0.6, 0.0), (0.0, -1.2, 1.4, 0.0, -0.8, 0.0)),
    "kuka_kr16_l6_2": ((0.0, -np.pi / 2.0, np.pi / 2.0, 0.0, np.pi / 2.0, 0.0),),
}
"""Symmetric joint positions, the arm straight ahead."""

KINDS = tuple(kind for kind in BACKENDS if kind != "min_effort")
"""The back ends whose plans are short; `min_effort` minimises something else."""

SLOWNESS = {"cubic": 1.5, "quintic": 15.0 / 8.0}
"""Peak over mean speed of the time scalings from rest to rest without cruise."""

RAMPS = 1.0
"""Allowance for ramps and corners, s: a few hundredths of a second each at these speeds."""


class Seam(NamedTuple):
    """A seam to be welded.

    Attributes:
        problem: With the speed as the limit of the tool.
        length: m, of its lines and half circles.
        speed: m/s.
    """

    problem: PlanningProblem
    length: float
    speed: float


def seam(arm: str, start: Pose, angle: float, legs: list[float], radii: list[float], speed: float) -> Seam:
    """Return lines and half circles in turns, tangent to each other, in the horizontal plane.

    Args:
        arm: From the catalogue.
        start: Of the tool, whose orientation stays.
        angle: rad, direction of the first line from the base's x axis.
        legs: m: lengths of lines; at odd places radii of half circles, negative ones to the right.
        radii: m, of the blends between them.
        speed: m/s.
    """
    waypoints = [PoseWaypoint(start)]
    at, length = start.position, 0.0
    for k, leg in enumerate(legs):
        ahead = np.array([np.cos(angle), np.sin(angle), 0.0])
        motion: LinearMotion | CircularMotion = LinearMotion()
        if k % 2 == 0:
            at, length = at + leg * ahead, length + leg
        else:
            aside = leg * np.array([-ahead[1], ahead[0], 0.0])
            motion = CircularMotion(Pose(at + abs(leg) * ahead + aside, None))
            at, angle, length = at + 2.0 * aside, angle + np.pi, length + np.pi * abs(leg)
        transition = BlendTransition(radii[k]) if k < len(legs) - 1 else StopTransition()
        waypoints.append(PoseWaypoint(Pose(at, start.rotation), motion=motion, transition=transition))
    problem = PlanningProblem(load_robot(arm), tuple(waypoints), limits=Limits(tcp_linear_velocity=speed))
    return Seam(problem, length, speed)


def random_seam(rng: np.random.Generator) -> Seam:
    """Draw a seam; half of them are symmetric.

    The symmetric ones lie along an axis of the base, in whole millimetres and with a common radius.
    """
    arm = str(rng.choice(list(POSITIONS)))
    position = np.array(POSITIONS[arm][rng.integers(len(POSITIONS[arm]))])
    count, structured = int(rng.choice([1, 3, 5])), rng.uniform() < 0.5
    if structured:
        angle, speed = float(rng.integers(4)) * np.pi / 2.0, float(rng.choice([0.001, 0.002, 0.005, 0.01, 0.02]))
        legs = np.full(count, float(rng.integers(20, 80)) / 1000.0)
        legs[1::2] = float(rng.integers(10, 40)) / 1000.0
        radii = np.full(count, float(rng.choice([0.002, 0.005, 0.01])))
    else:
        position = position + rng.uniform(-0.2, 0.2, len(position))
        angle, speed = rng.uniform(0.0, 2.0 * np.pi), float(rng.uniform(0.001, 0.02))
        legs, radii = rng.uniform(0.02, 0.1, count), rng.uniform(0.002, 0.015, count)
        legs[1::2] = rng.uniform(0.01, 0.05) * rng.choice([-1.0, 1.0])
    start = forward_kinematics(load_robot(arm), position[None])[0]
    return seam(arm, start, angle, legs.tolist(), radii.tolist(), speed)


def test_case_trapezoidal_seam() -> None:
    """It took 9e7 s: by rounding the time scaling began behind its curve; a piece of zero length broke all limits."""
    rotation = rotation_from_quaternion(np.array([0.0, 0.8844892518835475, 0.0, 0.4665605676677813]))
    start = Pose(np.array([1.0609445293190278, 0.0, 1.2307862735972321]), rotation)
    legs = [0.05720798063598169, 0.03, 0.05720798063598169]
    problem = seam("kuka_kr16_2", start, np.pi / 2.0, legs, [0.005, 0.005, 0.0], 0.005).problem
    assert plan(problem, Trapezoidal()).trajectory.duration == pytest.approx(41.7, rel=0.005)


@pytest.mark.sized
@pytest.mark.parametrize("kind", KINDS)
def test_a_seam_takes_its_length_by_the_speed(kind: str) -> None:
    rng, tried = np.random.default_rng(0), 0
    while tried < SIZE.examples // 10:
        problem, length, speed = random_seam(rng)
        try:
            trajectory = plan(problem, BACKENDS[kind]()).trajectory
        except (ConfigurationChange, JointPositionLimit, SingularPath, UnreachableWaypoint):
            continue
        tried += 1
        assert trajectory.duration <= 1.03 * SLOWNESS.get(kind, 1.0) * length / speed + RAMPS, (tried, problem)
