"""Least-cost motions by IPOPT: the program of a robot and layout, built once, solved for any numbers.

Half of an iteration goes into the second derivative and the slopes of the torques, a third into linear algebra. These
alternatives were measured. fatrop on states and jerks, with derivatives by CasADi, takes 1.5 times as long; so does
IPOPT on the same stages. Gauss-Newton saves a sixth of an iteration and needs up to three times as many. Stages
compiled by gcc halve the time, 0.1 s for 50 knots and six joints, but each robot and payload takes 11 s to compile.
"""

from __future__ import annotations

from collections.abc import Sequence
from threading import get_ident
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from planner.backends.min_effort.numbers import TOOL_SHARES, Layout, Numbers
from planner.backends.min_effort.stage import path_stage_of, stage_of, tool_stage_of
from planner.backends.min_effort.terms import RESTING, Parameters, Rows, build_terms, with_derivatives
from planner.dynamics.symbolic import dynamics_content
from planner.last_used import LastUsed
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.trajectories.polynomials import PiecewisePolynomial

SOLVER_LIMIT_SHARE = 1.0 - 1e-7
"""Share of a limit that the solver may use, so that its own tolerance stays within the limit."""

IPOPT: dict[str, Any] = {
    "sb": "yes",
    "print_level": 0,
    "tol": 3e-5,
    "constr_viol_tol": 1e-9,
    "bound_relax_factor": 1e-10,
    "mu_init": 3e-3,
    "max_iter": 200,
    "mumps_scaling": 0,
    "mumps_permuting_scaling": 0,
}
"""Options of the solver.

The cost is scaled to about 1, and the first motion is near the limits already. So are the rows of the linear systems:
MUMPS would take a sixth of the time to scale them again. A first barrier parameter of 1e-4 saves one or two iterations,
but one of twelve searches then ended at a cost 9 % above the optimum.
"""

AGAIN: dict[str, Any] = IPOPT | {
    "warm_start_init_point": "yes",
    "mu_init": 1e-5,
    **{
        f"warm_start_{push}": 1e-9
        for push in ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
    },
}
"""Options of the solver from the solution of nearly the same numbers, which takes two thirds of the iterations."""

UNNEEDED = {"calc_lam_p": False, "no_nlp_grad": True}
"""Options that keep CasADi from building the sensitivity of the optimum to the parameters."""

NEARLY_THERE = 1e-6
"""Distance from a waypoint, by the group's travel, up to which an iterate is put onto it."""

BYTES_PER_NUMBER = 16
"""Memory of a program for each number in the work vectors of its functions, bytes.

A number has 8 bytes, and IPOPT needs as much again for its factors. For 20 to 50 segments of six joints the estimate is
30 to 80 MB; 25 to 100 MB were measured.
"""

PROGRAM_BYTES = 2**25
"""Memory of the programs that a process keeps, bytes; one of a single segment with six joints has 4 to 8 MB. With four
times as much, 60 jobs of six arms brought a process from 520 to 1040 MB of private memory, and so to 720."""


class Motion(NamedTuple):
    """A spline in power form.

    Attributes:
        lengths: (pieces,), s.
        coefficients: (pieces, joints, 4), ascending powers of local time.
        converged: Whether it is an optimum.
        iterations: The number of iterations.
        unknowns: The solution of the program.
        multipliers: The multipliers of the bounds and of the constraints, in the solver's order.
    """

    lengths: FloatArray
    coefficients: FloatArray
    converged: bool
    iterations: int
    unknowns: FloatArray
    multipliers: tuple[Any, Any]


LEAST_DURATION_RATIO = 0.25
"""Lower bound on a free duration, as a multiple of its first guess."""

MOST_TIME = 10.0
"""Upper bound on a free duration, as a multiple of its first guess."""


