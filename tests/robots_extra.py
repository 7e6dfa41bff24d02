"""The robots of the catalogue: shipped robots, and robots of the extra `robots`, which a test may skip."""

from __future__ import annotations

import re
from importlib.metadata import PackageNotFoundError, distribution
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from planner.errors import UnknownRobot

OWN = {
    "date_sorting_arm",
    "fr3",
    "kuka_kr16_2",
    "kuka_kr16_l6_2",
    "ngv_refuelling_arm",
    "ngv_refuelling_arm_published",
    "three_dof_arm",
    "ur10e",
    "ur16e",
    "ur3e",
    "ur5e",
    "welding_arm",
}
"""Ids of the robots that ship."""

OF_EXTRA = {"kinova", "panda", "so100", "ur10", "ur3", "ur5", "xarm7", "z1"}
"""Ids of the robots that the extra `robots` adds."""


def is_extra_installed() -> bool:
    """Tell whether the package of the extra `robots` is installed, independently of the catalogue."""
    try:
        distribution("example-robot-data")
    except PackageNotFoundError:
        return False
    return True


def lacks_extra(error: UnknownRobot, *, is_installed: bool) -> bool:
    """Tell whether a robot is unknown because the extra `robots` is not installed."""
    name = re.match(r"there is no robot '([^']*)'", str(error))
    return not is_installed and name is not None and name[1] in OF_EXTRA


def need_robot(robot_id: str) -> None:
    """Skip a test whose robot belongs to the extra `robots` where that is not installed."""
    if robot_id in OF_EXTRA and not is_extra_installed():
        pytest.skip("the extra `robots` is not installed")
