"""Random plan requests over all fields of waypoints and of the whole.

Most of them can be planned; the service must refuse contradictory requests, never fail.
"""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np

from tests.api.random_requests.poses import NOTATIONS, in_base, tool_at, written
from tests.api.random_requests.scenes import Scenes
from tests.api.random_requests.waypoints import TOOLS, Waypoints

if TYPE_CHECKING:
    from collections.abc import Sequence

BACKENDS: Sequence[dict[str, Any]] = (
    {"kind": "cubic"},
    {"kind": "quintic"},
    {"kind": "trapezoidal"},
    {"kind": "ruckig"},
    {"kind": "ruckig", "synchronization": "time"},
    {"kind": "toppra"},
    {"kind": "toppra", "solver": "package"},
    {"kind": "toppra", "jerk_limited": True},
    {"kind": "auto"},
)
"""Back ends that take milliseconds."""

FRAMES = {"pallet": {"position": [0.2, -0.1, 0.05], "orientation": {"kind": "rpy", "rpy": [0.1, -0.2, 0.7]}}}
MOUNTING = {"position": [0.0, 0.0, 0.5], "orientation": {"kind": "rpy", "rpy": [0.3, 0.0, 0.2]}}
FEW_CHECKS = (1, 30, 300)
"""Bounds on the search for a detour, so that it takes no longer than the other planning."""


PARTS: Sequence[dict[str, Any]] = (
    {"kind": "sphere", "radius": 0.02},
    {"kind": "box", "size": [0.04, 0.06, 0.02]},
    {"kind": "capsule", "radius": 0.01, "length": 0.1},
    {"kind": "convex", "vertices": [[0.0, 0.0, 0.0], [0.03, 0.0, 0.0], [0.0, 0.03, 0.0], [0.0, 0.0, 0.03]]},
)
"""Shapes of attached objects."""