class Program:
    """The program of one robot and layout, parametric in all numbers."""

    def __init__(self, robot: Robot, layout: Layout) -> None:
        self.layout, self.joints, self.pieces = layout, robot.dof, layout.segments * layout.intervals
        parameters = Parameters(layout, robot.dof)
        terms, p = build_terms(layout, robot.dof, parameters), parameters.all
        limited = []
        if layout.watches_tool:
            none = ca.MX(0, layout.tool_instants)
            limited.append(Rows(tool_stage_of(robot), terms.tool_states, none, parameters.tool))
        if layout.path_instants:
            path_stage = path_stage_of(robot, layout.holds_tool, layout.holds_joints)
            limited.append(Rows(path_stage, terms.path_states, parameters.reference, parameters.near))
        functions = with_derivatives(terms, parameters, stage_of(robot, layout.objective), limited)
        count = {name: terms.x.numel() if name == "x" else functions["jac_g"].size1_out("g") for name in ("x", "g")}
        self.inequalities = count["g"] - terms.at_via.numel() - 1
        self.watch = _Watch(count["x"], count["g"], p.numel(), self.inequalities)
        value, derivatives = functions.pop("value"), functions
        shared: dict[str, Any] = {"iteration_callback": self.watch, "print_time": False, **UNNEEDED, **derivatives}
        f, g = value(terms.x, p)
        program: dict[str, Any] = {"x": terms.x, "p": p, "f": f, "g": g}
        self.solver, self.solver_again = (
            ca.nlpsol("least_cost", "ipopt", program, {**shared, "ipopt": own}) for own in (IPOPT, AGAIN)
        )
        self.motion = ca.Function("motion", [terms.x, p], terms.motion)
        self.at_via = ca.Function("at_via", [terms.x, p], [terms.at_via, ca.jacobian(terms.at_via, terms.x)])

    def solve(
        self,
        m: Numbers,
        first: PiecewisePolynomial,
        iterations: int,
        fruitless: int,
        again: Motion | None = None,
    ) -> Motion | None:
        """Return the optimum, or the best motion within the limits after all iterations; None: no motion.

        Args:
            m: The numbers of the program.
            first: The motion at the start, with the same durations.
            iterations: The largest number of iterations.
            fruitless: The largest number of iterations before one is within the limits.
            again: This program's solution for similar numbers, at which to start instead.

        Raises:
            MemoryError: The solver ran out of memory.
        """
        length, unit_time = float(np.abs(m.positions - m.positions[0]).max()), float(m.durations.mean())
        p = self._numbers(m, length, unit_time)
        durations = m.durations / unit_time
        box = self._box(m, length)
        begin = np.concatenate([np.clip(self._coefficients(first, m, length), *box), durations])
        via = np.zeros(self.joints * (self.layout.segments - 1))
        sides = self._sides(m)
        total = [-np.inf, np.inf] if m.total is None else [m.total / unit_time] * 2
        self.watch.begin(iterations, fruitless, sides)
        solver, known = self.solver, {}
        if again is not None:
            solver, begin = self.solver_again, again.unknowns
            known = dict(zip(("lam_x0", "lam_g0"), again.multipliers, strict=True))
        result = solver(
            **known,
            x0=begin,
            p=p,
            lbx=np.concatenate([box[0], np.where(m.free, LEAST_DURATION_RATIO, 1.0) * durations]),
            ubx=np.concatenate([box[1], np.where(m.free, MOST_TIME, 1.0) * durations]),
            lbg=np.concatenate([-SOLVER_LIMIT_SHARE * sides[0], via, total[:1]]),
            ubg=np.concatenate([SOLVER_LIMIT_SHARE * sides[1], via, total[1:]]),
        )
        stats = solver.stats()
        if stats["return_status"] == "Insufficient_Memory":
            raise MemoryError
        converged = bool(stats["success"])
        x = np.array(result["x"]).ravel() if converged else self.watch.best
        if x is None:
            return None
        x = self._onto_waypoints(x, p)
        found = np.where(m.free, x[-self.layout.segments :] * unit_time, m.durations)
        return Motion(
            self._lengths(found),
            self._powers(x, p, m.positions[0]),
            converged,
            int(stats["iter_count"]),
            x,
            (result["lam_x"], result["lam_g"]),
        )

    @property
    def memory(self) -> int:
        """The bytes that it takes, about."""
        functions = map(self.solver.get_function, self.solver.get_function())
        return BYTES_PER_NUMBER * sum(int(function.sz_w()) for function in functions)

    def _lengths(self, durations: FloatArray) -> FloatArray:
        """Give the lengths (pieces,), s, of pieces on a grid of numbers on which they sum to the durations exactly."""
        column = durations[:, None]
        even = np.arange(self.layout.intervals + 1) / self.layout.intervals
        return np.diff((even * column + column) - column, axis=1).ravel()

    def _numbers(self, m: Numbers, length: float, unit_time: float) -> FloatArray:
        """Return all numbers in one row, in the program's order."""
        segments = np.repeat(np.arange(self.layout.segments), self.layout.intervals)
        velocity, acceleration, jerk = 1.0 / m.rates.min(axis=1)[:, segments]
        torque, tool = 1.0 / m.torque.min(axis=0), 1.0 / m.tool
        tool = np.vstack([np.maximum(tool[:-1], tool[1:]), *[tool] * len(TOOL_SHARES)])[: self.layout.tool_instants]
        points = (m.positions - m.positions[0]) / length
        parts = [
            points[-1],
            [length, unit_time],
            points[1:-1].T,
            np.max([velocity[:-2], velocity[1:-1], velocity[2:]], axis=0).T,
            np.maximum(acceleration[:-1], acceleration[1:]).T,
            jerk.T,
            np.maximum(torque[:-1], torque[1:]).T,
            tool.T,
            *self._reference(m),
            m.half_spaces,
            m.units[:2],
            m.units[2],
            m.free.astype(float),
            [m.time_weight, *m.resting],
            m.positions[0],
            [1.0 / m.cost],
        ]
        return np.concatenate([np.ravel(part, order="F") for part in parts])

    def _sides(self, m: Numbers) -> FloatArray:
        """Return the lower and upper limits (2, inequalities) in units of the narrower of both, by which they count."""
        segments = np.repeat(np.arange(self.layout.segments), self.layout.intervals)
        velocity, acceleration, jerk = m.rates[:, :, segments]
        limits = [
            np.minimum(m.torque[:, :-1], m.torque[:, 1:]),
            np.min([velocity[:, :-2], velocity[:, 1:-1], velocity[:, 2:]], axis=0),
            np.minimum(acceleration[:, :-1], acceleration[:, 1:]),
            jerk,
        ]
        with np.errstate(invalid="ignore"):
            ratios = [own / own.min(axis=0) for own in limits]
        torque, *rates = (np.where(np.isnan(own), 1.0, own).reshape(2, -1) for own in ratios)
        rims = np.ones((2, self.layout.half_spaces * self.layout.dense_instants)) * [[np.inf], [1.0]]
        rows = self.inequalities - torque.shape[1] - sum(own.shape[1] for own in [*rates, rims])
        return np.concatenate([torque, np.ones((2, rows)), *rates, rims], axis=1)

    def _reference(self, m: Numbers) -> list[FloatArray]:
        """Return the reciprocals of the limits of how near the way is, and its constants."""
        if m.reference is None:
            return []
        return [
            np.tile(1.0 / m.near[:, None], self.layout.path_instants),
            m.reference.constants(*(own[: self.layout.path_instants] for own in self.layout.dense_shares)).T,
        ]

    def _box(self, m: Numbers, length: float) -> tuple[FloatArray, FloatArray]:
        """Return the bounds on the unknown coefficients, from the position limits."""
        count = self.pieces + 3 - 2 * RESTING
        lower, upper = (np.tile((limit - m.positions[0]) / length, count) for limit in (m.lower, m.upper))
        return lower, upper

    def _coefficients(self, motion: PiecewisePolynomial, m: Numbers, length: float) -> FloatArray:
        """Return the unknown ones of the spline near a motion: its blossoms, by Taylor's formula at the breakpoints."""
        h = np.repeat(m.durations / self.layout.intervals, self.layout.intervals)
        inner = slice(1, self.pieces - 2)
        q, v, a = motion.evaluate(np.cumsum(h)[inner])
        before, after = h[:-1, None][inner], h[1:, None][inner]
        coefficients = q + (after - before) / 3.0 * v - before * after / 6.0 * a
        normal: FloatArray = ((coefficients - m.positions[0]) / length).ravel()
        return normal

    def _onto_waypoints(self, x: FloatArray, p: FloatArray) -> FloatArray:
        """Return the nearest coefficients that meet the waypoints beyond the solver's tolerance."""
        if self.layout.segments == 1:
            return x
        error, slopes = self.at_via(x, p)
        inner = len(x) - self.layout.segments
        rows = slopes.sparse()[:, :inner]
        # A position depends on three coefficients, and waypoints are more intervals apart: the rows are orthogonal.
        change = rows.T @ (np.array(error).ravel() / rows.multiply(rows).sum(axis=1).A1)
        return np.concatenate([x[:inner] - change, x[inner:]])

    def _powers(self, x: FloatArray, p: FloatArray, origin: FloatArray) -> FloatArray:
        """Return the coefficients (pieces, joints, 4) of the powers of local time."""
        q, v, a, j, _ = (np.array(value) for value in self.motion(x, p))
        powers = [q[:, :-1] + origin[:, None], v[:, :-1], a[:, :-1] / 2.0, j / 6.0]
        return np.stack(powers, axis=-1).transpose(1, 0, 2)


