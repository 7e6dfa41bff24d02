"""The cases of the demo: the file of each request, and its title."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import orjson


@dataclass(frozen=True)
class Case:
    """One case.

    Attributes:
        name: The name of its request file, without `.json`, and of its picture.
        title: Its title in tables and pictures.
    """

    name: str
    title: str

    def request(self) -> dict[str, Any]:
        """Return the plan request of the case."""
        document: dict[str, Any] = orjson.loads((examples_folder() / f"{self.name}.json").read_bytes())
        return document


CASES = (
    Case("refuelling_case_1", "Refuelling, case 1"),
    Case("refuelling_case_1_poses", "Refuelling, case 1, poses"),
    Case("refuelling_case_2", "Refuelling, case 2"),
    Case("welding", "Welding sequence"),
    Case("three_joint_arm_first", "Three-joint arm, set 1"),
    Case("three_joint_arm_second", "Three-joint arm, set 2"),
    Case("three_joint_arm_third", "Three-joint arm, set 3"),
    Case("date_sorting_transition_1", "Date sorting, transition 1"),
    Case("date_sorting_transition_2", "Date sorting, transition 2"),
    Case("blended_lines", "Lines with blended corners"),
)


def examples_folder() -> Path:
    """Find the request files: inside the installed package, or beside it in a checkout."""
    installed = Path(str(files("cli"))) / "examples"
    return installed if installed.is_dir() else Path(__file__).parents[2] / "examples"
