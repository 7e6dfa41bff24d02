"""Poses of all frames: the products of the A matrices of tables, and the documents' transforms."""

from __future__ import annotations

import json
from typing import Literal

import numpy as np
import pytest

import planner
from planner.spatial import FloatArray
from tests.locations import ROOT


def _matrix(theta: float, d: float, a: float, alpha: float, convention: str) -> FloatArray:
    """Return the A matrix of a row: of the standard convention, or of Craig's."""

    def about(axis: int, angle: float) -> FloatArray:
        turned, (j, k) = np.eye(4), ((1, 2), (2, 0), (0, 1))[axis]
        turned[[j, k], [j, k]] = np.cos(angle)
        turned[k, j], turned[j, k] = np.sin(angle), -np.sin(angle)
        return turned

    def along(axis: int, length: float) -> FloatArray:
        moved = np.eye(4)
        moved[axis, 3] = length
        return moved

    about_z, about_x = about(2, theta) @ along(2, d), along(0, a) @ about(0, alpha)
    return about_z @ about_x if convention == "standard" else about_x @ about_z


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("seed", range(4))
def test_link_frames_are_the_products_of_the_a_matrices(convention: Literal["standard", "modified"], seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows = [planner.DHJoint(kind="prismatic" if k == seed else "revolute", **_row(rng)) for k in range(6)]
    robot = planner.Robot.from_dh(rows, convention=convention)
    q = rng.uniform(-0.5, 0.5, 6)
    product, found = np.eye(4), planner.frame_poses(robot, q)
    assert list(found)[:7] == ["base", *(f"link_{k}" for k in range(1, 7))]
    for k, (row, value) in enumerate(zip(rows, q, strict=True), 1):
        slides = row.kind == "prismatic"
        theta, d = (row.theta, row.d + value) if slides else (row.theta + value, row.d)
        product = product @ _matrix(theta, d, row.a, row.alpha, convention)
        pose = found[f"link_{k}"]
        np.testing.assert_allclose(pose.position, product[:3, 3], atol=1e-12)
        np.testing.assert_allclose(pose.rotation, product[:3, :3], atol=1e-12)


def _row(rng: np.random.Generator) -> dict[str, float]:
    names = ("theta", "d", "a", "alpha")
    return dict(zip(names, rng.uniform(-1.0, 1.0, 4).tolist(), strict=True)) | {"lower": -1.0, "upper": 1.0}


def test_the_last_frame_is_that_of_the_tool() -> None:
    robot = planner.load_robot("kuka_kr16_2")
    q = np.full(6, 0.3)
    found, tool = planner.frame_poses(robot, q)[robot.tip_frame], planner.tool_pose(robot, q)
    np.testing.assert_allclose(found.position, tool.position, atol=1e-12)
    np.testing.assert_allclose(found.rotation, tool.rotation, atol=1e-12)


def test_the_date_sorting_arm_has_the_transforms_of_its_document() -> None:
    """Table 2 gives poses at test points; the chain of links ends there."""
    document = json.loads((ROOT / "tests/data/date_sorting.json").read_text())
    robot = planner.load_robot("date_sorting_arm")
    for point in document["test_points"]["points"]:
        q = [
            np.radians(point["theta1_deg"]),
            point["l1_mm"] / 1e3,
            point["l2_mm"] / 1e3,
            *(np.radians(point[f"theta{k}_deg"]) for k in (2, 3, 4)),
        ]
        published = np.array(point["computed_T_mm"])
        pose = planner.frame_poses(robot, q)[robot.tip_frame]
        np.testing.assert_allclose(1e3 * pose.position, published[:3, 3], atol=0.1)
        np.testing.assert_allclose(pose.rotation, published[:3, :3], atol=1e-3)


def test_a_position_of_another_shape_is_refused() -> None:
    with pytest.raises(ValueError, match=r"must have shape \(6,\)"):
        planner.frame_poses(planner.load_robot("ur5e"), [0.0] * 5)