class Plans(Waypoints, Scenes):
    """Random plan requests for a robot."""

    def plan(self) -> dict[str, Any]:
        """Return a plan request with a random choice of fields."""
        request: dict[str, Any] = {
            "robot": self.robot.id,
            "backend": dict(self.choice(BACKENDS)),
            "limits": self.limits(0.08),
            "include": ["polynomials"],
            "sample_period": 0.5,
            "deadline": 30.0,
        }
        if self.chance(0.2):
            request["tool"] = self.choice(TOOLS)
        if self.chance(0.1):
            request["mounting"] = MOUNTING
        if self.chance(0.15):
            request["frames"] = FRAMES
        if self.chance(0.1):
            request["payload"] = self.payload()
        if self.chance(0.04):
            request["backend"] = {"kind": self.choice(("ruckig", "ruckig", "quintic", "cubic", "auto"))}
            return self._passing_joints(request)
        near, tool = self.position(None), request.get("tool")
        waypoints: list[dict[str, Any]] = [{"kind": "joint", "position": near.tolist()}]
        joint_positions, count = [near], 2 + int(self.random.integers(3))
        for k in range(1, count):
            made, near, tool = self.waypoint(near, request, tool)
            if "tool" in made and self.chance(0.95):
                waypoints[-1].pop("transition", None)
            self._passage(made, is_last=k == count - 1)
            joint_positions.append(near)
            waypoints.append(made)
        request["waypoints"] = waypoints
        if self.chance(0.25):
            request["scene"] = self.scene(request, joint_positions)
            if self.chance(0.3):
                request["speed_zones"] = self.speed_zones(request["scene"])
            self._leave_ways_open(waypoints)
            if self.handles:
                self._handle(request, joint_positions)
        if self.chance(0.1):
            request["self_collision"] = self.chance(0.5)
        self._of_the_whole(request)
        if len(waypoints) == 2 and self.chance(0.03):
            request["backend"] = {"kind": "min_effort"}
        if self.chance(0.05):
            request["picture"] = {"show": ["position", "path"], "joints": [self.robot.joint_names[0]], "view": "xy"}
        return request

    def _passage(self, made: dict[str, Any], *, is_last: bool) -> None:
        """Add to a waypoint its passing or dwell, its duration, and its limits on the segment."""
        if not is_last and self.chance(0.5):
            made["transition"] = self.choice(
                ({"kind": "through"}, {"kind": "blend", "radius": self.between(1e-3, 0.1)})
            )
            if self.chance(0.02):
                made["transition"] = {"kind": "through", "velocity": self.velocity()}
        elif self.chance(0.3):
            made["dwell"] = self.between(0.01, 1.0)
        if self.chance(0.12):
            made["duration"] = self.between(0.1, 10.0)
        elif self.chance(0.12):
            made["minimum_duration"] = self.between(0.1, 5.0)
        if self.chance(0.25):
            made["limits"] = self.limits(0.12)
        if self.chance(0.06):
            made |= {"payload": self.payload()} if self.chance(0.5) else {"put_down": True}

    def _passing_joints(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return passed joint positions, some of them with requested velocities."""
        near = self.position(None)
        request["waypoints"] = [{"kind": "joint", "position": near.tolist()}]
        for _ in range(2 + int(self.random.integers(4))):
            near = self.position(near)
            passed: dict[str, Any] = {"kind": "joint", "position": near.tolist(), "transition": {"kind": "through"}}
            if self.chance(0.7):
                passed["transition"]["velocity"] = self.velocity()
            request["waypoints"].append(passed)
        del passed["transition"]
        if request["backend"]["kind"] == "ruckig" and self.chance(0.5):
            request["backend"]["initial_velocity"] = self.velocity()
        return request

    def _leave_ways_open(self, waypoints: list[dict[str, Any]]) -> None:
        for waypoint in waypoints[1:]:
            if waypoint["kind"] != "relative" and self.chance(0.25):
                waypoint["motion"] = {"kind": "free", "most_checks": self.choice(FEW_CHECKS)} | self._optimised()
                waypoint.pop("duration", None)

    def _optimised(self) -> dict[str, Any]:
        """Return the objective and budget for optimising a detour; mostly nothing."""
        if self.chance(0.6):
            return {}
        budget = self.choice(({"optimise_checks": 50}, {"optimise_checks": 300}, {"time_budget": 0.2}))
        objective = {"optimise": self.choice(("duration", "effort", "path_length"))} if self.chance(0.97) else {}
        return {**budget, **objective}

    def _handle(self, request: dict[str, Any], joint_positions: Sequence[np.ndarray]) -> None:
        """Attach a part at the tool, or another object, at a waypoint, and mostly detach it at a later one."""
        waypoints, scene = request["waypoints"], request["scene"]
        if self.chance(0.7):
            scene |= {"objects": scene["objects"][:1], "margin": 0.0}
        k = 0 if self.chance(0.5) else int(self.random.integers(len(waypoints)))
        taken: dict[str, Any] = {"id": "part"}
        if scene["objects"] and self.chance(0.1):
            taken["id"] = self.choice(scene["objects"])["id"]
        at_tool = in_base(self.robot, request, "world").actInv(
            tool_at(self.robot, joint_positions[k], request.get("tool"))
        )
        at_tool.translation += at_tool.rotation @ np.array([0.0, 0.0, self.between(0.01, 0.1)])
        part = {"id": "part", "shape": self.choice(PARTS), "pose": written(at_tool, self.choice(NOTATIONS))}
        scene["objects"].append(part)
        links = [shape.link for shape in self.robot.collision_shapes if shape.joint]
        if self.chance(0.2):
            taken["link"] = self.choice(links)
        if self.chance(0.3):
            taken["touch_links"] = [self.choice(links)]
        waypoints[k]["attach"] = [taken]
        handled = [k]
        if self.chance(0.7) and k + 1 < len(waypoints):
            handled.append(int(self.random.integers(k + 1, len(waypoints))))
            waypoints[handled[-1]]["detach"] = [taken["id"]]
        if scene.get("attached") and self.chance(0.3):
            handled.append(int(self.random.integers(len(waypoints))))
            waypoints[handled[-1]].setdefault("detach", []).append("held_0")
        for k in handled if self.chance(0.97) else []:
            waypoints[k].pop("transition", None)

    def _of_the_whole(self, request: dict[str, Any]) -> None:
        if self.chance(0.08):
            request["duration"] = self.between(0.5, 20.0)
        if self.chance(0.15) and request["backend"]["kind"] == "ruckig":
            request["backend"]["initial_velocity"] = self.velocity()
        if self.chance(0.1):
            prefer = ("continuous", "near_reference", "manipulability", "far_from_limits", "arm", "weld_flat")
            request["ik"] = {"prefer": self.choice(prefer), "reference": self.position(None).tolist()}
        if self.chance(0.15):
            at = self.choice(({"waypoint": 0}, {"waypoint": 1}, {"time": 0.01}, {"distance": 0.0}))
            request["actions"] = [{"kind": "set_output", "at": at, "name": "gripper", "value": True}]

    def spoiled(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return a request with one random number made huge, tiny or of the opposite sign."""
        request = copy.deepcopy(request)
        places: list[tuple[Any, Any]] = []

        def collect(value: Any) -> None:
            for key, child in value.items() if isinstance(value, dict) else enumerate(value):
                if isinstance(child, dict | list):
                    collect(child)
                elif isinstance(child, float):
                    places.append((value, key))

        collect(request)
        container, key = self.choice(places)
        container[key] = self.choice((0.0, -container[key], 1e-12, 1e-300, 1e6, -1e6, 1e9, np.pi, 5e-324))
        request["deadline"] = 30.0
        return request
