"""The checker of proof files accepts honest files and rejects tampered ones."""

from __future__ import annotations

import copy
import itertools
import json
from typing import Any

import numpy as np
import pytest

import planner
from benchmarks.proofs.damage import damaged_text, damaged_values, has_the_values_of
from benchmarks.proofs.plans import VARIED, plan_of, plans
from benchmarks.proofs.tampering import KINDS, tampered, with_any_number_changed, with_digests
from planner.proofs import ProofRejected, check_proof, write_proof
from planner.proofs.checker import CLAIMS, MOST_BYTES_OF_PROOF, digest
from tests.sizes import NAME, SIZE

FILES = 3 if NAME == "quick" else 6
"""Number of plans besides the varied ones."""

OF_RESTS = "torque at rest while the payload or the process force changes"
"""The part of the torque limits that no claim covers."""

SEEDS = range(max(1, SIZE.examples // 250))

BYTES = 100_000
"""The number of bytes of changed files per proof and seed: a large proof is changed in fewer ways."""


@pytest.fixture(scope="module")
def proofs() -> list[dict[str, Any]]:
    return [write_proof(plan) for plan in (*map(plan_of, VARIED), *plans(np.random.default_rng(5), FILES))]


@pytest.fixture(scope="module")
def in_a_scene(proofs: list[dict[str, Any]]) -> dict[str, Any]:
    return next(
        proof for proof in proofs if {"clearance", "torque", "tcp_linear_velocity"} <= set(proof["statement"]["claims"])
    )


def is_rejected(proof: Any, expected: dict[str, str] | None = None) -> bool:
    try:
        check_proof(proof, expected)
    except ProofRejected:
        return True
    return False


def test_honest_proofs_of_all_back_ends_are_accepted(proofs: list[dict[str, Any]]) -> None:
    for proof in proofs:
        assert check_proof(json.dumps(proof)) == proof["statement"]["claims"]
        left_out = {name for name in proof["statement"]["not_covered"] if not name.startswith("following errors: ")}
        assert left_out <= {OF_RESTS}
    claims = {claim for proof in proofs for claim in proof["statement"]["claims"]}
    assert claims == {*CLAIMS} - {"tcp_angular_acceleration"}


def test_a_proof_names_the_checks_that_it_does_not_cover() -> None:
    robot = planner.load_robot("ur5e")
    start = (0.2, -1.4, 1.6, -1.5, -1.4, 0.1)
    pose = planner.forward_kinematics(robot, start)
    above = planner.Pose(pose.position + np.array([0.0, 0.0, 0.05]), pose.rotation)
    polyline = planner.PolylineMotion(poses=[planner.Pose(pose.position + np.array([0.03, 0.0, 0.02]))], blend=0.01)
    waypoints: list[planner.AnyWaypoint] = [
        planner.JointWaypoint(start),
        planner.PoseWaypoint(above, motion=planner.LinearMotion()),
        planner.PoseWaypoint(pose, motion=polyline),
        planner.PoseWaypoint(above, free=planner.Region(rotation_z=(-1.65, 1.65))),
    ]
    statement = write_proof(planner.plan(planner.PlanningProblem(robot, waypoints)))["statement"]
    assert "path_deviation" in statement["claims"]
    assert statement["not_covered"] == [
        "path_deviation: polynomials follow the path of segment 1 within 1e-9 m and rad, as compared at points",
        "waypoints: the tolerance region of waypoint 3 but for its nearest pose",
    ]


@pytest.mark.sized
@pytest.mark.parametrize("seed", SEEDS)
def test_a_file_with_a_false_claim_or_a_gap_is_rejected(proofs: list[dict[str, Any]], seed: int) -> None:
    generator = np.random.default_rng(seed)
    for proof in proofs:
        count = min(len(KINDS), max(1, BYTES // len(json.dumps(proof))))
        for kind, changed in tampered(proof, generator, count, int(generator.integers(len(KINDS)))):
            assert is_rejected(json.dumps(changed)), f"{kind} of {proof['statement']['robot']}"


def test_every_kind_of_change_is_tried(proofs: list[dict[str, Any]]) -> None:
    """Not in each run of the test above: a motion keeps axes of the tool on one segment only."""
    generator = np.random.default_rng(0)
    missing = {kind.__name__ for kind in KINDS}
    for _, proof in itertools.product(range(10), sorted(proofs, key=lambda proof: len(json.dumps(proof)))):
        missing -= {kind for kind, _ in tampered(proof, generator, len(KINDS))} if missing else set()
    assert not missing


@pytest.mark.sized
@pytest.mark.parametrize("seed", SEEDS)
def test_any_changed_number_breaks_a_digest(proofs: list[dict[str, Any]], seed: int) -> None:
    generator = np.random.default_rng(seed)
    for proof in proofs:
        changed = with_any_number_changed(proof, generator)
        if changed != proof:
            assert is_rejected(changed)
            assert is_rejected(with_digests(changed), copy.deepcopy(proof["digests"]))


def test_a_wider_limit_is_accepted_without_the_expected_digest_alone(in_a_scene: dict[str, Any]) -> None:
    changed = copy.deepcopy(in_a_scene)
    for row in changed["statement"]["limits"]["velocity"]:
        row[1] = [limit and limit * 2.0 for limit in row[1]]
    with_digests(changed)
    assert not is_rejected(changed)
    assert is_rejected(changed, {"statement": in_a_scene["digests"]["statement"]})
    assert not is_rejected(in_a_scene, in_a_scene["digests"])


def test_the_digest_does_not_depend_on_how_numbers_are_written() -> None:
    assert digest(json.loads('{"b": [1, -0.0, null], "a": "x"}')) == digest(json.loads('{"a":"x","b":[1.0,0,null]}'))
    assert digest([1.0]) != digest(["1.0"])
    assert digest([[1.0], 2.0]) != digest([1.0, [2.0]])


@pytest.mark.sized
@pytest.mark.parametrize("seed", SEEDS)
def test_damaged_files_are_rejected_or_checked_without_a_crash(proofs: list[dict[str, Any]], seed: int) -> None:
    generator = np.random.default_rng(seed)
    for proof in proofs:
        for _ in range(min(8, max(1, BYTES // len(json.dumps(proof))))):
            assert is_rejected(damaged_text(json.dumps(proof), generator))
            is_rejected(json.dumps(damaged_values(proof, generator)))


def test_a_key_that_stands_twice_is_rejected(in_a_scene: dict[str, Any]) -> None:
    """The first of both would be read by a person, the last by the checker."""
    text = json.dumps(in_a_scene)
    assert not is_rejected(text)
    assert is_rejected(text.replace('"claims":', '"claims": [], "claims":', 1))


def test_limits_are_binary64_numbers(in_a_scene: dict[str, Any]) -> None:
    """The digest of a large integer is that of the number nearest to it, and so is its value."""
    changed = copy.deepcopy(in_a_scene)
    changed["statement"]["limits"]["velocity"][0][1][0] = 2**53 + 1
    assert not is_rejected(with_digests(changed))
    even = json.loads(json.dumps(changed).replace(str(2**53 + 1), str(2**53)))
    assert changed["digests"] == with_digests(even)["digests"]


def test_a_file_is_read_up_to_a_size() -> None:
    assert is_rejected(b" " * (MOST_BYTES_OF_PROOF + 1))


def test_the_axis_of_a_disc_is_a_unit_vector(in_a_scene: dict[str, Any]) -> None:
    """With a longer one, the disc would count for less than it is."""
    changed = copy.deepcopy(in_a_scene)
    for shape in (shape for shape in changed["statement"]["scenes"][0]["shapes"] if "axis" in shape):
        shape["axis"] = [2.0 * x for x in shape["axis"]]
    assert is_rejected(with_digests(changed))


def test_the_same_values_in_other_bytes_are_no_damage(in_a_scene: dict[str, Any]) -> None:
    """A line break in place of a space, and a digit below rounding: the random damage must not count them."""
    text = json.dumps({"q": 2.0644276924783367})
    assert has_the_values_of(text, text.replace(" ", "\n").encode())
    assert has_the_values_of(text, text.replace("3367", "3368").encode())
    assert not has_the_values_of(text, text.replace("3367", "3377").encode())
    assert not is_rejected(json.dumps(in_a_scene).replace(", ", ",\n"))


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", "null", '{"format": "planner-proof/1"}', '{"format": 1e999}', "[" * 100_000, "NaN"]
)
def test_anything_else_is_rejected(text: str) -> None:
    assert is_rejected(text)


def test_a_zero_normal_proves_nothing(in_a_scene: dict[str, Any]) -> None:
    changed = copy.deepcopy(in_a_scene)
    for node in changed["evidence"]["clearance"]:
        for plane in node[2]:
            plane[1] = plane[1] and [0.0, 0.0, 0.0]
    assert is_rejected(with_digests(changed))


@pytest.mark.parametrize("part", ["statement", "trajectory", "evidence"])
def test_a_file_without_a_field_is_rejected(in_a_scene: dict[str, Any], part: str) -> None:
    needed = set(in_a_scene[part]) - {"robot", "joint_names", "not_covered", "speed_zones"}
    for name in needed:
        changed = copy.deepcopy(in_a_scene)
        del changed[part][name]
        assert is_rejected(with_digests(changed)), name
