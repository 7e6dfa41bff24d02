"""The benchmark of the service beside another version, and the checkouts of other versions."""

from __future__ import annotations

import io
import subprocess
from contextlib import redirect_stdout
from typing import TYPE_CHECKING

import orjson
import pytest
from typing_extensions import override

from benchmarks import checkouts
from benchmarks.checkouts import HERE, NAMES
from benchmarks.service import http, http_report

if TYPE_CHECKING:
    from pathlib import Path

GIT = ("git", "-c", "user.name=someone", "-c", "user.email=someone@localhost")


def test_a_commit_is_checked_out_until_the_block_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkouts, "HERE", tmp_path)
    file = tmp_path / "file"
    subprocess.run([*GIT, "init", "--quiet"], cwd=tmp_path, check=True)
    for text in ("first", "second"):
        file.write_text(text)
        for command in (("add", "file"), ("commit", "--quiet", "--message", text)):
            subprocess.run([*GIT, *command], cwd=tmp_path, check=True)
    file.write_text("not committed")
    with checkouts.checkout_of("HEAD~1") as former:
        assert (former / "file").read_text() == "first"
    assert not former.exists()
    with checkouts.checkout_of(str(tmp_path)) as folder:
        assert (folder / "file").read_text() == "not committed"


class MadeUpConnection(http.Connection):
    """A connection whose answers take 5 ms."""

    def __init__(self) -> None:
        """Connect to nothing."""

    @override
    def send(self, request: bytes) -> tuple[float, bytes, int]:
        timings = "queue;dur=0.2, validate;dur=0.3, plan;dur=1.5, serialise;dur=0.5, total;dur=4.0"
        return 5e-3, f"HTTP/1.1 200 OK\r\nServer-Timing: {timings}".encode(), 0


def test_the_parts_of_a_latency_add_up() -> None:
    times = http._times_of(MadeUpConnection(), b"")
    assert times["hand_over"] == pytest.approx(1.5e-3)
    assert times["transport"] == pytest.approx(1e-3)
    assert times["added"] == pytest.approx(3.5e-3)
    parts = [times[name] for name in (*http.STAGES, "hand_over", "transport")]
    assert sum(parts) == pytest.approx(times["client_total"]) == pytest.approx(5e-3)


@pytest.mark.large_only
def test_both_versions_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "CONNECTIONS", (2,))
    monkeypatch.setattr(http, "WARM_UP", 2)
    figures = http.measure(str(HERE), seconds=0.5, requests=10, starts=1)
    for size in http.SIZES:
        for name in NAMES:
            stages = figures["latency"][size][name]
            assert 0.0 < stages["plan"]["median"] < stages["client_total"]["median"]
            (load,) = (load[name] for load in figures["throughput"][size])
            assert load["requests"] > load["failures"] == 0
    with redirect_stdout(io.StringIO()) as out:
        http_report.print_json(figures)
    assert orjson.loads(out.getvalue())["latency"].keys() == {"2", "10"}
    with redirect_stdout(io.StringIO()) as out:
        http_report.print_table(figures)
    assert all(out.getvalue().count(f"2, {name}") == len(http.SIZES) for name in NAMES)
