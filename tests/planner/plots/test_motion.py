"""Animations and summaries: the position of the arm in them, and their text."""

from __future__ import annotations

import re
from base64 import b64decode

import numpy as np
import pytest

from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import load_robot
from tests.documents.published import homogeneous, modified_dh
from tests.documents.read_pictures import graphs_of

D_H = [(0.0, 0.0, 0.0), (0.0, -np.pi / 2.0, 0.0), (0.1, np.pi, 0.0)]
"""Rows of a (m), alpha (rad), d (m) of the arm with three joints (document 002, Table 1.1, with E20 corrected)."""


@pytest.fixture(scope="module")
def moved() -> Plan:
    waypoints = (
        JointWaypoint((0.0, 0.5, 0.5), name="<here> & there"),
        JointWaypoint((1.0, 1.0, -0.5), limits=Limits(jerk=(100.0, 100.0, 100.0)), dwell=0.5),
        JointWaypoint((-0.5, 0.2, 0.9), name="end"),
    )
    return plan(PlanningProblem(load_robot("three_dof_arm"), waypoints))


@pytest.mark.parametrize(("view", "columns"), [("xy", [0, 1]), ("xz", [0, 2]), ("yz", [1, 2])])
def test_the_tool_of_an_animation_is_where_the_table_says(moved: Plan, view: str, columns: list[int]) -> None:
    """All frames agree with the product of the document's table, up to one scale and one shift."""
    svg = moved.animate(view=view, speed=0.25).svg
    x, y = (
        np.array(re.findall(rf'attributeName="{name}" .*?values="(.*?)"', svg)[0].split(";"), dtype=float)
        for name in ("cx", "cy")
    )
    times = np.linspace(0.0, moved.trajectory.duration, len(x))
    (positions,) = moved.trajectory.evaluate(times, (0,))
    tool = np.array([(modified_dh(D_H, q) @ homogeneous(shift=(0.17, 0.0, 0.0)))[:3, 3] for q in positions])[:, columns]
    across, down = np.polyfit(tool[:, 0], x, 1), np.polyfit(tool[:, 1], y, 1)
    assert across[0] == pytest.approx(-down[0], rel=1e-3)
    assert np.polyval(across, tool[:, 0]) == pytest.approx(x, abs=0.11)
    assert np.polyval(down, tool[:, 1]) == pytest.approx(y, abs=0.11)


def test_an_animation_takes_the_time_of_the_trajectory(moved: Plan) -> None:
    moving = moved.animate(speed=2.0)
    assert moving.duration == pytest.approx(moved.trajectory.duration / 2.0)
    assert set(re.findall(r'dur="(.*?)s"', moving.svg)) == {f"{moving.duration:.4f}"}
    assert "&lt;here&gt; &amp; there" in moving.svg
    assert not re.search(r"(src|href)=", moving.svg)


def test_a_robot_at_rest_is_animated() -> None:
    waypoints = (JointWaypoint((0.1, 0.2, 0.3)), JointWaypoint((0.1, 0.2, 0.3)))
    rest = plan(PlanningProblem(load_robot("three_dof_arm"), waypoints))
    assert "nan" not in rest.animate().svg


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), float("inf")])
def test_a_speed_that_is_none_is_refused(moved: Plan, speed: float) -> None:
    with pytest.raises(ValueError, match="cannot be played"):
        moved.animate(speed=speed)
    with pytest.raises(ValueError, match="view: above"):
        moved.animate(view="above")


def test_a_summary_has_waypoints_certificate_warnings_and_a_picture(moved: Plan) -> None:
    html = moved._repr_html_()
    assert "<td>&lt;here&gt; &amp; there</td>" in html
    assert "<td>1</td>" in html, "a waypoint without a name has its number"
    for check in moved.certificate.checks:
        assert check.quantity.replace("tcp_", "tool ").replace("_", " ") in html
    velocity = next(check for check in moved.certificate.checks if check.quantity == "velocity")
    assert velocity.ratio is not None
    assert f"<td>{100.0 * velocity.ratio:.1f} %</td>" in html
    assert moved.warnings
    assert all(warning.message.replace("'", "&#x27;") in html for warning in moved.warnings)
    (picture,) = re.findall(r'src="data:image/svg\+xml;base64,(.*?)"', html)
    assert [len(graph.lines) for graph in graphs_of(b64decode(picture))] == [3, 3]
