"""Acceleration and jerk limits by payload: every back end against finite samples on each segment."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner import InvalidRobotModel, JointWaypoint, Limits, PayloadTable, PlanningProblem, certify, load_robot, plan
from planner.backends import BACKENDS
from planner.robots.payload import Payload

TABLE = PayloadTable((1.0, 2.0, 5.0), (0.9, 0.5, 0.3), (1.0, 0.4, 0.1))
"""Factors that fall with the payload."""

KEEPS_JERK = ("quintic", "ruckig", "min_effort", "auto")
"""Back ends that keep limits of jerk."""


def factor(mass: float, factors: tuple[float, ...] | None) -> float:
    assert factors is not None
    return float(np.interp(mass, TABLE.masses, factors))


@pytest.mark.long_table
@pytest.mark.parametrize("kind", BACKENDS)
def test_every_back_end_keeps_the_limits_of_the_payload_on_each_segment(kind: str) -> None:
    robot = load_robot("ur5e").derived(payload_table=TABLE)
    positions = np.random.default_rng(4).uniform(-1.2, 1.2, (4, 6))
    loads = (None, Payload(1.5), None, None)
    waypoints = [
        JointWaypoint(tuple(q.tolist()), payload=load, put_down=i == 2)
        for i, (q, load) in enumerate(zip(positions, loads, strict=True))
    ]
    made = plan(PlanningProblem(robot, waypoints, payload=Payload(3.0)), BACKENDS[kind]())
    assert made.certificate.satisfied
    trajectory, acceleration, jerk = made.trajectory, robot.limit("acceleration"), robot.limit("jerk")
    used = []
    for segment, mass in enumerate((3.0, 1.5, 0.0)):
        begin, end = trajectory.departures[segment], trajectory.arrivals[segment + 1]
        times = np.linspace(begin + 1e-9, end - 1e-9, 20_000)
        a, j = trajectory.evaluate(times, [2, 3])
        share = np.abs(a).max(axis=0) / (acceleration * factor(mass, TABLE.acceleration))
        used.append(share.max())
        assert share.max() <= 1.0 + 1e-6
        if kind in KEEPS_JERK:
            assert (np.abs(j).max(axis=0) <= jerk * factor(mass, TABLE.jerk) * (1.0 + 1e-6)).all()
    assert max(used) > 0.9 or kind in ("quintic", "min_effort", "ruckig", "auto"), "where jerk does not bind, this does"


def test_a_request_narrows_the_limits_of_the_payload_further() -> None:
    robot = load_robot("ur5e").derived(payload_table=TABLE)
    requested = Limits(acceleration=tuple(0.4 * robot.limit("acceleration")), acceleration_scale=0.5)
    waypoints = [JointWaypoint((0.1,) * 6), JointWaypoint((0.2,) * 6, payload=Payload(5.0)), JointWaypoint((0.3,) * 6)]
    limits = PlanningProblem(robot, waypoints, limits=requested).segment_limits()
    np.testing.assert_allclose(limits.acceleration.upper[0], 0.5 * 0.4 * robot.limit("acceleration"))
    np.testing.assert_allclose(limits.acceleration.upper[1], 0.5 * 0.3 * robot.limit("acceleration"))
    np.testing.assert_allclose(limits.jerk.upper[1], 0.1 * robot.limit("jerk"))


def test_a_robot_with_a_payload_of_its_own_is_certified_within_the_limits_of_it() -> None:
    free = load_robot("ur5e")
    made = plan(PlanningProblem(free, [(0.0,) * 6, (1.0, -0.5, 0.5, 0.3, 0.2, 0.1)]), "quintic")
    robot = free.derived(payload_table=TABLE)
    assert certify(replace(robot, payload_table=None), made.trajectory).satisfied
    certificate = certify(robot.with_payload(Payload(2.0)), made.trajectory)
    jerk = next(check for check in certificate.checks if check.quantity == "jerk")
    assert jerk.limit == pytest.approx(0.4 * robot.limit("jerk")[robot.joint_names.index(jerk.joint or "")])
    assert not certificate.satisfied


def test_factors_are_monotone_between_and_beyond_the_masses() -> None:
    masses = np.linspace(0.0, 9.0, 2001)
    for quantity in ("acceleration", "jerk"):
        factors = np.array([TABLE.factor(quantity, mass) for mass in masses])
        assert (np.diff(factors) <= 0.0).all()
    assert (TABLE.factor("acceleration", 0.0), TABLE.factor("acceleration", 99.0)) == (0.9, 0.3)
    assert TABLE.factor("velocity", 3.0) == replace(TABLE, jerk=None).factor("jerk", 3.0) == 1.0


@pytest.mark.parametrize(
    "table",
    [
        PayloadTable((1.0,), (1.0,)),
        PayloadTable((1.0, 1.0), (1.0, 0.5)),
        PayloadTable((-1.0, 1.0), (1.0, 0.5)),
        PayloadTable((1.0, 2.0), (0.5, 1.0)),
        PayloadTable((1.0, 2.0), (1.1, 1.0)),
        PayloadTable((1.0, 2.0), (1.0, 0.0)),
        PayloadTable((1.0, 2.0), (1.0, np.nan)),
        PayloadTable((1.0, 2.0), (1.0, 0.5), (1.0,)),
    ],
)
def test_tables_that_make_no_sense_are_refused(table: PayloadTable) -> None:
    with pytest.raises(InvalidRobotModel, match="payload table"):
        load_robot("ur5e").derived(payload_table=table)


def test_an_owner_narrows_a_table_and_does_not_widen_it() -> None:
    robot = load_robot("ur5e").derived(payload_table=TABLE)
    lower = PayloadTable((0.0, 6.0), (0.3, 0.2), (0.1, 0.1))
    assert robot.derived(payload_table=lower).payload_table == lower
    assert robot.derived().payload_table == TABLE
    with pytest.raises(InvalidRobotModel, match="must not allow more"):
        robot.derived(payload_table=replace(TABLE, jerk=None))
