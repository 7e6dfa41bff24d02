"""Plans in a browser: the messages that viser sends to one, against Pinocchio's own model of the same URDF."""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass, field
from time import monotonic, sleep
from typing import Any

import httpx
import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.kinematics import tool_pose
from planner.spatial import Pose
from tests.planner.robots.urdfs import joint, link, robot
from tests.planner.shapes.mesh_files import box, stl

viser = pytest.importorskip("viser", reason="the extra `view` is not installed")

import msgspec  # noqa: E402 - it and the following come with viser
import zstandard  # noqa: E402
from websockets.sync.client import connect  # noqa: E402

BOX = (
    '<collision><origin xyz="0.05 -0.02 0.15" rpy="0.3 0.2 0.1"/>'
    '<geometry><box size="0.06 0.04 0.2"/></geometry></collision>'
)
ARM = robot(
    link("base"),
    *(link(name, BOX) for name in ("shoulder", "elbow", "wrist")),
    link("tip"),
    joint("j1", "base", "shoulder"),
    joint("j2", "shoulder", "elbow", axis='<axis xyz="0 1 0"/>'),
    joint("j3", "elbow", "wrist", axis='<axis xyz="1 0 0"/>', origin='<origin xyz="0.1 0 0.3" rpy="0.1 0.2 0"/>'),
    joint("end", "wrist", "tip", kind="fixed", limit=""),
)
POST = planner.SceneObject("post", [planner.Box([0.1, 0.1, 0.4])], Pose([1.5, 0.0, 0.2]))
FLOOR = planner.SceneObject("floor", [planner.HalfSpace([0.0, 0.0, 1.0], -0.5)])
START, END = [0.0, 0.2, -0.3], [0.6, -0.4, 0.5]


@pytest.fixture(scope="module")
def plan() -> planner.Plan:
    """A plan that takes a ball at its second waypoint, in front of a post and above the floor."""
    arm = planner.Robot.from_urdf(ARM)
    ball = planner.SceneObject("ball", [planner.Sphere(0.03)], tool_pose(arm, END) @ Pose([0.0, 0.0, 0.12]))
    waypoints = [START, planner.JointWaypoint(END, name="ball", attach=[planner.Attach("ball")]), START]
    scene = planner.Scene([POST, FLOOR, ball])
    return planner.plan(planner.PlanningProblem(arm, waypoints, scene=scene), "quintic")


@dataclass
class Browser:
    """The nodes of the scene that a client has after the messages from the server."""

    placements: dict[str, pin.SE3] = field(default_factory=dict)
    kinds: dict[str, str] = field(default_factory=dict)
    is_visible: dict[str, bool] = field(default_factory=dict)

    def take(self, messages: list[dict[str, Any]]) -> None:
        """Apply messages about nodes; other messages are about controls and the camera."""
        for message in messages:
            name = message.get("name", "")
            placed = self.placements.setdefault(name, pin.SE3.Identity())
            match message["type"]:
                case "SetPositionMessage":
                    placed.translation = np.array(message["position"])
                case "SetOrientationMessage":
                    w, x, y, z = message["wxyz"]
                    placed.rotation = pin.Quaternion(w, x, y, z).matrix()
                case "SetSceneNodeVisibilityMessage":
                    self.is_visible[name] = message["visible"]
                case "MeshMessage" | "FrameMessage" | "IcosphereMessage" | "LabelMessage" as kind:
                    self.kinds[name] = kind.removesuffix("Message")

    def placement(self, name: str) -> pin.SE3:
        """Return the placement of a node in the base frame."""
        placed = pin.SE3.Identity()
        while name:
            placed = self.placements[name] * placed
            name = name.rpartition("/")[0]
        return placed


def browse(url: str) -> Browser:
    """Connect as a browser does, and take the messages about the whole scene."""
    browser = Browser()
    with connect(url.replace("http", "ws"), subprotocols=[f"viser-v{viser.__version__}"], max_size=None) as socket:
        while True:
            data = socket.recv(timeout=10.0)
            packed, size = np.frombuffer(data[:16], "<u8").tolist()
            content = zstandard.ZstdDecompressor().decompress(data[16 : 16 + size], packed)
            messages = msgspec.msgpack.decode(content)["messages"]
            browser.take(messages)
            if any(message["type"] == "ReplayDoneMessage" for message in messages):
                return browser


