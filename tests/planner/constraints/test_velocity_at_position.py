"""Velocity limits that depend on the position: the FR3's by libfranka's formulas, tables by dense samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import (
    InfeasibleDuration,
    InvalidRobotModel,
    JointWaypoint,
    Limits,
    PlanningError,
    PlanningProblem,
    Robot,
    ThroughTransition,
    VelocityCurves,
    VelocityParabola,
    VelocityTable,
    certify,
    load_robot,
    plan,
)
from planner.backends import BACKENDS
from planner.constraints import VELOCITY_AT_POSITION
from planner.plans.result import Plan
from planner.robots import DHJoint
from planner.robots.varying.velocity_curves import NO_CURVES, VelocityConditions
from planner.spatial import FloatArray
from planner.trajectories.extrema import derivatives_on_unit_time
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.sizes import NAME

LIBFRANKA = (
    (2.62, 0.30, 12.0, 2.75010, 2.750100),
    (2.62, 0.20, 5.17, 1.79180, 1.791800),
    (2.62, 0.20, 7.00, 2.90650, 2.906500),
    (2.62, 0.30, 8.00, -0.1458, 3.048100),
    (5.26, 0.35, 34.0, 2.81010, 2.810100),
    (4.18, 0.35, 11.0, 4.52050, -0.54092),
    (5.26, 0.35, 34.0, 3.01960, 3.019600),
)
"""Highest velocity, offset, factor and ends of both roots by joint, from rate_limiting.h of libfranka."""

MARGIN = 1e-3
"""rad/s: kJointVelocityLimitsTolerance of libfranka."""

RECTANGLE = (
    (-2.3093, -1.5133, -2.4937, -2.7478, -2.48, 0.8521, -2.6895),
    (2.3093, 1.5133, 2.4937, -0.4461, 2.48, 4.2094, 2.6895),
    (2.0, 1.0, 1.5, 1.25, 3.0, 1.5, 3.0),
)
"""Positions and velocities of the maker's position-velocity rectangle, the earlier limits of the catalogue."""

PLANS = {"quick": 20, "large": 200, "soak": 2_000}[NAME]
"""Number of plans of each back end."""

CLOSED = ("cubic", "quintic", "ruckig", "toppra", "trapezoidal")
"""The back ends without a search."""


