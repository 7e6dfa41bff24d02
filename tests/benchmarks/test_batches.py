"""The benchmark of batches: its figures belong together."""

from __future__ import annotations

import pytest

from benchmarks.service import batches


@pytest.mark.large_only
def test_a_small_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batches, "PLACES", batches.PLACES[:1])
    figures = batches.measure(30)
    (found,) = figures["batches"]
    assert found["planned"] == 30
    assert found["rate"] == pytest.approx(30 / found["seconds"])
    assert 0.0 < found["first_result"] <= found["taken_in"] + found["seconds"]
    assert found["overhead"] == pytest.approx(found["seconds"] / 30 / found["bare_loop"] - 1.0)
    assert found["memory"] > 20.0
    assert 0.0 < figures["interactive"]["alone"]["median"] <= figures["interactive"]["alone"]["worst"]
