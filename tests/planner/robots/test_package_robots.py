"""The robots of the package example-robot-data, with and without the package."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from planner.robots import catalogue, load_robot
from tests.locations import ROOT
from tests.planner.robots.frames import frame_pose, pinocchio_configuration
from tests.planner.robots.urdfs import joint, link, robot
from tests.robots_extra import OF_EXTRA, is_extra_installed


@pytest.mark.parametrize("robot_id", sorted(OF_EXTRA))
@pytest.mark.skipif(not is_extra_installed(), reason="example-robot-data is not installed")
def test_the_packages_robots_move_as_pinocchio_says(robot_id: str) -> None:
    arm = load_robot(robot_id)
    folder = catalogue._package_robots()
    assert folder is not None
    entry = json.loads((catalogue.PACKAGE_DATA / f"{robot_id}.json").read_text())
    model = pin.buildModelFromUrdf(str(folder / entry["urdf"]))
    data, rng = model.createData(), np.random.default_rng(5)
    for q in rng.uniform(-3.0, 3.0, (20, arm.dof)):
        pin.framesForwardKinematics(model, data, pinocchio_configuration(model, arm, q))
        expected = data.oMf[model.getFrameId(arm.tip_frame, pin.FrameType.BODY)].homogeneous
        np.testing.assert_allclose(frame_pose(arm, q), expected, atol=1e-12)
    assert np.isfinite([arm.limit(name) for name in ("velocity", "acceleration", "jerk")]).all()


def test_robots_of_the_package_appear_when_it_is_installed(tmp_path: Path) -> None:
    """The test package has one robot in a folder laid out like the real one, which weighs 440 MB."""
    (tmp_path / "example_robot_data-6.0.0.dist-info").mkdir()
    (tmp_path / "example_robot_data-6.0.0.dist-info" / "METADATA").write_text(
        "Name: example-robot-data\nVersion: 6.0.0\n"
    )
    urdf = tmp_path / "cmeel.prefix/share/example-robot-data/robots/panda_description/urdf/panda.urdf"
    urdf.parent.mkdir(parents=True)
    names = [f"panda_link{i}" for i in range(8)]
    joints = [joint(f"panda_joint{i}", names[i - 1], names[i]) for i in range(1, 8)]
    tip = joint("flange", names[7], "panda_link8", kind="fixed", axis="", limit="")
    urdf.write_text(robot(*map(link, [*names, "panda_link8"]), *joints, tip))
    code = (
        "import json, planner.robots as r; arm = r.load_robot('panda');"
        "print(json.dumps([r.catalogue_ids(), vars(arm.joints[6])], default=vars))"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    ids, last = json.loads(done.stdout)
    assert set(ids) >= OF_EXTRA
    assert (last["velocity"], last["acceleration"], last["jerk"]) == (2.61, 20.0, 10000.0)
    quantities = ("position", "velocity", "acceleration", "jerk", "torque")
    assert last["provenance"] == dict.fromkeys(quantities, "datasheet")