def libfranka(q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute lower and upper velocities (N, joints) at positions (N, joints)."""
    lower, upper = np.empty_like(q), np.empty_like(q)
    for joint, (most, offset, factor, end, other) in enumerate(LIBFRANKA):
        root = np.sqrt(np.maximum(0.0, factor * (end - q[:, joint])))
        upper[:, joint] = np.minimum(most, np.maximum(0.0, -offset + root)) - MARGIN
        root = np.sqrt(np.maximum(0.0, factor * (other + q[:, joint])))
        lower[:, joint] = np.maximum(-most, np.minimum(0.0, offset - root)) + MARGIN
    return lower, upper


def at_1_khz(made: Plan) -> list[FloatArray]:
    times = np.append(np.arange(0.0, made.trajectory.duration, 1e-3), made.trajectory.duration)
    return made.trajectory.evaluate(times, [0, 1])


def rectangular(robot: Robot) -> Robot:
    """Return FR3 with its rectangle in place of its curves."""
    rows = zip(robot.joints, *RECTANGLE, strict=True)
    joints = (replace(j, lower=a, upper=b, velocity=v, velocity_curves=NO_CURVES) for j, a, b, v in rows)
    return replace(robot, joints=tuple(joints))


def duration(robot: Robot, positions: FloatArray, kind: str) -> float:
    waypoints = tuple(JointWaypoint(tuple(q.tolist())) for q in positions)
    return plan(PlanningProblem(robot, waypoints), BACKENDS[kind]()).trajectory.duration


@pytest.mark.sized
@pytest.mark.parametrize("kind", CLOSED)
def test_fr3_moves_within_libfrankas_formulas(kind: str) -> None:
    robot, rng = load_robot("fr3"), np.random.default_rng(27)
    for positions in rng.uniform(robot.limit("lower"), robot.limit("upper"), (PLANS, 2, 7)):
        waypoints = tuple(JointWaypoint(tuple(q.tolist())) for q in positions)
        made = plan(PlanningProblem(robot, waypoints), BACKENDS[kind]())
        q, v = at_1_khz(made)
        lower, upper = libfranka(q)
        # The margin is a limit of motion: it permits no rest where the formulas allow less.
        assert (v <= np.maximum(upper, 0.0) + 1e-7).all() and (v >= np.minimum(lower, 0.0) - 1e-7).all()
        (check,) = (check for check in made.certificate.checks if check.quantity == "velocity_at_position")
        assert check.satisfied and check.method == "exact"


@pytest.mark.parametrize("kind", ["auto", *CLOSED])
def test_fr3_passes_waypoints_within_libfrankas_formulas(kind: str) -> None:
    robot, rng = load_robot("fr3"), np.random.default_rng(4)
    positions = robot.middle + 0.7 * (rng.uniform(RECTANGLE[0], RECTANGLE[1], (4, 7)) - robot.middle)
    passed = [JointWaypoint(tuple(q.tolist()), transition=ThroughTransition()) for q in positions[1:-1]]
    waypoints = (JointWaypoint(tuple(positions[0].tolist())), *passed, JointWaypoint(tuple(positions[-1].tolist())))
    q, v = at_1_khz(plan(PlanningProblem(robot, waypoints), BACKENDS[kind]()))
    lower, upper = libfranka(q)
    assert (v <= upper + 1e-7).all() and (v >= lower - 1e-7).all()


@pytest.mark.sized
@pytest.mark.parametrize("kind", ["ruckig", "toppra"])
def test_the_curves_save_a_quarter_of_the_time_that_the_rectangle_takes(kind: str) -> None:
    robot, rng = load_robot("fr3"), np.random.default_rng(28)
    moves = rng.uniform(RECTANGLE[0], RECTANGLE[1], (max(PLANS // 4, 20), 2, 7))
    curved, rectangle = (
        np.median([duration(one, positions, kind) for positions in moves]) for one in (robot, rectangular(robot))
    )
    assert curved <= 0.75 * rectangle


def arm(upper: tuple[VelocityParabola | VelocityTable, ...], lower: tuple[VelocityTable, ...] = ()) -> Robot:
    """Return an arm of two links, whose first joint has velocity curves."""
    row = DHJoint("revolute", a=0.4, lower=-3.0, upper=3.0, velocity=3.0, acceleration=20.0, jerk=400.0, mass=1.0)
    return Robot.from_dh([replace(row, velocity_curves=VelocityCurves(upper, lower)), row])


TABLES = (
    VelocityTable((-2.0, -1.0, 0.0, 0.3, 2.0), (2.5, 0.4, 2.0, 0.9, 0.8)),
    VelocityTable((-1.0, 0.5, 1.0), (1.1, 0.7, 2.5)),
)
"""The curve rises and falls, so that limits between points are neither the least nor the largest of lines."""


@pytest.mark.long_table
@pytest.mark.parametrize("kind", sorted(BACKENDS))
def test_every_back_end_keeps_tables_in_both_directions(kind: str) -> None:
    robot = arm((TABLES[0],), (TABLES[1],))
    waypoints = tuple(JointWaypoint(q) for q in ((-2.2, 0.0), (1.7, 1.0), (-1.8, -1.0)))
    made = plan(PlanningProblem(robot, waypoints), BACKENDS[kind]())
    q, v = (values[:, 0] for values in at_1_khz(made))
    upper = np.interp(q, TABLES[0].positions, TABLES[0].velocities)
    lower = np.interp(q, TABLES[1].positions, TABLES[1].velocities)
    assert (v <= upper * (1.0 + 1e-6)).all() and (-v <= lower * (1.0 + 1e-6)).all()
    used = float(np.maximum(v / upper, -v / lower).max())
    (check,) = (check for check in made.certificate.checks if check.quantity == "velocity_at_position")
    assert check.ratio == pytest.approx(used, rel=5e-3)
    assert check.joint == "joint_1"


def test_limits_of_a_request_scale_the_curves() -> None:
    robot = arm((TABLES[0],), (TABLES[1],))
    waypoints = tuple(JointWaypoint(q) for q in ((-2.2, 0.0), (1.7, 1.0)))
    made = plan(PlanningProblem(robot, waypoints, limits=Limits(velocity_scale=0.5)))
    q, v = (values[:, 0] for values in at_1_khz(made))
    assert (v <= 0.5 * np.interp(q, TABLES[0].positions, TABLES[0].velocities) * (1.0 + 1e-6)).all()
    (check,) = (check for check in made.certificate.checks if check.quantity == "velocity_at_position")
    assert check.limit is not None
    (at,) = made.trajectory.evaluate(np.array([check.time]), [0])
    assert check.limit == pytest.approx(0.5 * np.interp(at[0, 0], TABLES[0].positions, TABLES[0].velocities), rel=1e-6)


@pytest.mark.parametrize("order", [4, 6, 8])
def test_largest_shares_are_those_of_dense_samples(order: int) -> None:
    rng, robot = np.random.default_rng(order), load_robot("fr3")
    conditions = VelocityConditions.of(
        [VelocityCurves((VelocityParabola(4.0, 2.5, 0.2),), (TABLES[1],)), VelocityCurves(TABLES), NO_CURVES]
    )
    two = replace(robot, joints=robot.joints[:3])
    vars(two)["velocity_conditions"] = conditions
    for _ in range(8):
        lengths = rng.uniform(0.1, 2.0, 4)
        motion = PiecewisePolynomial(lengths, rng.uniform(-0.5, 0.5, (4, 3, order)) / (1.0 + np.arange(order)) ** 2)
        limits, groups = rng.uniform(0.3, 2.0, (4, 3)), np.array([0, 0, 1, 1])
        found = VELOCITY_AT_POSITION.peaks(two, derivatives_on_unit_time(motion, 2), limits, groups)
        dense = np.zeros(4)
        for piece in range(4):
            x = np.linspace(0.0, lengths[piece], 20_001)
            q, v = motion.evaluate_on(np.full(len(x), piece), x, [0, 1])
            room = np.maximum(4.0 * (2.5 - q[:, 0]), 0.0)
            with np.errstate(divide="ignore"):
                up = np.stack([np.maximum(np.sqrt(room) - 0.2, 0.0), *np.full((2, len(x)), np.inf)], axis=1)
            by_tables = [np.interp(q[:, 1], table.positions, table.velocities) for table in TABLES]
            up[:, 1] = np.minimum(*by_tables)
            down = np.full_like(up, np.inf)
            down[:, 0] = np.interp(q[:, 0], TABLES[1].positions, TABLES[1].velocities)
            shares = np.maximum(v / up, -v / down) / limits[piece]
            dense[piece] = shares.max()
        expected = np.maximum(dense[[0, 2]], dense[[1, 3]])
        np.testing.assert_allclose(found.use[:, 0], expected, rtol=1e-3)  # a sample may miss a knot of a table
        assert (found.use[:, 0] >= expected * (1.0 - 2e-9)).all()


def test_a_trajectory_beyond_the_curves_is_not_certified() -> None:
    robot = load_robot("fr3")
    slow = tuple(JointWaypoint(q) for q in ((0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0), (2.7, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0)))
    free = replace(robot, joints=tuple(replace(joint, velocity_curves=NO_CURVES) for joint in robot.joints))
    made = plan(PlanningProblem(free, slow), BACKENDS["trapezoidal"]())
    certificate = certify(robot, made.trajectory)
    assert not certificate.satisfied
    (check,) = (check for check in certificate.checks if check.quantity == "velocity_at_position")
    assert check.joint == "fr3_joint1" and check.ratio is not None and check.ratio > 1.1 and check.limit is not None
    (q,) = made.trajectory.evaluate(np.array([check.time]), [0])
    assert check.limit == pytest.approx(libfranka(q)[1][0, 0], abs=1e-9)
    assert check.unit(robot) == "rad/s"


def test_a_refusal_of_a_duration_names_the_limit_by_position() -> None:
    waypoints = (JointWaypoint((-2.2, 0.0)), JointWaypoint((1.7, 0.0), duration=2.0))
    with pytest.raises(InfeasibleDuration, match=r"within the velocity \(by position\) limit of joint_1") as refused:
        plan(PlanningProblem(arm((TABLES[0],)), waypoints), BACKENDS["quintic"]())
    assert refused.value.joint == "joint_1"


def test_position_limits_end_where_a_parabola_stops_the_joint() -> None:
    robot = arm((VelocityParabola(8.0, 2.0, 0.2),))
    assert robot.joints[0].upper == pytest.approx(2.0 - (0.2 + 0.02 * 3.0) ** 2 / 8.0)
    assert "position_limits_narrowed" in {finding.code for finding in robot.findings}


def test_a_derived_robot_keeps_the_curves_of_its_base_and_adds_its_own() -> None:
    own = VelocityTable((-1.0, 1.0), (0.5, 0.6))
    robot = load_robot("fr3").derived(limits={"fr3_joint1": {"velocity_curves": VelocityCurves(lower=(own,))}})
    curves = robot.joints[0].velocity_curves
    assert curves.upper == load_robot("fr3").joints[0].velocity_curves.upper
    assert curves.lower == (*load_robot("fr3").joints[0].velocity_curves.lower, own)


@pytest.mark.parametrize(
    "curve",
    [
        VelocityParabola(0.0, 2.0),
        VelocityParabola(1.0, 2.0, -0.1),
        VelocityParabola(1.0, -3.5),
        VelocityTable((0.0,), (1.0,)),
        VelocityTable((0.0, 0.0), (1.0, 1.0)),
        VelocityTable((0.0, 1.0), (1.0, 0.0)),
        VelocityTable((0.0, np.nan), (1.0, 1.0)),
    ],
)
def test_curves_that_make_no_sense_are_refused(curve: VelocityParabola | VelocityTable) -> None:
    with pytest.raises(InvalidRobotModel, match="velocity curves of joint_1"):
        arm((curve,))


def test_a_start_that_moves_beyond_a_curve_is_refused() -> None:
    robot = load_robot("fr3")
    waypoints = tuple(
        JointWaypoint(q) for q in ((2.5, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0), (2.6, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0))
    )
    backend = BACKENDS["ruckig"](initial_velocity=(2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(PlanningError):
        plan(PlanningProblem(robot, waypoints), backend)