def test_the_robot_stands_where_pinocchio_has_it(plan: planner.Plan) -> None:
    model = pin.buildModelFromXML(ARM)
    geometry = pin.buildGeomFromUrdfString(model, ARM, pin.GeometryType.COLLISION)
    data, geometry_data = model.createData(), geometry.createData()
    with plan.view(port=8951) as viewer:
        assert httpx.get(viewer.url).text.lstrip().lower().startswith("<!doctype html")
        for time in (0.3 * plan.trajectory.duration, plan.trajectory.arrivals[1]):
            viewer.show(time)
            browser = browse(viewer.url)
            q = plan.trajectory.evaluate(time, (0,))[0]
            pin.framesForwardKinematics(model, data, q)
            pin.updateGeometryPlacements(model, data, geometry, geometry_data)
            links = [name for name in browser.kinds if "/link_" in name]
            assert len(links) == len(geometry.geometryObjects) == 3
            for name, placement in zip(links, geometry_data.oMg, strict=True):
                np.testing.assert_allclose(browser.placement(name).homogeneous, placement.homogeneous, atol=1e-9)
            tool = data.oMf[model.getFrameId("tip")]
            np.testing.assert_allclose(browser.placement("/tool").homogeneous, tool.homogeneous, atol=1e-9)
        kinds = Counter(kind for name, kind in browser.kinds.items() if name != "/WorldAxes")  # viser's own
        assert kinds == {"Frame": 4 + 1, "Mesh": 3 + 3 + 1, "Icosphere": 2, "Label": 2}  # the ball before and after


def test_a_taken_object_moves_with_the_robot(plan: planner.Plan) -> None:
    with plan.view(port=8951) as viewer:
        before = browse(viewer.url)
        viewer.show(plan.trajectory.duration)
        after = browse(viewer.url)
        (carried,) = (name for name in before.kinds if "carried" in name)
        (standing,) = (name for name in before.kinds if before.is_visible[name] > after.is_visible[name])
        assert (before.is_visible[carried], after.is_visible[carried]) == (False, True)
        assert before.kinds[standing] == "Mesh"
        arm = plan.problem.robot
        there = (tool_pose(arm, START) @ Pose([0.0, 0.0, 0.12])).position
        np.testing.assert_allclose(after.placement(carried).translation, there, atol=1e-9)


def test_a_moving_object_is_where_its_motion_leads(plan: planner.Plan) -> None:
    velocity, start = np.array([0.1, 0.2, 0.0]), Pose.from_rpy([2.0, 0.0, 0.5], [0.1, 0.2, 0.3])
    box = planner.Box([0.1, 0.2, 0.3])
    crate = planner.SceneObject("crate", [box], start, motion=planner.ConstantVelocity(velocity))
    problem = planner.PlanningProblem(plan.problem.robot, [START, END], scene=planner.Scene([crate]))
    with planner.plan(problem).view(port=8951) as viewer:
        for time in (0.0, 0.4):
            viewer.show(time)
            placed = browse(viewer.url).placement("/moving_0/shape_0")
            np.testing.assert_allclose(placed.translation, start.position + velocity * time, atol=1e-6)
            np.testing.assert_allclose(placed.rotation, start.rotation, atol=1e-9)


def test_visual_meshes_stand_in_for_the_collision_shapes_of_their_links_until_these_are_chosen() -> None:
    mesh = '<visual><origin xyz="0.1 0 0"/><geometry><mesh filename="r/elbow.stl"/></geometry></visual>'
    urdf = ARM.replace('<link name="elbow">', f'<link name="elbow">{mesh}')
    arm = planner.Robot.from_urdf(urdf, meshes={"r/elbow.stl": stl(box((0, 0, 0), (0.1, 0.1, 0.3)))})
    with planner.plan(planner.PlanningProblem(arm, [START, END])).view(port=8951) as viewer:
        before = browse(viewer.url)
        viewer.show_collision_shapes()
        after = browse(viewer.url)
        (drawn,) = (name for name in before.kinds if "visual_" in name)
        solids = [name for name in before.kinds if "/link_" in name]
        assert [before.is_visible[drawn], after.is_visible[drawn]] == [True, False]
        assert [before.is_visible.get(name, True) for name in solids] == [True, False, True]
        assert all(after.is_visible.get(name, True) for name in solids)
        assert drawn.startswith("/joint_2/") and solids[1].startswith("/joint_2/")
        viewer.show_collision_shapes(False)
        assert browse(viewer.url).is_visible[drawn]


def test_the_trajectory_plays_to_its_end(plan: planner.Plan) -> None:
    with plan.view(port=8951) as viewer:
        viewer.show(0.5 * plan.trajectory.duration)
        viewer.play()
        ends = monotonic() + 30.0
        while viewer.is_playing and monotonic() < ends:
            sleep(0.02)
        assert not viewer.is_playing
        # viser leaves out moves below 1e-5 of the distance: the last picture may have been that near to the end
        tool = browse(viewer.url).placement("/tool")
        np.testing.assert_allclose(tool.translation, tool_pose(plan.problem.robot, START).position, atol=2e-5)


def test_without_viser_a_sentence_says_how_to_install_it(plan: planner.Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(ModuleNotFoundError, match=r'needs viser: pip install "trajectory-planner\[view\]"'):
        plan.view()
