"""Waypoints in, certified joint trajectory out.

The library of the trajectory planner: `plan` takes a `PlanningProblem` to a certified `Plan`. Every public name stands
here and is loaded when it is first used, so that importing the package alone costs nothing. Positions, velocities,
forces and times are in SI units throughout (m, rad, s, N); in arrays rows are time and columns are joints.

Examples:
    >>> import planner
    >>> robot = planner.load_robot("kuka_kr16_2")
    >>> home = planner.JointWaypoint([0.0, -1.5, 1.5, 0.0, 0.5, 0.0])
    >>> pick = planner.JointWaypoint([1.0, -1.2, 1.2, 0.0, 0.5, 0.5])
    >>> plan = planner.plan(planner.PlanningProblem(robot, [home, pick]), planner.Trapezoidal())
    >>> print(f"{plan.trajectory.duration:.4f} s")
    0.7666 s
"""

import ast
from importlib import import_module
from pathlib import Path

_MODULES = {
    alias.name: str(node.module)
    for node in ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}
"""The module of each public name, from the imports that type checkers and editors see."""

__all__ = sorted(_MODULES)


def __getattr__(name: str) -> object:
    """Load a public name when it is first used."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_MODULES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*globals(), *__all__]
