"""docs/corpus.md equals its script's output for the saved results, which compare the same plans on both sides."""

from __future__ import annotations

from typing import TYPE_CHECKING

from benchmarks.jobs.results import AFTER, BEFORE, Result, load, save
from docs.tools.corpus import GIVEN_UP, PAGE, document

if TYPE_CHECKING:
    from pathlib import Path

NAME = "seam_straight-00-three_dof_arm"


def test_the_page_is_what_the_script_makes() -> None:
    assert PAGE.read_text(encoding="utf-8") == document(load(BEFORE), load(AFTER))


def test_both_sides_are_the_same_plans_of_which_none_is_wrong_now() -> None:
    before, after = load(BEFORE), load(AFTER)
    assert [(job, *own) for job, own in before.items()] == [(job, *own) for job, own in after.items()]
    found = [result for own in after.values() for result in own.values()]
    assert not {result.outcome for result in found} & GIVEN_UP
    assert {fault for result in found for fault in result.faults} <= {
        "over budget",
        "slow by its law",
        "slow on its path",
    }


def test_results_are_read_as_they_were_saved(tmp_path: Path) -> None:
    slow = [("slow on its path", "2 s, ruckig takes 1 s"), ("over budget", "1.2 s of 1 s")]
    records = [
        {"job": NAME, "backend": "cubic", "outcome": "planned", "seconds": 0.0104, "faults": []},
        {"job": NAME, "backend": "toppra", "outcome": "planned", "seconds": 1.2, "faults": slow},
        {"job": NAME, "backend": "auto", "outcome": "out_of_time", "faults": [("out_of_time", "")]},
    ]
    save(records, tmp_path / "results.csv")
    (row,) = load(tmp_path / "results.csv").values()
    assert row == {
        "cubic": Result("planned", frozenset(), 10),
        "toppra": Result("planned", frozenset({"slow on its path", "over budget"}), 1200),
        "auto": Result("out of time", frozenset({"out of time"}), None),
    }
    assert [result.is_good for result in row.values()] == [True, False, False]