class _Watch(ca.Callback):
    """What CasADi calls at every iteration: it keeps the best iterate within the limits, and stops after some."""

    def __init__(self, unknowns: int, constraints: int, parameters: int, inequalities: int) -> None:
        ca.Callback.__init__(self)
        of_both = {"x": unknowns, "lam_x": unknowns, "g": constraints, "lam_g": constraints}
        self.shapes, self.inequalities = {**of_both, "f": 1, "lam_p": parameters}, inequalities
        self.begin(0, 0, np.ones((2, inequalities)))
        self.construct("watch", {})

    def begin(self, iterations: int, fruitless: int, sides: FloatArray) -> None:
        self.sides = sides
        self.left, self.fruitless, self.least = iterations, fruitless, np.inf
        self.best: FloatArray | None = None

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return str(ca.nlpsol_out(i))

    def get_sparsity_in(self, i: int) -> Any:
        return ca.Sparsity.dense(self.shapes[ca.nlpsol_out(i)])

    def eval(self, arguments: Sequence[ca.DM]) -> list[int]:
        x, f, g = (np.array(value).ravel() for value in arguments[:3])
        rates, at_via = g[: self.inequalities], g[self.inequalities : -1]
        within = bool((rates <= self.sides[1]).all() and (rates >= -self.sides[0]).all())
        inside = within and np.abs(at_via).max(initial=0.0) <= NEARLY_THERE
        if inside and f[0] < self.least:
            self.best, self.least = x, float(f[0])
        self.left, self.fruitless = self.left - 1, self.fruitless - 1
        return [int(self.left < 0 or (self.best is None and self.fruitless < 0))]


_programs: LastUsed[Program] = LastUsed(PROGRAM_BYTES, lambda program: program.memory)


def program_of(robot: Robot, layout: Layout) -> Program:
    """Return the program of a robot and layout, built at first use and kept while the last used leave room.

    A program watches one search at a time, so that each thread has its own.
    """
    return _programs.get((get_ident(), dynamics_content(robot), layout), lambda: Program(robot, layout))
