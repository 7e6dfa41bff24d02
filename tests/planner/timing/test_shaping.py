"""Suppression and report of residual vibration, against a simulated two-mass arm."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from planner import (
    BlendTransition,
    Box,
    Budget,
    Cubic,
    FreeMotion,
    InfeasibleDuration,
    InvalidProblem,
    JointWaypoint,
    Limits,
    LimitsUnsatisfiable,
    LinearMotion,
    PlanningError,
    PlanningProblem,
    Pose,
    RelativeWaypoint,
    ResidualVibration,
    Ruckig,
    Scene,
    SceneObject,
    SpeedZone,
    StopTransition,
    ThroughTransition,
    Trapezoidal,
    inverse_dynamics,
    load_robot,
    plan,
    residual_amplitudes,
)
from planner.backends import BACKENDS, BackEnd
from planner.certificate.checks import Check
from planner.certificate.residual_vibration import MOST_RESIDUAL
from planner.planning.attempts import SHAPED_STRETCHES
from planner.planning.remedies.shaping import SLOWER_SHARES
from planner.plans.result import Plan
from planner.problems.moves import CartesianMove
from planner.problems.waypoint_faults import MODE_RANGES
from planner.spatial import FloatArray
from planner.timing.shaping import impulses_of
from planner.tolerances import POSITION_TOLERANCE
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.planner.problems_of_tests import backend_of, path_problems, problems
from tests.planner.timing.two_mass_arm import vibration_after
from tests.sizes import NAME

UR5E = load_robot("ur5e")
MODE = ResidualVibration(8.0, 0.02)
HERE, THERE = (0.8, -1.2, 1.4, -1.77, -1.57, 0.0), (-0.8, -1.2, 1.4, -1.77, -1.57, 0.3)
PLAIN = PlanningProblem(UR5E, [HERE, THERE])
SIMULATED, RANDOM = {"quick": (1, 2), "large": (8, 4), "soak": (60, 200)}[NAME]
"""Numbers of simulated plans and of random problems of each back end."""

UNIT_TIMES = np.linspace(0.0, 1.0, 21)
"""Shares of a piece at which velocities and accelerations are sampled."""


def kinds(*left_to_ci: str) -> list[Any]:
    """Return the back ends, some of which the quick tests leave to CI."""
    return [pytest.param(kind, marks=pytest.mark.large_only if kind in left_to_ci else ()) for kind in BACKENDS]


ON_STRAIGHT_PATHS = [own for own in kinds("auto", "cubic", "ruckig") if own.values != ("min_effort",)]
"""Back ends whose joint motions are straight, and whose shortest duration is the shortest that they find."""


def check_of(made: Plan) -> Check:
    (check,) = (check for check in made.certificate.checks if check.quantity == "residual_vibration")
    return check


def motions_of(made: Plan) -> list[PiecewisePolynomial]:
    return [made.trajectory.of(rows) for rows in made.path.rows_of_groups(made.trajectory)]


def unshaped(problem: PlanningProblem, backend: BackEnd) -> Plan:
    mode = problem.residual_vibration
    assert mode is not None
    return plan(replace(problem, residual_vibration=replace(mode, suppress=False)), backend)


@pytest.mark.sized
@pytest.mark.parametrize("kind", kinds("min_effort", "auto", "quintic"))
def test_masses_behind_the_joints_hardly_vibrate_after_shaped_motions(kind: str) -> None:
    rng = np.random.default_rng(sum(map(ord, kind)))
    for _ in range(SIMULATED):
        positions = rng.uniform(-1.4, 1.4, (2, 6))
        positions[1, 0] = positions[0, 0]  # a joint without motion vibrates in neither plan
        mode = ResidualVibration(float(10.0 ** rng.uniform(0.2, 1.5)), float(rng.choice([0.0, 0.03, 0.2])))
        problem = PlanningProblem(UR5E, list(positions), residual_vibration=mode)
        shaped, before = plan(problem, backend_of(kind)), unshaped(problem, backend_of(kind))
        error = float(rng.choice([-0.15, 0.15, rng.uniform(-0.15, 0.15)]))
        true_frequency = mode.frequency * (1.0 + error)
        left, excited = (vibration_after(made.trajectory, true_frequency, mode.damping) for made in (shaped, before))
        assert (left <= MOST_RESIDUAL * excited + 1e-10).all()
        for made, simulated in ((shaped, left), (before, excited)):
            computed = residual_amplitudes(made.trajectory, [true_frequency], mode.damping)[0]
            np.testing.assert_allclose(simulated, computed, rtol=2e-4, atol=1e-10)
        assert check_of(shaped).ratio < 1.0  # type: ignore[operator]
        assert shaped.trajectory.duration == pytest.approx(before.trajectory.duration + mode.period, rel=1e-12)


@pytest.mark.sized
@pytest.mark.parametrize("kind", ON_STRAIGHT_PATHS)
def test_random_plans_keep_their_path_and_limits_and_take_little_more_than_a_period_longer(kind: str) -> None:
    @settings(max_examples=RANDOM, deadline=None, suppress_health_check=list(HealthCheck))
    @given(problem=problems(kind), frequency=st.floats(1.0, 60.0), damping=st.floats(0.0, 0.2))
    def trial(problem: PlanningProblem, frequency: float, damping: float) -> None:
        problem = replace(problem, residual_vibration=ResidualVibration(frequency, damping))
        before = unshaped(problem, backend_of(kind))
        try:
            made = plan(problem, backend_of(kind), Budget(attempts=1))
        except LimitsUnsatisfiable as refusal:
            # Only torque and the tool depend on the place, where a shaped motion has another speed.
            assert any(name in refusal.message for name in ("torque", "tcp"))
            return
        mode = made.problem.residual_vibration
        assert mode is not None
        pairs = list(zip(motions_of(made), motions_of(before), strict=True))
        longest = SHAPED_STRETCHES[-1] * before.trajectory.duration + len(pairs) * mode.period
        assert made.trajectory.duration <= longest * (1.0 + 1e-9)
        for shaped, own in pairs:
            keeps_to(shaped, own)
        dwells = [p.trajectory.departures - p.trajectory.arrivals for p in (made, before)]
        np.testing.assert_allclose(*dwells, atol=1e-9)
        assert not len(pairs) or check_of(made).satisfied

    trial()


@pytest.mark.sized
@pytest.mark.parametrize("kind", ["toppra", "trapezoidal"])
def test_motions_of_the_tool_are_shaped_within_their_tolerances_or_refused(kind: str) -> None:
    @settings(max_examples=RANDOM, deadline=None, suppress_health_check=list(HealthCheck))
    @given(problem=path_problems(kind), frequency=st.floats(3.0, 60.0), damping=st.floats(0.0, 0.2))
    def trial(problem: PlanningProblem, frequency: float, damping: float) -> None:
        stops = tuple(replace(waypoint, transition=StopTransition()) for waypoint in problem.waypoints)
        mode = ResidualVibration(frequency, damping)
        problem = replace(problem, waypoints=stops, residual_vibration=mode)
        reported = replace(problem, residual_vibration=replace(mode, suppress=False))
        try:
            before = plan(reported, backend_of(kind), Budget(attempts=1))
        except PlanningError:
            return
        try:
            made = plan(problem, backend_of(kind), Budget(attempts=1))
        except LimitsUnsatisfiable as refusal:
            assert any(name in refusal.message for name in ("deviation", "tcp", "torque"))
            return
        for shaped, own in zip(motions_of(made), motions_of(before), strict=True):
            left, excited = (residual_amplitudes(each, mode.band, damping).max(axis=0) for each in (shaped, own))
            assert (left <= np.maximum(MOST_RESIDUAL * excited, POSITION_TOLERANCE) * (1.0 + 1e-6)).all()

    trial()


def keeps_to(shaped: PiecewisePolynomial, own: PiecewisePolynomial) -> None:
    """Check by samples that a shaped straight motion stays on its path, no faster than the unshaped one."""
    of_shaped, of_own = (
        np.abs(motion.evaluate_on(*np.broadcast_arrays(pieces[:, None], UNIT_TIMES * motion.lengths[:, None]), [1, 2]))
        for motion, pieces in ((motion, np.arange(len(motion.lengths))) for motion in (shaped, own))
    )
    ends = own.evaluate(own.breakpoints[[0, -1]], [0])[0]
    travel = ends[1] - ends[0]
    q = shaped.evaluate(np.linspace(0.0, 1.0, 400) * shaped.breakpoints[-1], [0])[0] - ends[0]
    share = (q @ travel) / (travel @ travel)
    scale = np.abs(travel).max()
    assert np.abs(q - share[:, None] * travel).max() <= 1e-9 * scale + 1e-12
    assert (np.diff(share) >= -1e-9).all()
    # Samples of the unshaped motion miss its peaks by less than a hundredth.
    most, most_of_own = of_shaped.max(axis=(1, 2)), of_own.max(axis=(1, 2))
    assert (most <= 1.01 * most_of_own + 1e-9 * scale).all()


@pytest.mark.sized
def test_amplitudes_of_pieces_of_any_length_and_degree_with_jumps_of_the_velocity() -> None:
    rng = np.random.default_rng(11)
    for trial in range(3 * SIMULATED):
        lengths = 10.0 ** rng.uniform(-5.0, 0.0, 6)
        order = 2 + trial % 7
        coefficients = rng.uniform(-1.0, 1.0, (6, 2, order)) / lengths[:, None, None] ** np.arange(order)
        ends = (coefficients * lengths[:, None, None] ** np.arange(order)).sum(axis=2)
        coefficients[1:, :, 0] = coefficients[0, :, 0] + np.cumsum(ends - coefficients[:, :, 0], axis=0)[:-1]
        motion = PiecewisePolynomial(lengths, coefficients)
        frequency, damping = float(10.0 ** rng.uniform(-0.5, 1.5)), float(rng.choice([0.0, 0.1]))
        simulated = vibration_after(motion, frequency, damping)
        computed = residual_amplitudes(motion, [frequency, frequency], damping)
        np.testing.assert_array_equal(computed[0], computed[1])
        np.testing.assert_allclose(simulated, computed[0], rtol=3e-4)


def response_after(weights: FloatArray, delays: FloatArray, frequency: float, damping: float) -> float:
    """Return the amplitude of the response to impulses at the last of them, beside that to a single impulse."""
    omega = 2.0 * np.pi * frequency
    damped = omega * np.sqrt(1.0 - damping**2)
    since = delays[-1] - delays
    decay = np.exp(-damping * omega * since)
    sine = float((weights * decay * np.sin(damped * since)).sum())
    cosine = float((weights * decay * np.cos(damped * since)).sum())
    return float(np.hypot(sine, cosine))


def test_three_impulses_leave_less_than_five_percent_for_every_mode_that_is_allowed() -> None:
    for error in np.linspace(*MODE_RANGES["frequency_error"], 12):
        for damping in np.linspace(*MODE_RANGES["damping"], 9):
            mode = ResidualVibration(3.0, float(damping), float(error))
            weights, delays = impulses_of(mode)
            assert (weights > 0.0).all() and weights.sum() == pytest.approx(1.0, abs=1e-15)
            assert delays[-1] == pytest.approx(1.0 / (3.0 * np.sqrt(1.0 - damping**2)))
            most = max(response_after(weights, delays, f, damping) for f in np.linspace(1 - error, 1 + error, 41) * 3.0)
            assert most < 0.046
            assert error < 0.15 or most > 0.01, "the margin is not used: the impulses belong to another band"


def test_ramps_of_half_a_period_make_no_pieces_of_no_length() -> None:
    made = plan(PLAIN, Trapezoidal())
    ramp = float(made.trajectory.lengths[0])
    shaped = plan(replace(PLAIN, residual_vibration=ResidualVibration(0.5 / ramp)), Trapezoidal())
    assert shaped.trajectory.lengths.min() > 1e-6 * ramp
    assert shaped.certificate.continuity == "C1"
    assert len(shaped.trajectory.lengths) < 3 * len(made.trajectory.lengths)


@pytest.mark.parametrize("kind", ON_STRAIGHT_PATHS)
def test_a_duration_of_the_whole_includes_the_time_of_shaping(kind: str) -> None:
    problem = PlanningProblem(UR5E, [JointWaypoint(HERE, dwell=0.2), THERE, HERE], residual_vibration=MODE)
    shortest = plan(problem, kind).trajectory.duration
    for longer in (1.0 + 1e-9, 1.3):
        made = plan(replace(problem, duration=longer * shortest), kind)
        assert made.trajectory.duration == pytest.approx(longer * shortest, rel=1e-12)
        assert check_of(made).satisfied
    for shorter in (0.95, 0.5):
        with pytest.raises(InfeasibleDuration, match=f"it takes {shortest:.5g}") as refused:
            plan(replace(problem, duration=shorter * shortest), kind)
        (remedy,) = (remedy for remedy in refused.value.remedies if remedy.field == ("duration",))
        assert remedy.value == pytest.approx(shortest, rel=1e-9)
        assert plan(remedy.applied_to(problem), kind).trajectory.duration == pytest.approx(shortest, rel=1e-9)


def test_a_minimum_duration_holds_for_the_shaped_motion() -> None:
    made = plan(replace(PLAIN, waypoints=[HERE, JointWaypoint(THERE, minimum_duration=3.0)], residual_vibration=MODE))
    assert 3.0 <= made.trajectory.duration <= 3.0 + MODE.period * (1.0 + 1e-12)


REFUSED: dict[str, tuple[list[JointWaypoint], BackEnd, tuple[object, ...]]] = {
    "through": (
        [JointWaypoint(HERE), JointWaypoint(THERE, transition=ThroughTransition()), JointWaypoint(HERE)],
        Cubic(),
        ("waypoints", 1, "transition"),
    ),
    "blend": (
        [JointWaypoint(HERE), JointWaypoint(THERE, transition=BlendTransition(0.05)), JointWaypoint(HERE)],
        Cubic(),
        ("waypoints", 1, "transition"),
    ),
    "duration": ([JointWaypoint(HERE), JointWaypoint(THERE, duration=4.0)], Cubic(), ("waypoints", 1, "duration")),
    "start in motion": (
        [JointWaypoint(HERE), JointWaypoint(THERE)],
        Ruckig(initial_velocity=(-0.1, 0.0, 0.0, 0.0, 0.0, 0.0)),
        ("backend", "initial_velocity"),
    ),
    "ramp": (
        [JointWaypoint(HERE), JointWaypoint(THERE)],
        Trapezoidal(acceleration_time=0.5),
        ("backend", "acceleration_time"),
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_shaped_motion_cannot_keep_is_refused_and_can_be_reported(case: str) -> None:
    waypoints, backend, field = REFUSED[case]
    problem = PlanningProblem(UR5E, waypoints, residual_vibration=MODE)
    with pytest.raises(InvalidProblem, match="suppression of residual vibration") as refused:
        plan(problem, backend)
    assert [fault.field for fault in refused.value.faults] == [field]
    (remedy,) = refused.value.remedies
    assert (remedy.field, remedy.value) == (("residual_vibration", "suppress"), False)
    made = plan(remedy.applied_to(problem), backend)
    assert made.trajectory.duration == remedy.duration
    check = check_of(made)
    assert (check.limit, check.ratio, check.enforced, check.satisfied) == (None, None, False, True)
    around = None if case != "start in motion" else (np.array([-0.1, *[0.0] * 5]), np.zeros(6))
    amplitudes = [residual_amplitudes(own, MODE.band, MODE.damping, around).max() for own in motions_of(made)]
    assert check.lower == pytest.approx(max(amplitudes), rel=1e-2)
    assert max(amplitudes) <= check.peak <= 1.0101 * check.lower


def test_a_duration_too_short_for_the_rms_torque_of_a_shaped_plan_has_a_longer_one() -> None:
    free = plan(replace(PLAIN, limits=Limits(rms_torque=(200.0,) * 6)), "ruckig")
    (check,) = (check for check in free.certificate.checks if check.quantity == "rms_torque")
    held = [
        check.peak
        for check in plan(replace(free.problem, duration=60.0), "ruckig").certificate.checks
        if check.quantity == "rms_torque"
    ]
    limits = Limits(rms_torque=(0.5 * (check.peak + held[0]),) * 6)
    problem = replace(PLAIN, limits=limits, duration=free.trajectory.duration + MODE.period, residual_vibration=MODE)
    with pytest.raises(LimitsUnsatisfiable, match="RMS torque") as refused:
        plan(problem, "ruckig")
    (remedy,) = (remedy for remedy in refused.value.remedies if remedy.field == ("duration",))
    assert plan(remedy.applied_to(problem), "ruckig").trajectory.duration == pytest.approx(remedy.value, rel=1e-9)


@pytest.mark.parametrize(
    "values",
    [{"frequency": float("nan")}, {"frequency": 0.0}, {"damping": 1.0}, {"damping": 0.3}, {"frequency_error": 0.25}],
)
def test_modes_out_of_range_are_refused(values: dict[str, float]) -> None:
    for suppress in (True, False):
        with pytest.raises(InvalidProblem, match="must be from") as refused:
            plan(replace(PLAIN, residual_vibration=replace(MODE, suppress=suppress, **values)))
        assert [fault.field for fault in refused.value.faults] == [("residual_vibration", *values)]


def test_a_rest_has_no_residual_vibration() -> None:
    made = plan(PlanningProblem(UR5E, [HERE, HERE], residual_vibration=MODE))
    assert not [check for check in made.certificate.checks if check.quantity == "residual_vibration"]


def line(tolerance: float) -> PlanningProblem:
    move = RelativeWaypoint(
        move=CartesianMove((0.0, -0.2, 0.1)), frame="base", motion=LinearMotion(tolerance_position=tolerance)
    )
    start = (0.3, -1.4, 1.8, -1.97, -1.57, 0.0)
    return PlanningProblem(UR5E, [start, move], residual_vibration=ResidualVibration(12.0, 0.02))


@pytest.mark.large_only
def test_a_line_is_shaped_within_its_tolerance_or_refused_with_proved_remedies() -> None:
    made = plan(line(2e-3), "toppra")
    (deviation,) = (check for check in made.certificate.checks if check.quantity == "path_position_deviation")
    assert 1e-4 < deviation.peak <= 2e-3
    assert check_of(made).satisfied
    with pytest.raises(LimitsUnsatisfiable, match="path position deviation") as refused:
        plan(line(1e-4), "toppra")
    wider, speed, acceleration, reported = refused.value.remedies
    assert wider.field == ("waypoints", 1, "motion", "tolerance_position")
    assert wider.value == pytest.approx(1.05 * deviation.peak, rel=0.02)
    for way in ([wider], [speed, acceleration], [reported]):
        problem = line(1e-4)
        for remedy in way:
            problem = remedy.applied_to(problem)
        again = plan(problem, "toppra")
        assert again.trajectory.duration == way[0].duration
        assert check_of(again).enforced is (way[0] is not reported)
    assert speed.value >= SLOWER_SHARES[-1] * (1e-4 / 2e-3) ** 0.5


@pytest.mark.large_only
def test_a_shaped_motion_too_fast_in_a_speed_zone_is_refused_or_slowed_slightly() -> None:
    scene = Scene([SceneObject("fixture", [Box((0.1, 0.1, 0.5))], Pose((-0.9, -0.1, 0.2)))], margin=0.02)
    problem = replace(PLAIN, scene=scene, speed_zones=[SpeedZone(0.3, 0.3)])
    least = plan(problem, "ruckig").trajectory.duration + MODE.period
    slowed = replace(problem, residual_vibration=MODE)
    made = plan(slowed, "ruckig").trajectory.duration
    assert least * (1.0 + 1e-6) < made <= least * SHAPED_STRETCHES[-1]
    with pytest.raises(LimitsUnsatisfiable, match=r"a point of .* would move") as refused:
        plan(replace(slowed, duration=least), "ruckig")
    assert refused.value.remedies[-1].field == ("residual_vibration", "suppress")


@pytest.mark.large_only
def test_detours_are_shaped_where_they_stay_clear() -> None:
    scene = Scene([SceneObject("fixture", [Box((0.1, 0.1, 1.2))], Pose((-0.65, -0.1, 0.6)))], margin=0.02)
    waypoints = [JointWaypoint(HERE), JointWaypoint(THERE, motion=FreeMotion())]
    made = plan(PlanningProblem(UR5E, waypoints, scene=scene, residual_vibration=MODE), "ruckig")
    assert made.detours[0].has_corners and made.certificate.clearance is not None
    assert not isinstance(made.detours[0].transition, StopTransition), "corners are passed without a stop"
    assert check_of(made).satisfied
    (motion,) = motions_of(made)
    assert (residual_amplitudes(motion, MODE.band, MODE.damping).max(axis=0) <= 1e-3).all()


@pytest.mark.parametrize("kind", ["ruckig", "toppra"])
def test_shaped_motions_that_exceed_a_torque_limit_slightly_are_a_little_slower(kind: str) -> None:
    limits, stretched = Limits(torque_scale=0.45), 0
    for seed in range(3):
        around = np.array(HERE) + np.random.default_rng(seed).uniform(-0.8, 0.8, (3, 6))
        unshaped = PlanningProblem(UR5E, list(around), limits=limits)
        least = plan(unshaped, kind).trajectory.duration + 2.0 * MODE.period
        problem = replace(unshaped, residual_vibration=MODE)
        made = plan(problem, kind)
        times = made.trajectory.sample_times(1e-3)
        torques = inverse_dynamics(UR5E, *made.trajectory.evaluate(times))
        assert (np.abs(torques) <= 0.45 * UR5E.limit("torque")).all()
        assert check_of(made).satisfied
        assert least * (1.0 - 1e-9) <= made.trajectory.duration <= SHAPED_STRETCHES[-1] * least
        stretched += made.trajectory.duration > least * (1.0 + 1e-6)
    assert stretched


@pytest.mark.large_only
def test_torque_limits_are_certified_and_slower_motions_offered_where_they_are_exceeded() -> None:
    limits = Limits(torque_scale=0.45)
    for seed in range(12):
        positions = np.random.default_rng(seed).uniform(-1.2, 1.2, (2, 6))
        problem = PlanningProblem(UR5E, list(positions), limits=limits, residual_vibration=ResidualVibration(3.0))
        try:
            made = plan(problem, "toppra")
        except LimitsUnsatisfiable as refusal:
            if "torque" in refusal.message and refusal.remedies:
                speed, acceleration, reported = refusal.remedies
                slower = acceleration.applied_to(speed.applied_to(problem))
                assert plan(slower, "toppra").trajectory.duration == speed.duration
                assert reported.field == ("residual_vibration", "suppress")
                return
            continue
        assert check_of(made).satisfied
    pytest.fail("no shaped motion exceeds its torque limits: the limits are too wide for this test")
