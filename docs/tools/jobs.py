"""The ten jobs of examples/jobs.py, planned and drawn: what docs/jobs.md shows.

Run: python -m docs.tools.jobs
"""

from __future__ import annotations

import runpy
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pinocchio as pin
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from cli.work.local_plan import plan_request, read_request
from planner.guarantees import QUANTITIES
from planner.kinematics import tool_poses, tool_velocities
from planner.plots.style import COLOURS, STYLE

if TYPE_CHECKING:
    from collections.abc import Callable

    from mpl_toolkits.mplot3d import Axes3D

    from planner.plans.result import Plan
    from planner.robots import Robot
    from planner.spatial import FloatArray

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/jobs.md"
IMAGES = ROOT / "docs/images/jobs"

SAMPLES = 1_500
"""The number of times that a picture shows."""

SHADES = 0.5
"""Power of the tool's speed, as a share of its greatest, that colours its path; it shows slow parts, too."""

SLOW = 0.1
"""Share of the tool's greatest speed; where it is slower half of the time, speeds are drawn on a logarithmic scale."""

STILL = 0.01
"""mm/s, below which the tool stands still in a picture."""

USED_UP = 0.98
"""Share of a limit above which it counts as used up."""

HEADER = """\
# Ten jobs

Everyday requests of a robot cell, ready to send. `python examples/jobs.py` makes them, each in
a few lines of Python that need no package. All are for the KUKA KR 16 L6-2. Plan one, or send it to a running service:

    planner plan examples/jobs/seam.json -o seam.csv
    curl --json @examples/jobs/seam.json http://127.0.0.1:8000/v1/trajectories

In the pictures, the arm stands at its first waypoint, with its work beside it. The path of the tool is yellow where
it is fast and dark where it is slow; dots are waypoints. The pictures are made by `python -m docs.tools.jobs`; the
tests plan all ten again and compare.
"""


def document(draws: bool = False) -> str:
    """Return the page; draw its pictures, too, if requested."""
    sections = [HEADER]
    for job in runpy.run_path(str(ROOT / "examples/jobs.py"))["JOBS"]:
        solved = plan_request(read_request((ROOT / f"examples/jobs/{job.__name__}.json").read_bytes()))
        sections.append(_section(job, solved))
        if draws:
            _draw(job.__name__.replace("_", " ").capitalize(), solved, IMAGES / f"{job.__name__}.png")
    return "\n".join(sections)


def _section(job: Callable[[], dict[str, Any]], solved: Plan) -> str:
    title = job.__name__.replace("_", " ").capitalize()
    kinds = Counter(waypoint.get("motion", {"kind": "joint"})["kind"] for waypoint in job()["waypoints"][1:])
    motions = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    used_up = [
        check.quantity.replace("tcp_", "tool ").replace("_", " ")
        for check in solved.certificate.checks
        if check.enforced and check.quantity in QUANTITIES and (check.ratio or 0.0) >= USED_UP
    ]
    lines = [
        f"## {title}",
        str(job.__doc__),
        f"![{title}: path of the tool, its speed, speeds of the joints](images/jobs/{job.__name__}.png)",
        f"`{solved.backend.kind}` takes {solved.trajectory.duration:.2f} s for {kinds.total()} motions ({motions}). "
        f"Limits that are used up: {', '.join(used_up) or 'none'}.",
    ]
    lines += [f"The answer warns: {warning.message}." for warning in solved.warnings]
    return "\n\n".join(lines) + "\n"


