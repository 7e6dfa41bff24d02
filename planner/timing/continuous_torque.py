"""Trajectories stretched until their continuous (RMS) torques keep the limits.

No limit at single times keeps a mean over the whole. Slower motions need less torque for accelerations, and the torques
that hold the arm remain.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner.backends.base import BackEnd
from planner.constraints.rms_torque import RmsTorque, bound_rms_torque, held_at_the_end
from planner.dynamics import SegmentDynamics
from planner.errors import LimitsUnsatisfiable, Remedy, distinct
from planner.paths import JointPath
from planner.problems.problem import PlanningProblem
from planner.spatial import FloatArray
from planner.timing.durations import is_rigid
from planner.trajectories.integrals import Nodes
from planner.trajectories.trajectory import Trajectory

BELOW = 1.0 - 1e-6
"""Share of a limit that the search aims at: the bound on the mean and the integration differ by less."""

FACTORS = np.geomspace(1.0, 1000.0, 600)
"""Factors on durations among which the search begins: 1.2 % apart."""

FACTOR_BISECTIONS = 40
"""Steps of bisection between two of these factors."""


def within_rms_torque(
    problem: PlanningProblem, backend: BackEnd, path: JointPath, trajectory: Trajectory
) -> Trajectory:
    """Stretch the motions whose durations are free, by one factor, until the RMS torques keep their limits.

    Raises:
        LimitsUnsatisfiable: No factor helps, or all durations are requested; the remedies are a longer cycle, a longer
            duration and a lighter payload.
    """
    rms = path.limits.rms
    if rms is None or not path.dynamics.has_dynamics or is_kept(path, trajectory, rms):
        return trajectory
    means, free = _Means(path.dynamics, trajectory, rms), np.isnan(path.durations)
    for group in path.every_group:
        free[group.segments] &= not is_rigid(backend, path, group)
    pieces = trajectory.moves & free[trajectory.segments]
    factor = None if problem.duration is not None else means.factor(pieces)
    slower = None if factor is None else trajectory.stretched(np.where(pieces, factor, 1.0))
    if slower is None or not is_kept(path, slower, rms):
        raise _refusal(problem, path, trajectory, rms, means)
    return slower


def is_kept(path: JointPath, trajectory: Trajectory, rms: RmsTorque) -> bool:
    """Tell whether the RMS torques of a trajectory keep their limits."""
    return bool((bound_rms_torque(path.dynamics, trajectory, rms)[1] <= rms.limits).all())


class _Means:
    """The means of squared torques over a cycle, by the factor on the duration of some pieces.

    In k times the time, torques against gravity and Coulomb friction remain. Viscous friction is divided by k, and
    torques of the motion by k^2.
    """

    def __init__(self, dynamics: SegmentDynamics, trajectory: Trajectory, rms: RmsTorque) -> None:
        self.rms, self.trajectory, self.dynamics = rms, trajectory, dynamics
        nodes = Nodes.of(trajectory)
        q, v, a, _ = nodes.states
        self.weights, self.nodes = nodes.weights[:, None], nodes
        self.by_pace = dynamics.torques_by_pace(nodes.segments, q, v, a)
        held, viscous, moved = self.by_pace
        self.torques = held + viscous + moved
        self.at_end = held_at_the_end(dynamics, trajectory) ** 2

    def squares(self) -> FloatArray:
        """Return the integrals (joints,) of the squared torques over the trajectory."""
        squares: FloatArray = (self.weights * self.torques**2).sum(axis=0)
        return squares

    def factor(self, pieces: np.ndarray) -> float | None:
        """Return the least factor on pieces (pieces,) that keeps the limits; None: none of up to 1000 does."""
        times = np.cumsum(self.weights[:, 0]) - 0.5 * self.weights[:, 0]
        free = pieces[self.trajectory.locate(times)[0]]
        own = self.weights * free[:, None]
        held, viscous, moved = self.by_pace
        squares = held**2, 2.0 * held * viscous, 2.0 * held * moved + viscous**2, 2.0 * viscous * moved, moved**2
        parts = [(own * part).sum(axis=0) for part in squares]
        fixed, seconds = self.squares() - sum(parts), float(own.sum())
        duration = self.trajectory.duration

        def keeps(factors: FloatArray) -> np.ndarray:
            k = factors[:, None]
            longer = duration + seconds * (k - 1.0)
            cycle = np.maximum(longer, self.rms.cycle_time)
            slower = sum(part * k ** (1 - power) for power, part in enumerate(parts))
            squares = fixed + slower + (cycle - longer) * self.at_end
            return np.asarray((squares <= (BELOW * self.rms.limits) ** 2 * cycle).all(axis=1))

        found = np.flatnonzero(keeps(FACTORS))
        if not len(found):
            return None
        high = float(FACTORS[found[0]])
        low = float(FACTORS[max(found[0] - 1, 0)])
        for _ in range(FACTOR_BISECTIONS):
            middle = (low + high) / 2.0
            low, high = (low, middle) if keeps(np.array([middle]))[0] else (middle, high)
        return high

    def cycle_time(self) -> float | None:
        """Return the least cycle time, s, that keeps the limits by rest after the end; None: holding takes too much."""
        room = (BELOW * self.rms.limits) ** 2 - self.at_end
        excess = self.squares() - self.trajectory.duration * self.at_end
        if (room <= 0.0).any():
            return None
        return float((excess / room).max())

    def share_of_mass(self, lighter: _Means) -> float:
        """Return the largest share of a payload's mass that keeps the limits; `lighter` has half of the mass."""
        cycle = self.rms.cycle(self.trajectory)
        torques = np.vstack([self.torques, np.sqrt(self.at_end)])
        halves = np.vstack([lighter.torques, np.sqrt(lighter.at_end)])
        without, of_mass = 2.0 * halves - torques, 2.0 * (torques - halves)
        weights = np.vstack([self.weights, [[cycle - self.trajectory.duration]]]) / cycle
        constant, linear, square = (
            (weights * part).sum(axis=0) for part in (without**2, 2.0 * without * of_mass, of_mass**2)
        )
        shares = np.linspace(0.0, 1.0, 1001)[:, None]
        kept = (constant + linear * shares + square * shares**2 <= (BELOW * self.rms.limits) ** 2).all(axis=1)
        return 0.0 if not kept[0] else float(shares[int(np.argmin(kept)) - 1, 0])


