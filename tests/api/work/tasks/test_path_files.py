"""POST /v1/paths/read: waypoints of files that a plan takes, notes, and faults with pointers."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from typer.testing import CliRunner

from api.contract.answers import PlanAnswer
from api.contract.path_files import PathFileAnswer
from cli.commands import app
from tests.api.answers import checked

if TYPE_CHECKING:
    from pathlib import Path

    from tests.api.conftest import RunningService

SEAM = "G21 G90\nG0 X0 Y0 Z0\nG1 X60 F3000\nG3 X80 Y20 J20\nG1 Y60\nG0 Z20\nM3\nM30\n"
DRAWING = "0\nSECTION\n2\nENTITIES\n0\nLINE\n8\n0\n10\n0\n20\n0\n30\n0\n11\n100\n21\n0\n31\n0\n0\nENDSEC\n0\nEOF\n"


def read(service: RunningService, **fields: Any) -> dict[str, Any]:
    body = {"robot": "kuka_kr16_2", "name": "seam.ngc", "text": SEAM, **fields}
    answer: dict[str, Any] = checked(service.client.post("/v1/paths/read", json=body), PathFileAnswer)
    return answer


def test_a_program_is_read_and_planned_as_the_command_line_does(service: RunningService, tmp_path: Path) -> None:
    """`planner import` writes the same waypoints."""
    answer = read(service, frame="path")
    (tmp_path / "seam.ngc").write_text(SEAM)
    written = tmp_path / "seam.json"
    arguments = ["import", str(tmp_path / "seam.ngc"), "-o", str(written), "--robot", "kuka_kr16_2"]
    assert CliRunner().invoke(app, arguments).exit_code == 0
    assert answer["waypoints"] == json.loads(written.read_text())["waypoints"]
    assert answer["notes"] == ["line 7: left out M codes, such as spindle and coolant"]
    frames = {"path": {"position": [0.9, 0.0, 0.6], "orientation": {"kind": "rpy", "rpy": [0, 0, 0]}}}
    request = {
        "robot": "kuka_kr16_2",
        "waypoints": answer["waypoints"],
        "frames": frames,
        "backend": {"kind": "toppra"},
    }
    plan = checked(service.client.post("/v1/trajectories", json=request), PlanAnswer)
    ends = [waypoint["pose"]["position"] for waypoint in plan["waypoints"]]
    np.testing.assert_allclose(ends[-1], [0.98, 0.06, 0.62], atol=1e-5)


@pytest.mark.parametrize(("units", "length"), [(None, 0.1), ("mm", 0.1), ("m", 100.0), ("inch", 2.54)])
def test_units_of_a_drawing_are_its_own_or_those_requested(
    service: RunningService, units: str | None, length: float
) -> None:
    waypoints = read(service, name="line.dxf", text=DRAWING, units=units)["waypoints"]
    assert waypoints[-1]["pose"]["position"] == pytest.approx([length, 0.0, 0.0])


def test_a_table_of_joint_positions_is_read(service: RunningService) -> None:
    names = [f"joint_a{k}" for k in range(1, 7)]
    text = ",".join(names) + "\n0,-90,90,0,30,0\n10,-90,90,0,30,0\n"
    waypoints = read(service, name="joints.csv", text=text, angle="deg")["waypoints"]
    assert [waypoint["kind"] for waypoint in waypoints] == ["joint", "joint"]
    np.testing.assert_allclose(np.degrees(waypoints[1]["position"]), [10, -90, 90, 0, 30, 0])


@pytest.mark.parametrize(
    ("fields", "pointer", "message"),
    [
        ({"text": "G0 X0 Y0 Z0\nG81 X1"}, "/text", "line 2"),
        ({"name": "seam.step"}, "/name", "pattern"),
        ({"name": "x.dxf", "text": "no drawing"}, "/text", "ezdxf cannot read"),
        ({"tool_axis": [0, 0, 0]}, "/tool_axis", "not all 0"),
        ({"text": "G0 X0 Y0 Z0\n" + "G1 X1\nG1 X2\n" * 2000}, "/text", "at most"),
    ],
)
def test_faults_point_to_their_field(
    service: RunningService, fields: dict[str, Any], pointer: str, message: str
) -> None:
    body = {"robot": "kuka_kr16_2", "name": "seam.ngc", "text": SEAM} | fields
    response = service.client.post("/v1/paths/read", json=body)
    assert response.status_code == 422
    (fault,) = response.json()["errors"]
    assert fault["pointer"] == pointer
    assert message in fault["message"]
