"""The benchmark of two versions: its findings where the other version answers differently or refuses."""

from __future__ import annotations

import io
import shutil
from contextlib import redirect_stdout
from typing import TYPE_CHECKING

import numpy as np
import orjson
import pytest

from benchmarks.checkouts import HERE
from benchmarks.versions import report, requests, versions
from benchmarks.versions.requests import Kind

if TYPE_CHECKING:
    from pathlib import Path

ARM = "kuka_kr16_l6_2"


@pytest.mark.large_only
def test_kinds_are_always_the_same_and_have_names_of_their_own() -> None:
    kinds = [kind for kind in requests.kinds() if kind.name.endswith(ARM)]
    names = [kind.name for kind in kinds]
    assert len(set(names)) == len(names)
    assert {backend["kind"] for backend in requests.BACK_ENDS} <= {name.partition(",")[0] for name in names}
    again = [kind.bodies for kind in requests.kinds() if kind.name.endswith(ARM)]
    assert [kind.bodies for kind in kinds] == again


@pytest.mark.large_only
def test_another_version_is_told_from_this_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the copy forward kinematics has joints 0.01 rad further, and plans along ten waypoints are refused."""
    for package in ("api", "cli", "planner", "examples"):
        shutil.copytree(HERE / package, tmp_path / package)
    forward = tmp_path / "api/work/tasks/kinematics.py"
    at = "forward_kinematics(robot, positions"
    assert at in forward.read_text()
    forward.write_text(forward.read_text().replace(at, f"{at} + 0.01"))
    bounds = tmp_path / "api/contract/requests.py"
    ten = "list[Waypoint], Field(min_length=1, max_length=9)"
    bounds.write_text(bounds.read_text().replace("list[Waypoint], Field(min_length=1)", ten))
    wanted = [f"one pose, {ARM}", f"cubic, 3 joint waypoints, stop, no torques, {ARM}"]
    wanted.append(f"cubic, 10 joint waypoints, stop, no torques, {ARM}")
    monkeypatch.setattr(requests, "_arms", lambda: [ARM])
    chosen = [kind for kind in requests.kinds() if kind.name in wanted]
    chosen = [Kind(kind.name, kind.path, kind.bodies[:2], kind.cost) for kind in chosen]
    monkeypatch.setattr(versions, "kinds", lambda: chosen)
    figures = versions.measure(str(tmp_path), seconds=0.0)
    rows = {row["name"]: row for row in figures["kinds"]}
    pose, three, ten_waypoints = (rows[name] for name in wanted)
    assert (pose["changed"], pose["refused"]) == (2, {"before": 0, "now": 0})
    assert pose["cost"]["p50"] != pytest.approx(1.0, abs=1e-4)
    assert (three["changed"], three["cost"]["most"]) == (0, 1.0)
    assert three["rounds"] == versions.LEAST_ROUNDS
    assert all(0.0 < time < 1.0 for time in three["times"].values())
    assert ten_waypoints["refused"] == {"before": 2, "now": 0}
    assert ten_waypoints["time"] is None
    with redirect_stdout(io.StringIO()) as out:
        report.print_json(figures)
    assert orjson.loads(out.getvalue())["slower"] == figures["slower"]
    with redirect_stdout(io.StringIO()) as out:
        report.print_table(figures)
    assert out.getvalue().count(ARM) == len(wanted)


def test_the_ratio_of_nothing_to_nothing_is_one() -> None:
    pairs = np.array([[0.0, 0.0], [2.0, 3.0]])
    assert versions._ratios(pairs).tolist() == [1.0, 1.5]