def _refusal(
    problem: PlanningProblem, path: JointPath, trajectory: Trajectory, rms: RmsTorque, means: _Means
) -> LimitsUnsatisfiable:
    """Return the refusal of RMS torques, with its remedies."""
    _, upper = bound_rms_torque(path.dynamics, trajectory, rms)
    joint = int((upper / rms.limits).argmax())
    value, limit = distinct(float(upper[joint]), float(rms.limits[joint]))
    name, cycle = path.robot.joint_names[joint], rms.cycle(trajectory)
    return LimitsUnsatisfiable(
        f"the RMS torque of {name} would be {value} over a cycle of {cycle:.6g} s, its limit is {limit}",
        joint=name,
        value=float(upper[joint]),
        limit=float(rms.limits[joint]),
        remedies=list(_remedies(problem, trajectory, means)),
    )


def _remedies(problem: PlanningProblem, trajectory: Trajectory, means: _Means) -> Iterator[Remedy]:
    """Yield a longer duration, a longer cycle and a lighter payload that keep the limits."""
    factor = None if problem.duration is None else means.factor(trajectory.moves)
    if factor is not None:
        longer = trajectory.duration + (factor - 1.0) * float(trajectory.lengths[trajectory.moves].sum())
        yield Remedy(("duration",), longer, "a duration of the whole that keeps the limits of the RMS torque")
    cycle = means.cycle_time()
    if cycle is not None:
        yield Remedy(("limits", "cycle_time"), cycle, "a cycle with enough rest after the trajectory, s")
    payload = problem.payload
    if payload is not None and all(w.payload is None and not w.put_down for w in problem.waypoints):
        half = SegmentDynamics.unchanged(problem.robot.with_payload(replace(payload, mass=0.5 * payload.mass)))
        share = means.share_of_mass(_Means(half, trajectory, means.rms))
        if share > 0.0:
            yield Remedy(("payload", "mass"), share * payload.mass, "a payload, kg, that keeps the RMS torque")