def _draw(title: str, solved: Plan, file: Path) -> None:
    """Draw the tool's path with the arm, and the speeds of tool and joints over time, relative to their limits."""
    robot = solved.path.robot
    time = np.linspace(0.0, solved.trajectory.duration, SAMPLES)
    position, velocity = solved.trajectory.evaluate(time, (0, 1))
    speeds = 1000.0 * np.linalg.norm(tool_velocities(robot, position, velocity)[0], axis=1)
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(12.0, 4.2), layout=ConstrainedLayoutEngine(wspace=0.16))
        grid = figure.add_gridspec(2, 3, width_ratios=[0.8, 1.0, 1.3])
        arm = _links(robot, position[0])
        path = tool_poses(robot, position)[0]
        whole, near = (figure.add_subplot(grid[:, column], projection="3d") for column in (0, 1))
        whole.plot(*arm.T, color="#999999", linewidth=4.0, solid_capstyle="round", zorder=0)
        _draw_path(whole, path, speeds)
        _frame(whole, np.vstack([path, arm]))
        _draw_path(near, path, speeds)
        work = path[_at_work(solved, time)]
        places = np.array([waypoint.pose.position for waypoint in solved.path.waypoints])
        places = places[((work.min(axis=0) <= places + STILL) & (places <= work.max(axis=0) + STILL)).all(axis=1)]
        near.scatter(*places.T, s=8.0, color="#D55E00", depthshade=False)
        _frame(near, work)
        tool = figure.add_subplot(grid[0, 2])
        tool.plot(time, speeds, color="#0072B2", linewidth=1.2)
        if np.median(speeds) < SLOW * speeds.max():
            tool.set_yscale("log")
            tool.yaxis.set_major_formatter("{x:g}")
            tool.set_ylim(bottom=max(0.2 * np.median(speeds[speeds > STILL]), STILL))
        tool.set_ylabel("tool (mm/s)")
        tool.tick_params(labelbottom=False)
        joints = figure.add_subplot(grid[1, 2], sharex=tool)
        shares = 100.0 * velocity / robot.limit("velocity")
        for joint, name in enumerate(robot.joint_names):
            joints.plot(time, shares[:, joint], color=COLOURS[joint], linewidth=1.0, label=name)
        joints.set_ylabel("joints (% of limit)")
        joints.set_xlabel("time (s)")
        joints.set_xlim(0.0, solved.trajectory.duration)
        figure.legend(ncols=robot.dof, loc="outside upper right", fontsize=7, frameon=False, handlelength=1.2)
        figure.suptitle(title, x=0.01, ha="left", fontsize=11, fontweight="bold")
        figure.savefig(file, dpi=90)
        plt.close(figure)


def _draw_path(axis: Axes3D, path: FloatArray, speeds: FloatArray) -> None:
    shades = (speeds[:-1] / max(speeds.max(), STILL)) ** SHADES
    pieces = np.stack([path[:-1], path[1:]], axis=1)
    axis.add_collection(Line3DCollection(pieces, colors=mpl.colormaps.get_cmap("viridis")(shades), linewidths=1.8))


def _at_work(solved: Plan, time: FloatArray) -> np.ndarray:
    """Mark the times (N,) at which the tool goes along lines and circles, or all where it never does."""
    along = np.array([motion is not None for motion in solved.path.tool_motions])
    marked: np.ndarray = along[solved.trajectory.segments[solved.trajectory.locate(time)[0]]]
    return marked if along.any() else np.ones_like(marked)


def _frame(axis: Axes3D, points: FloatArray) -> None:
    """Show a box around points, all axes alike, with few ticks."""
    lower, upper = points.min(axis=0), points.max(axis=0)
    middle, size = 0.5 * (lower + upper), np.maximum(upper - lower, 0.4 * (upper - lower).max()) * 1.05
    for name, start, end in zip("xyz", middle - 0.5 * size, middle + 0.5 * size, strict=True):
        axis.set(**{f"{name}lim": (start, end), f"{name}label": f"{name} (m)"})
        getattr(axis, f"{name}axis").set_major_locator(MaxNLocator(3))
    axis.set_aspect("equal")
    axis.view_init(elev=28.0, azim=-58.0)
    axis.tick_params(labelsize=7, pad=-2)


def _links(robot: Robot, position: FloatArray) -> FloatArray:
    """Return the places (joints + 2, 3) of base, joints and tool, m."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, position)
    joints = [placement.translation for placement in list(data.oMi)[1:]]
    return np.array([np.zeros(3), *joints, data.oMf[robot.tool_frame_id].translation])


def main() -> None:
    """Draw the pictures and write the page."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    PAGE.write_text(document(draws=True), encoding="utf-8")


if __name__ == "__main__":
    main()
