"""C headers, compiled and run beside the trajectory."""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from planner.backends import Quintic, Ruckig, Toppra
from planner.errors import UnsupportedFormat
from planner.export import render
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.actions import AtWaypoint, SetOutput
from planner.problems.problem import PlanningProblem
from tests.planner.problems_of_tests import problem_of

PROGRAM = r"""
#include <stdio.h>
#include "trajectory.h"
int main(void) {
  double time;
  while (scanf("%lf", &time) == 1) {
    planned_real position[PLANNED_JOINTS], velocity[PLANNED_JOINTS];
    planned_evaluate((planned_real)time, position, velocity);
    for (int i = 0; i < PLANNED_JOINTS; i++) printf("%.17g %.17g ", (double)position[i], (double)velocity[i]);
    printf("\n");
  }
  return 0;
}
"""


AnyBackend = Quintic | Ruckig | Toppra


def compiler() -> list[str]:
    """Find a C compiler: gcc, or that of the package ziglang."""
    if gcc := shutil.which("gcc"):
        return [gcc]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc"]
    pytest.skip("there is no C compiler")


def run(header: bytes, folder: Path, times: np.ndarray, real: str) -> tuple[np.ndarray, np.ndarray]:
    """Compile a header with a program that evaluates it at times; return positions and velocities."""
    (folder / "trajectory.h").write_bytes(header)
    (folder / "main.c").write_text(PROGRAM)
    options = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", f"-DPLANNED_REAL={real}"]
    command = [*compiler(), *options, str(folder / "main.c"), "-o", str(folder / "run")]
    subprocess.run(command, check=True, timeout=120)
    text = "\n".join(map(repr, times.tolist()))
    done = subprocess.run([str(folder / "run")], input=text, capture_output=True, text=True, check=True, timeout=60)
    rows = np.array([line.split() for line in done.stdout.splitlines()], dtype=float)
    return rows[:, ::2], rows[:, 1::2]


def solved(robot: str, backend: AnyBackend) -> Plan:
    """Plan between random positions of a robot."""
    return plan(problem_of(robot, 0, 4), backend)


@pytest.mark.parametrize(
    ("robot", "backend"), [("fr3", Quintic()), ("three_dof_arm", Ruckig()), ("three_dof_arm", Toppra())]
)
def test_the_compiled_header_gives_the_trajectory(robot: str, backend: AnyBackend, tmp_path: Path) -> None:
    found = solved(robot, backend)
    trajectory = found.trajectory
    times = np.linspace(0.0, trajectory.duration, 2_000)
    positions, velocities = trajectory.evaluate(times, [0, 1])
    for real, tolerance in (("double", 1e-9), ("float", 2e-3)):
        position, velocity = run(render(found, "c_header"), tmp_path, times, real)
        within = tolerance * max(1.0, float(np.abs(velocities).max()))
        np.testing.assert_allclose(position, positions, atol=tolerance)
        np.testing.assert_allclose(velocity, velocities, atol=within)


def test_times_outside_of_the_trajectory_give_its_ends(tmp_path: Path) -> None:
    found = solved("three_dof_arm", Quintic())
    position, _ = run(render(found, "c_header"), tmp_path, np.array([-1.0, found.trajectory.duration + 1.0]), "double")
    np.testing.assert_allclose(position, found.path.positions[[0, -1]], atol=1e-12)


@pytest.mark.parametrize("mark", ["\n#error ", "\\\n", "\\", "*/", "\u2028", "??/"])
def test_names_become_no_statement(mark: str, tmp_path: Path) -> None:
    found = solved("three_dof_arm", Quintic())
    robot = replace(found.path.robot, id=f"arm{mark}")
    odd = replace(found, path=replace(found.path, robot=robot))
    position, _ = run(render(odd, "c_header"), tmp_path, np.zeros(1), "double")
    np.testing.assert_allclose(position, found.path.positions[:1], atol=1e-12)


def test_a_plan_with_outputs_is_refused() -> None:
    problem: PlanningProblem = replace(problem_of("three_dof_arm", 0, 2), actions=[SetOutput(AtWaypoint(1), "x", True)])
    with pytest.raises(UnsupportedFormat, match="c_header carries no actions"):
        render(plan(problem), "c_header")
