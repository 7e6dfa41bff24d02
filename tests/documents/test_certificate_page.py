"""The pages on certificates and proofs: each quantity has its method, and is covered by proofs or named as excluded."""

from __future__ import annotations

import re

import planner
from planner.constraints.pose_constraints import (
    ToolAxis,
    ToolInBox,
    ToolInHalfSpace,
    ToolNearLine,
    ToolNearPlane,
    ToolOrientation,
)
from planner.proofs.statement import LIMITED, OF_WAYPOINTS
from planner.quantities import MEASURES
from tests.locations import ROOT

OF_THE_POSE = {
    kind.quantity for kind in (ToolAxis, ToolInBox, ToolInHalfSpace, ToolNearLine, ToolNearPlane, ToolOrientation)
}


def rows(page: str, header: str) -> dict[str, str]:
    """Return the second column of a table by the quantities that its first column names."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    table = text[text.index(header) :].partition("\n\n")[0].splitlines()[2:]
    cells = [line.split("|") for line in table]
    return {name: row[2].strip(" `") for row in cells for name in re.findall(r"`(\w+)`", row[1]) if name in MEASURES}


def test_the_table_of_methods_has_every_quantity_and_is_that_of_certificates() -> None:
    methods = rows("certificate.md", "| quantity | method |")
    assert set(methods) == set(MEASURES)
    robot = planner.load_robot("kuka_kr16_2")
    start = planner.JointWaypoint([0.0, -1.5, 1.5, 0.0, 0.5, 0.0])
    up = planner.RelativeWaypoint(
        planner.CartesianMove((0.0, 0.0, 0.1)),
        "base",
        motion=planner.LinearMotion(),
        transition=planner.BlendTransition(0.02),
    )
    side = planner.RelativeWaypoint(planner.CartesianMove((0.1, 0.0, 0.0)), "base", motion=planner.LinearMotion())
    tool = {name: 100.0 for name in methods if name.startswith("tcp_")}
    problem = planner.PlanningProblem(
        robot,
        [start, up, side],
        limits=planner.Limits(**tool, total_power=1e5, rms_torque=(1e4,) * 6, power=(1e5,) * 6),
        residual_vibration=planner.ResidualVibration(10.0, 0.05, suppress=False),
        duration=5.0,
    )
    found = {check.quantity: check.method for check in planner.plan(problem, planner.Ruckig()).certificate.checks}
    assert found == {name: methods[name] for name in found}
    assert len(found) > 20


def test_a_proof_covers_every_quantity_that_its_page_does_not_exclude() -> None:
    excluded = set(rows("proof.md", "| not covered | reason |"))
    assert excluded == set(MEASURES) - set(LIMITED) - OF_WAYPOINTS - OF_THE_POSE
