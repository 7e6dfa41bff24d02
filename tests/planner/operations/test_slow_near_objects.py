"""Operations keep speed limits near objects, checked against dense samples: retimed results slow down, others are
refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np
import pytest

import planner
from planner.errors import Collision, InvalidProblem, LimitsUnsatisfiable
from planner.operations import CertifiedTrajectory, JointState, kept_clear
from planner.scene import Scene, SceneObject
from planner.shapes import Box, HalfSpace, Sphere
from planner.spatial import FloatArray, Pose
from planner.speed_zones import SpeedZone
from planner.trajectories.trajectory import Trajectory
from tests.planner.capsule_arm import CAPSULE_ARM, arm_of_capsules
from tests.planner.problems_of_tests import backend_of
from tests.planner.scene.brute_force import distances_over_time
from tests.planner.scene.random_scenes import in_capsules, random_scene
from tests.planner.scene.slow_enough import assert_slow_enough, speeds_in_zone
from tests.sizes import SIZE

ARM = CAPSULE_ARM
PERSON = SceneObject("person", [Sphere(0.2)], Pose([1.75, 0.0, 0.8]))
CELL = Scene([PERSON])
ZONE = SpeedZone(0.45, 0.25, ["person"])
TURN = np.linspace(-0.7, 0.7, 200)[:, None]
PAST = np.array([0.0, -1.2, 1.7, 0.0, 1.0, 0.0]) + TURN * [1.0, 0.0, 0.0, 0.3, 0.0, 0.5]
PAST += 0.1 * np.cos(3.0 * TURN) * [0.0, 1.0, -1.0, 0.0, 0.5, 0.0]
"""Positions (points, joints) of a turn of the arm past the person, on a curve."""

ON_CURVES = ["cubic", "quintic", "trapezoidal", "ruckig", "toppra", "auto"]
IN_FULL = partial(pytest.param, marks=pytest.mark.large_only)
"""A case that the quick tests leave to CI."""


def off(points: FloatArray, positions: FloatArray) -> float:
    """Return the largest distance of positions (N, joints) from the polyline through points (M, joints), max norm."""
    starts, ways = points[:-1], np.diff(points, axis=0)
    shares = np.clip(((positions[:, None] - starts) * ways).sum(axis=2) / (ways**2).sum(axis=1), 0.0, 1.0)
    away = np.abs(positions[:, None] - starts - shares[..., None] * ways).max(axis=2)
    return float(away.min(axis=1).max())


@pytest.fixture(scope="module")
def quick() -> Trajectory:
    """The turn as fast as the limits allow, which is too fast beside the person."""
    return planner.retime_trajectory(ARM, PAST, planner.Quintic()).trajectory


@pytest.fixture(scope="module")
def slow() -> planner.RetimedTrajectory:
    return planner.retime_trajectory(ARM, PAST, planner.Quintic(), scene=CELL, speed_zones=[ZONE])


@pytest.mark.parametrize("kind", [kind if kind in ("cubic", "ruckig") else IN_FULL(kind) for kind in ON_CURVES])
def test_points_are_timed_slowly_near_objects_and_on_their_path(kind: str) -> None:
    plain = planner.retime_trajectory(ARM, PAST, backend_of(kind))
    done = planner.retime_trajectory(ARM, PAST, backend_of(kind), scene=CELL, speed_zones=[ZONE])
    (check,), trajectory = done.certificate.speed_zones, done.trajectory
    assert done.certificate.satisfied
    assert done.certificate.clearance is not None
    assert done.certificate.continuity >= plain.certificate.continuity
    assert check.satisfied
    (seen,) = assert_slow_enough(ARM, CELL, trajectory, [ZONE])
    assert seen <= check.peak * (1.0 + 1e-9)
    speeds = speeds_in_zone(ARM, CELL, trajectory, ZONE.clearance, ZONE.objects)
    assert speeds.mean() > 0.9 * ZONE.speed, "it has to be no slower than it is asked to be"
    (positions,) = trajectory.evaluate(trajectory.sample_times(0.02), [0])
    assert off(PAST, positions) <= done.deviation * (1.0 + 1e-6)
    assert done.deviation == plain.deviation <= 1e-3


@pytest.mark.parametrize(
    ("points", "zones"),
    [
        pytest.param(PAST[[0, -1]], [ZONE], id="a straight motion"),
        IN_FULL(PAST[100:], [ZONE], id="start inside"),
        IN_FULL(PAST[:100], [ZONE], id="end inside"),
        IN_FULL(PAST[95:105], [ZONE], id="whole inside"),
        pytest.param(np.concatenate([PAST, PAST[-2::-1]]), [ZONE], id="there and back"),
        pytest.param(PAST, [SpeedZone(10.0, 100.0), SpeedZone(1e-3, 1e-3)], id="huge and tiny"),
    ],
)
def test_structured_points(points: FloatArray, zones: list[SpeedZone]) -> None:
    done = planner.retime_trajectory(ARM, points, planner.Trapezoidal(), scene=CELL, speed_zones=zones)
    seen = assert_slow_enough(ARM, CELL, done.trajectory, zones)
    for check, fastest in zip(done.certificate.speed_zones, seen, strict=True):
        assert check.satisfied
        assert fastest <= check.peak * (1.0 + 1e-9)
        assert check.exceeded == ()


def test_points_that_are_one_rest_in_a_zone() -> None:
    done = planner.retime_trajectory(ARM, PAST[[100, 100]], scene=CELL, speed_zones=[ZONE])
    (check,) = done.certificate.speed_zones
    assert check.intervals == ((0.0, done.trajectory.duration),)
    assert check.peak == pytest.approx(0.0, abs=1e-9)
    assert (check.lower, check.exceeded) == (0.0, ())


@pytest.mark.parametrize("gap", [-5e-3, IN_FULL(-1e-4), 0.0, IN_FULL(1e-4), IN_FULL(5e-3)])
def test_a_zone_that_begins_where_the_motion_is_parallel_to_a_wall(gap: float) -> None:
    """A turn about the base keeps the height over the floor: all of it is in a zone, or none."""
    turn = np.linspace(0.0, 1.0, 20)[:, None] * [1.5, 0.0, 0.0, 0.0, 0.0, 0.0]
    points = np.array([-0.7, -1.2, 1.7, 0.0, 1.0, 0.0]) + turn
    floor = Scene([SceneObject("floor", [HalfSpace([0.0, 0.0, 1.0], -0.5)])])
    plain = planner.retime_trajectory(ARM, points, planner.Ruckig()).trajectory
    apart = float(np.nanmin(distances_over_time(ARM, floor, np.linspace(0.0, plain.duration, 50), plain)))
    zone = SpeedZone(apart + gap, 0.3)
    done = planner.retime_trajectory(ARM, points, planner.Ruckig(), scene=floor, speed_zones=[zone])
    assert_slow_enough(ARM, floor, done.trajectory, [zone])
    is_slowed = done.trajectory.duration > 1.1 * plain.duration
    assert is_slowed == (gap > -2e-3), "what counts as near lies up to 2 mm further out"


def operations(given: Trajectory) -> dict[str, Callable[[], CertifiedTrajectory]]:
    """Return all operations that keep the timing of a trajectory, or stop it near the person."""
    middle = given.duration / 2.0
    state = JointState(*given.evaluate(middle))
    return {
        "reverse": lambda: planner.reverse_trajectory(ARM, given),
        "slice": lambda: planner.slice_trajectory(ARM, given, 0.4 * given.duration, 0.6 * given.duration),
        "join": lambda: planner.join_trajectories(ARM, [given, planner.reverse_trajectory(ARM, given).trajectory]),
        "resample": lambda: planner.resample_trajectory(ARM, given, 0.01),
        "stop_on_path": lambda: planner.stop_on_path(ARM, given, middle),
        "stop_joints": lambda: planner.stop_joints(ARM, state),
    }


@pytest.mark.long_table
@pytest.mark.parametrize("name", ["reverse", "slice", "join", "resample", "stop_on_path", "stop_joints"])
def test_what_is_made_of_slow_motions_is_slow_and_of_quick_ones_refused(
    quick: Trajectory, slow: planner.RetimedTrajectory, name: str
) -> None:
    done = kept_clear(operations(slow.trajectory)[name](), CELL, speed_zones=[ZONE])
    (seen,) = assert_slow_enough(ARM, CELL, done.trajectory, [ZONE])
    (check,) = done.certificate.speed_zones
    assert seen <= check.peak * (1.0 + 1e-9)
    assert check.lower <= check.peak
    fast = operations(quick)[name]()
    with pytest.raises(LimitsUnsatisfiable, match="person") as refusal:
        kept_clear(fast, CELL, speed_zones=[ZONE])
    truth = speeds_in_zone(ARM, CELL, fast.trajectory, ZONE.clearance, ZONE.objects).max()
    assert refusal.value.limit == ZONE.speed
    assert refusal.value.value is not None
    assert truth <= refusal.value.value <= 1.02 * truth
    assert refusal.value.time is not None
    assert 0.0 <= refusal.value.time <= fast.trajectory.duration


def test_what_is_away_from_objects_is_as_fast_as_it_likes(quick: Trajectory) -> None:
    start = planner.slice_trajectory(ARM, quick, 0.0, 0.2 * quick.duration)
    (check,) = kept_clear(start, CELL, speed_zones=[ZONE]).certificate.speed_zones
    assert (check.intervals, check.time, check.link) == ((), None, None)


def test_what_cannot_be_kept_is_refused(quick: Trajectory) -> None:
    retime = partial(planner.retime_trajectory, ARM, PAST)
    for requested, field in (
        (lambda: retime(speed_zones=[ZONE]), ("speed_zones",)),
        (lambda: retime(scene=CELL, speed_zones=[replace(ZONE, objects=["nobody"])]), ("speed_zones", 0, "objects", 0)),
        (
            lambda: retime(planner.Trapezoidal(acceleration_time=0.1), scene=CELL, speed_zones=[ZONE]),
            ("backend", "acceleration_time"),
        ),
        (
            lambda: kept_clear(planner.reverse_trajectory(ARM, quick), None, speed_zones=[ZONE]),
            ("speed_zones",),
        ),
    ):
        with pytest.raises(InvalidProblem) as refusal:
            requested()
        assert [fault.field for fault in refusal.value.faults] == [field]
    wall = Scene([SceneObject("wall", [Box([0.2, 0.2, 2.0])], Pose([1.2, 0.0, 1.0]))])
    with pytest.raises(Collision):
        retime(scene=wall, speed_zones=[SpeedZone(0.3, 0.2)])


ARMS = ("kuka_kr16_2", "date_sorting_arm", "welding_arm", "ngv_refuelling_arm")


@pytest.mark.large_only
@pytest.mark.sized
@pytest.mark.parametrize("arm", [ARMS[0], *map(IN_FULL, ARMS[1:])])
def test_random_walks_among_random_things_are_slow_near_them(arm: str) -> None:
    rng = np.random.default_rng(100 + ARMS.index(arm))
    robot = replace(arm_of_capsules(arm))  # a copy of its own, whose shapes are changed
    in_capsules(robot)
    lower, upper = (np.clip(robot.limit(name), -3.0, 3.0) for name in ("lower", "upper"))
    slowed = tried = 0
    while tried < max(2, SIZE.examples // 100):
        corners = lower + (upper - lower) * rng.uniform(0.3, 0.7, (3, robot.dof))
        points = np.concatenate([np.linspace(a, b, 30) for a, b in pairwise(corners)])
        scene = random_scene(rng, 1.5)
        zones = [SpeedZone(float(rng.uniform(0.05, 0.6)), float(rng.uniform(0.15, 0.6))) for _ in range(2)]
        backend = backend_of(str(rng.choice(["cubic", "quintic", "ruckig", "toppra"])))
        try:
            plain = kept_clear(planner.retime_trajectory(robot, points, backend, max_deviation=0.02), scene)
        except Collision:
            continue
        tried += 1
        done = planner.retime_trajectory(robot, points, backend, max_deviation=0.02, scene=scene, speed_zones=zones)
        assert_slow_enough(robot, scene, done.trajectory, zones)
        (positions,) = done.trajectory.evaluate(done.trajectory.sample_times(0.05), [0])
        assert off(points[np.append(True, np.diff(points, axis=0).any(axis=1))], positions) <= done.deviation + 1e-9
        slowed += done.trajectory.duration > plain.trajectory.duration
    assert slowed > 0
