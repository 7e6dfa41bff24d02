"""The nonlinear program of a least-cost motion: a cubic B-spline in time, held to its limits by its coefficients.

Each joint is a cubic B-spline over the segments of a run, every segment in equal intervals: C2, with piecewise linear
acceleration and piecewise constant jerk. The coefficients of a B-spline and of its derivatives bound it (de Boor, A
Practical Guide to Splines, 2001, ch. IX and XI), so position, velocity, acceleration and jerk keep their limits
everywhere if the coefficients do. Torques and tool speeds are held at the breakpoints, where also the cost is summed
by the trapezoidal rule. The first and the last three coefficients are the ends: rest, without acceleration.

Unknown are the other coefficients and the durations of the segments. Lengths are measured by the run's largest travel,
times by its mean segment, so that motions of any size look alike to the solver. CasADi differentiates; the second
derivatives of the torques are put together by the chain rule from one function mapped over the breakpoints, which
leaves a tenth of the operations of colouring the whole program.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planner.backends.effort_stage import build_stage
from planner.dynamics.symbolic import dynamics_content

if TYPE_CHECKING:
    import casadi as ca

    from planner.backends.effort_cost import Objective
    from planner.kinematics.poses import FloatArray
    from planner.polynomials import PiecewisePolynomial
    from planner.robots import Robot

INSIDE = 1.0 - 1e-7
"""Of a limit: what the solver may use, so that its own tolerance stays within the limit."""

MOST_ITERATIONS = 200

CACHED_PROGRAMS = 8
"""Programs that a worker keeps, some MB each."""

import json, os; EXTRA = json.loads(os.environ.get("EXTRA","{}"))
RESTING = 3
"""Coefficients at each end that are the end position itself."""


class Layout(NamedTuple):
    """What a program is built for; motions of the same layout differ in numbers only.

    Attributes:
        segments: Passed without stopping.
        intervals: Of the spline on each segment.
        objective: What is minimised.
        watches_tool: Whether the tool's speed is limited.
    """

    segments: int
    intervals: int
    objective: Objective
    watches_tool: bool


class Numbers(NamedTuple):
    """A motion to be found.

    Attributes:
        positions: (segments + 1, joints), rad or m.
        lower: (joints,), position limits.
        upper: (joints,).
        rates: (3, segments, joints): limits of velocity, acceleration and jerk, infinite: none.
        watched: (segments, joints or joints + 2): limits of torque and of the squared tool speeds.
        units: (3, joints): what torque, power and jerk are measured by in the cost.
        durations: (segments,), s: those asked or, where free, a first guess.
        free: (segments,), whether a duration is to be found.
        total: s, of the free durations together; None: to be found, too.
        time_weight: Cost of a second.
        cost: Of the first guess, to scale by.
        resting: Cost of a second at rest at the start, and at the end.
    """

    positions: FloatArray
    lower: FloatArray
    upper: FloatArray
    rates: FloatArray
    watched: FloatArray
    units: FloatArray
    durations: FloatArray
    free: np.ndarray
    total: float | None
    time_weight: float
    cost: float
    resting: FloatArray


class Motion(NamedTuple):
    """A spline in power form.

    Attributes:
        lengths: (pieces,), s.
        coefficients: (pieces, joints, 4), ascending powers of local time.
        converged: Whether it is an optimum.
    """

    lengths: FloatArray
    coefficients: FloatArray
    converged: bool


LEAST_TIME, MOST_TIME = 0.25, 10.0
"""Bounds on a free duration, as multiples of its first guess."""


class Program:
    """The program of one robot and layout, parametric in all numbers."""

    def __init__(self, robot: Robot, layout: Layout) -> None:
        import casadi as ca

        self.layout, self.joints = layout, robot.dof
        n, segments, pieces = robot.dof, layout.segments, layout.segments * layout.intervals
        self.pieces = pieces
        stage = build_stage(robot, layout.objective, layout.watches_tool)
        knots = pieces - 1
        watched = n + 2 * layout.watches_tool

        # Parameters.
        end = ca.MX.sym("end", n)
        scale = ca.MX.sym("scale", 2)  # of length and time
        via = ca.MX.sym("via", n, segments - 1)
        inverse = [
            ca.MX.sym(name, n, count)
            for name, count in (("velocity", pieces - 2), ("acceleration", knots), ("jerk", pieces))
        ]
        limits = ca.MX.sym("watched", watched, knots)
        units, unit_jerk = ca.MX.sym("units", 2, n), ca.MX.sym("unit_jerk", n)
        is_free, weights = ca.MX.sym("free", segments), ca.MX.sym("weights", 3)
        origin, objective_scale = ca.MX.sym("origin", n), ca.MX.sym("objective_scale")
        parameters = [end, scale, via, *inverse, limits, units, unit_jerk, is_free, weights, origin, objective_scale]
        p = ca.veccat(*parameters)

        # Unknowns and the motion that they are.
        x = ca.MX.sym("x", n * (pieces + 3 - 2 * RESTING) + segments)
        inner = ca.reshape(x[:-segments], n, -1)
        times = x[-segments:]
        control = ca.horzcat(ca.MX(n, RESTING), inner, ca.repmat(end, 1, RESTING))
        h = ca.repmat(ca.kron(times.T / layout.intervals, ca.DM.ones(1, layout.intervals)), n, 1)
        length, second = scale[0], scale[1]
        q, v, a, j, d = _spline(control, h)
        v, d, a, j = v * length / second, d * length / second, a * length / second**2, j * length / second**3
        q, h = q * length, h * second
        self.motion = ca.Function("motion", [x, p], [q, v, a, j, h[0, :]])

        # At the inner breakpoints the mapped stage, with the time that each stands for.
        stands_for = (h[0, :-1] + h[0, 1:]) / 2.0
        z = ca.vertcat(q[:, 1:-1] + ca.repmat(origin, 1, knots), v[:, 1:-1], a[:, 1:-1], stands_for)
        cost, at_knots = stage.value.map(knots)(z, ca.repmat(units, 1, knots))
        smooth = weights[0] * ca.sum1(times) * second
        if layout.objective == "jerk":
            smooth = smooth + ca.sum1(ca.sum2((j / ca.repmat(unit_jerk, 1, pieces)) ** 2 * h))
        # The cost at rest, at both ends: half an interval each.
        smooth = smooth + weights[1] * h[0, 0] / 2.0 + weights[2] * h[0, -1] / 2.0
        rate_rows = [ca.vec(d[:, 2:-2] * inverse[0]), ca.vec(a[:, 1:-1] * inverse[1]), ca.vec(j * inverse[2])]
        at_via = ca.vec(q[:, layout.intervals : -1 : layout.intervals] / length - via)
        rest = ca.vertcat(*rate_rows, at_via, ca.dot(is_free, times))

        state = ca.vec(z)
        D = ca.jacobian(state, x)
        slope_cost, slope_watched = stage.slopes.map(knots)(z, ca.repmat(units, 1, knots))
        states = 3 * n + 1
        blocks = ca.diagcat(*[ca.Sparsity.dense(watched, states)] * knots)
        watched_slopes = ca.sparsity_cast(ca.vec(slope_watched * 1.0), blocks)
        f = (ca.sum2(cost) + smooth) * objective_scale
        g = ca.vertcat(ca.vec(at_knots * limits), rest)
        gradient = (ca.vec(slope_cost).T @ D + ca.jacobian(smooth, x)) * objective_scale
        jac = ca.vertcat(ca.diag(ca.vec(limits)) @ (watched_slopes @ D), ca.jacobian(rest, x))

        factor, multipliers = ca.MX.sym("factor"), ca.MX.sym("multipliers", g.numel())
        own = ca.reshape(multipliers[: watched * knots], watched, knots) * limits
        H, first = stage.curvature.map(knots)(
            z, ca.repmat(units, 1, knots), ca.repmat(factor * objective_scale, 1, knots), own
        )
        square = ca.diagcat(*[ca.Sparsity.dense(states, states)] * knots)
        seeds = ca.MX.sym("seeds", state.numel())
        other = ca.dot(seeds, state) + factor * objective_scale * smooth + ca.dot(multipliers[watched * knots :], rest)
        bent = ca.graph_substitute(ca.hessian(other, x)[0], [seeds], [ca.vec(first)])
        hessian = ca.triu(D.T @ ca.sparsity_cast(ca.vec(H), square) @ D + bent)
        self.watch = _watch_of(x.numel(), g.numel(), p.numel(), g.numel() - at_via.numel() - 1)
        options = {
            "iteration_callback": self.watch,
            "print_time": False,
            "grad_f": ca.Function("nlp_grad_f", [x, p], [f, gradient.T], ["x", "p"], ["f", "grad_f_x"]),
            "jac_g": ca.Function("nlp_jac_g", [x, p], [g, jac], ["x", "p"], ["g", "jac_g_x"]),
            "hess_lag": ca.Function(
                "nlp_hess_l", [x, p, factor, multipliers], [hessian], ["x", "p", "lam_f", "lam_g"], ["hess"]
            ),
            "ipopt": {
                "print_level": 0,
                "sb": "yes",
                "tol": 1e-5,
                "mu_init": 1e-3,
                "constr_viol_tol": 1e-9,
                "bound_relax_factor": 1e-10,
                "max_iter": MOST_ITERATIONS,
                **EXTRA,
            },
        }
        self.solver = ca.nlpsol("least_cost", "ipopt", {"x": x, "p": p, "f": f, "g": g}, options)
        self.at_via = ca.Function("via", [x, p], [at_via, ca.jacobian(at_via, x)])

    def solve(self, m: Numbers, first: PiecewisePolynomial, stop_at: float | None) -> Motion:
        """The optimum, or the best motion within the limits that there was when time was up.

        Args:
            m: What is asked.
            first: A motion to begin with, one piece a segment.
            stop_at: By the monotonic clock, s; None: no limit of time.
        """
        length, unit_time = float(np.abs(m.positions - m.positions[0]).max()), float(m.durations.mean())
        p = self._parameters(m, length, unit_time)
        durations = m.durations / unit_time
        box = self._box(m, length)
        begin = np.clip(self._coefficients(first, m.positions[0], length), *box)
        via = np.zeros(self.joints * (self.layout.segments - 1))
        inequalities = np.full(self.solver.size1_in("lbg") - len(via) - 1, INSIDE)
        total = [-np.inf, np.inf] if m.total is None else [m.total / unit_time] * 2
        self.watch.begin(stop_at)
        result = self.solver(
            x0=np.concatenate([begin, durations]),
            p=p,
            lbx=np.concatenate([box[0], np.where(m.free, LEAST_TIME, 1.0) * durations]),
            ubx=np.concatenate([box[1], np.where(m.free, MOST_TIME, 1.0) * durations]),
            lbg=np.concatenate([-inequalities, via, total[:1]]),
            ubg=np.concatenate([inequalities, via, total[1:]]),
        )
        converged = bool(self.solver.stats()["success"])
        x = np.array(result["x"]).ravel() if converged or self.watch.best is None else self.watch.best
        return Motion(*self._pieces(self._onto_waypoints(x, p), p, m.positions[0]), converged)

    def _parameters(self, m: Numbers, length: float, unit_time: float) -> FloatArray:
        """In the order in which the program has them."""
        owners = np.repeat(np.arange(self.layout.segments), self.layout.intervals)
        velocity, acceleration, jerk = 1.0 / m.rates[:, owners]
        watched = 1.0 / m.watched[owners]
        points = (m.positions - m.positions[0]) / length
        parts = [
            points[-1],
            [length, unit_time],
            points[1:-1].T,
            np.max([velocity[:-2], velocity[1:-1], velocity[2:]], axis=0).T,
            np.maximum(acceleration[:-1], acceleration[1:]).T,
            jerk.T,
            np.maximum(watched[:-1], watched[1:]).T,
            m.units[:2],
            m.units[2],
            m.free.astype(float),
            [m.time_weight, *m.resting],
            m.positions[0],
            [1.0 / m.cost],
        ]
        return np.concatenate([np.ravel(part, order="F") for part in parts])

    def _box(self, m: Numbers, length: float) -> tuple[FloatArray, FloatArray]:
        """Bounds on the coefficients that are unknown, by the position limits."""
        count = self.pieces + 3 - 2 * RESTING
        lower, upper = (np.tile((limit - m.positions[0]) / length, count) for limit in (m.lower, m.upper))
        return lower, upper

    def _coefficients(self, motion: PiecewisePolynomial, origin: FloatArray, length: float) -> FloatArray:
        """The unknown ones of the spline near a motion: its blossoms, by Taylor's formula at the breakpoints."""
        h = np.repeat(motion.lengths / self.layout.intervals, self.layout.intervals)
        inner = slice(1, self.pieces - 2)
        q, v, a = motion.evaluate(np.cumsum(h)[inner])
        before, after = h[:-1, None][inner], h[1:, None][inner]
        coefficients = q + (after - before) / 3.0 * v - before * after / 6.0 * a
        return ((coefficients - origin) / length).ravel()

    def _onto_waypoints(self, x: FloatArray, p: FloatArray) -> FloatArray:
        """The nearest coefficients that meet the waypoints beyond the solver's tolerance."""
        if self.layout.segments == 1:
            return x
        error, slopes = self.at_via(x, p)
        inner = len(x) - self.layout.segments
        change = np.linalg.lstsq(np.array(slopes)[:, :inner], np.array(error).ravel())[0]
        return np.concatenate([x[:inner] - change, x[inner:]])

    def _pieces(self, x: FloatArray, p: FloatArray, origin: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lengths (pieces,), and coefficients (pieces, joints, 4) in powers of local time."""
        q, v, a, j, h = (np.array(value) for value in self.motion(x, p))
        powers = [q[:, :-1] + origin[:, None], v[:, :-1], a[:, :-1] / 2.0, j / 6.0]
        return h.ravel(), np.stack(powers, axis=-1).transpose(1, 0, 2)


def _watch_of(unknowns: int, constraints: int, parameters: int, inequalities: int) -> Any:
    """What CasADi calls at every iteration: keeps the best iterate within the limits, and stops when time is up."""
    import casadi as ca

    shapes = {"x": unknowns, "f": 1, "g": constraints, "lam_x": unknowns, "lam_g": constraints, "lam_p": parameters}

    class Watch(ca.Callback):  # type: ignore[misc] # CasADi has no types
        def __init__(self) -> None:
            ca.Callback.__init__(self)
            self.begin(None)
            self.construct("watch", {})

        def begin(self, stop_at: float | None) -> None:
            self.stop_at, self.best, self.least = stop_at, None, np.inf

        def get_n_in(self) -> int:
            return int(ca.nlpsol_n_out())

        def get_n_out(self) -> int:
            return 1

        def get_name_in(self, i: int) -> str:
            return str(ca.nlpsol_out(i))

        def get_sparsity_in(self, i: int) -> Any:
            return ca.Sparsity.dense(shapes[ca.nlpsol_out(i)])

        def eval(self, arguments: list[Any]) -> list[int]:
            if self.stop_at is None:
                return [0]
            x, f, g = (np.array(value).ravel() for value in arguments[:3])
            inside = np.abs(g[:inequalities]).max() <= 1.0 and np.abs(g[inequalities:-1]).max(initial=0.0) <= 1e-6
            if inside and f[0] < self.least:
                self.best, self.least = x, float(f[0])
            return [int(time.monotonic() > self.stop_at)]

    return Watch()


_programs: dict[tuple[bytes, Layout], Program] = {}


def program_of(robot: Robot, layout: Layout) -> Program:
    """The program of a robot and layout, built when first asked for and kept while it is among the last used."""
    key = (dynamics_content(robot), layout)
    program = _programs.pop(key, None) or Program(robot, layout)
    _programs[key] = program
    while len(_programs) > CACHED_PROGRAMS:
        del _programs[next(iter(_programs))]
    return program


def _spline(c: ca.MX, h: ca.MX) -> tuple[ca.MX, ca.MX, ca.MX, ca.MX, ca.MX]:
    """Position, velocity and acceleration at the breakpoints, jerk between them, and the coefficients of velocity.

    Args:
        c: (joints, pieces + 3), coefficients of the cubic B-spline.
        h: (joints, pieces), lengths of the intervals, the same in each row; the first and last go on beyond the ends.
    """
    import casadi as ca

    pieces = h.shape[1]
    h = ca.horzcat(h[:, 0], h[:, 0], h, h[:, -1], h[:, -1])
    d = 3.0 * (c[:, 1:] - c[:, :-1]) / (h[:, : pieces + 2] + h[:, 1 : pieces + 3] + h[:, 2:])
    before, after = h[:, 1 : pieces + 2], h[:, 2 : pieces + 3]
    both = before + after
    a = 2.0 * (d[:, 1:] - d[:, :-1]) / both
    v = (d[:, :-1] * after + d[:, 1:] * before) / both
    q = c[:, 1:-1] + (d[:, 1:] * before**2 - d[:, :-1] * after**2) / (3.0 * both)
    j = (a[:, 1:] - a[:, :-1]) / h[:, 2:-2]
    return q, v, a, j, d
