"""The arithmetic of the checker against Pinocchio, coal, numpy and dense samples."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

import planner
from benchmarks.proofs.plans import ROBOTS, plans
from planner.proofs import write_proof
from planner.proofs.checker import (
    CONTACT,
    TOOL_CLAIMS,
    Model,
    Proof,
    bernstein,
    is_below,
    is_one_nonnegative,
    model,
    multiply,
    sine_and_cosine,
    turn_of,
    upper,
)
from planner.proofs.statement import pairs_of
from planner.scene.checker import checker_of

if TYPE_CHECKING:
    from numpy.polynomial import Polynomial

ROUNDING = 1e-9
"""Relative rounding error of the reference values."""

X = np.linspace(-1.0, 1.0, 21)
"""Points at which models are compared with values."""

numbers = st.floats(-3.0, 3.0)
models = st.tuples(*[numbers] * 6, st.floats(0.0, 0.1))


def value(f: Model, x: float) -> float:
    return float(np.polynomial.polynomial.polyval(x, f[:6]))


@pytest.fixture(scope="module")
def made() -> list[tuple[planner.Plan, Proof]]:
    return [(plan, Proof(write_proof(plan))) for plan in plans(np.random.default_rng(11), 2 * len(ROBOTS))]


def windows(proof: Proof, generator: np.random.Generator, count: int = 4) -> Any:
    """Yield random intervals of pieces, with times in them and their coordinates x in [-1, 1]."""
    for _ in range(count):
        piece = int(generator.integers(proof.pieces))
        start, end = sorted(generator.random(2))
        times = float(proof.begins[piece]) + float(proof.lengths[piece]) * (start + (end - start) * (X + 1.0) / 2.0)
        yield proof.motion(piece + start, piece + end), times


def test_models_of_torque_contain_the_torques_of_pinocchio(made: list[tuple[planner.Plan, Proof]]) -> None:
    generator = np.random.default_rng(1)
    for plan, proof in made:
        robot = plan.path.robot
        data = robot.model.createData()
        for (motion, _), times in windows(proof, generator):
            torques = motion.torques()
            states = plan.trajectory.evaluate(times)
            for x, q, v, a in zip(X, *states, strict=True):
                expected = pin.rnea(robot.model, data, q, v, a)
                for found, torque in zip(torques, expected, strict=True):
                    assert abs(value(found, x) - torque) <= found[6] + ROUNDING * (1.0 + abs(torque))
                    assert is_below(found, torque + 1e6) and not is_below(found, torque - 1e-6)


def test_models_of_the_tool_contain_its_velocities_and_accelerations(made: list[tuple[planner.Plan, Proof]]) -> None:
    generator = np.random.default_rng(2)
    for plan, proof in made:
        robot, axes = plan.path.robot, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        data = robot.model.createData()
        for (motion, _), times in windows(proof, generator):
            squares = motion.tool_squares()
            for x, q, v, a in zip(X, *plan.trajectory.evaluate(times), strict=True):
                pin.forwardKinematics(robot.model, data, q, v, a)
                velocity = pin.getFrameVelocity(robot.model, data, robot.tool_frame_id, axes)
                gain = pin.getFrameClassicalAcceleration(robot.model, data, robot.tool_frame_id, axes)
                parts = (velocity.linear, velocity.angular, gain.linear, gain.angular)
                for name, part in zip(TOOL_CLAIMS, parts, strict=True):
                    square = float(part @ part)
                    assert abs(value(squares[name], x) - square) <= squares[name][6] + ROUNDING * (1.0 + square)


def test_no_plane_proves_more_than_the_distance(made: list[tuple[planner.Plan, Proof]]) -> None:
    generator, tried = np.random.default_rng(3), 0
    for plan, proof in made:
        if "clearance" not in proof.claims:
            continue
        checker = checker_of(plan.path.robot, plan.problem.scene, plan.problem.self_collision)
        scene = proof.statement["scenes"][0]
        numbers = [number for number, _ in pairs_of(checker, plan.problem.speed_zones)["clearance"]]
        for start, end, planes in proof.evidence["clearance"]:
            motion, _ = proof.motion(start, end)
            first = int(start)
            last = max(first + 1, int(np.ceil(end)))
            times = np.array([float(t) for t in proof.begins[first : last + 1]])
            shares = (start - first, end - last + 1.0)
            ends = times[0] + shares[0] * (times[1] - times[0]), times[-2] + shares[1] * (times[-1] - times[-2])
            placements = checker.bodies.at(plan.trajectory.evaluate(np.linspace(*ends, 5), [0])[0])
            for pair, normal in planes:
                if generator.random() > 0.2:
                    continue
                number = numbers[pair]
                nearest = min(checker.separate(placements, row, number).distance for row in range(5))
                own = scene["clearance"][pair]
                assert motion.is_safe(scene, own, normal)
                assert not motion.is_safe(scene, [*own[:2], nearest + 2.0 * CONTACT], normal)
                tried += 1
    assert tried > 50


@given(st.lists(numbers, min_size=1, max_size=7), numbers)
def test_a_polynomial_is_nonnegative_where_samples_are(coefficients: list[float], lift: float) -> None:
    polynomial: Polynomial = np.polynomial.Polynomial(coefficients)
    samples = polynomial(np.linspace(0.0, 1.0, 2001))
    raised = [Fraction(c) for c in coefficients]
    raised[0] += Fraction(lift) - Fraction(float(samples.min()))
    row, common = bernstein(raised)
    assert min(row) / common <= lift + 1e-12
    if lift >= 1e-3:
        assert is_one_nonnegative(raised)
    if lift < -1e-12:
        assert not is_one_nonnegative(raised)


@given(st.lists(numbers, min_size=2, max_size=4))
def test_of_two_polynomials_one_is_nonnegative_everywhere(coefficients: list[float]) -> None:
    one = [Fraction(c) for c in coefficients]
    other = [-c + Fraction(1, 1000) for c in one[:1]] + [-c for c in one[1:]]
    assert is_one_nonnegative(one, other)
    gap = [-c - Fraction(1, 1000) for c in one[:1]] + [-c for c in one[1:]]
    samples = np.polynomial.Polynomial(coefficients)(np.linspace(0.0, 1.0, 5001))
    crosses = samples.min() < -0.01 and samples.max() > 0.01  # and is -0.0005 between
    assert is_one_nonnegative(one, gap) <= (not crosses)


@given(models, models)
def test_products_and_bounds_of_models_contain_values(f: Model, g: Model) -> None:
    product = multiply(f, g)
    for x in X:
        for sign in (-1.0, 1.0):
            a, b = value(f, x) + sign * f[6], value(g, x) - sign * g[6]
            assert abs(value(product, x) - a * b) <= product[6] * (1.0 + 1e-12) + 1e-12
        assert value(f, x) + f[6] <= upper(f) + 1e-14


@given(st.floats(-60.0, 60.0), st.lists(st.floats(-0.3, 0.3), min_size=5, max_size=5), st.floats(0.0, 0.01))
def test_models_of_sine_and_cosine_contain_values(middle: float, rest: list[float], error: float) -> None:
    sine, cosine = turn_of((middle, *rest, error))
    for x in X:
        q = np.longdouble(middle) + sum(np.longdouble(c) * x ** (k + 1) for k, c in enumerate(rest)) - error
        assert abs(value(sine, x) - np.sin(q)) <= sine[6] + 1e-15
        assert abs(value(cosine, x) - np.cos(q)) <= cosine[6] + 1e-15


@given(st.floats(-64.0, 64.0))
def test_sines_are_rounded_once(x: float) -> None:
    for found, exact in zip(sine_and_cosine(x), (np.sin(np.longdouble(x)), np.cos(np.longdouble(x))), strict=True):
        assert abs(found - exact) <= 2.0**-53 * (1.0 + 1e-3)


def test_higher_terms_go_to_the_remainder() -> None:
    f = model([1 / (k + 1) for k in range(9)])
    assert f[6] >= 1 / 7 + 1 / 8 + 1 / 9
    assert upper(f) >= sum(1 / (k + 1) for k in range(9))
