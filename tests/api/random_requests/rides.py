"""Random plan requests with rides: poses on one or two objects that pass the arm at constant velocity."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from tests.api.random_requests.draws import Draws
from tests.api.random_requests.plans import BACKENDS, FRAMES, MOUNTING
from tests.api.random_requests.poses import NOTATIONS, in_base, tool_at, written

LEAST_AHEAD = 0.12
"""Least distance of the middle of an object from the tool that meets it, m."""


class Rides(Draws):
    """Random plan requests with rides of a robot."""

    def plan(self) -> dict[str, Any]:
        """Return a request in which the arm meets an object, or two objects one after the other."""
        request: dict[str, Any] = {
            "robot": self.robot.id,
            "backend": dict(self.choice(BACKENDS)),
            "limits": self.limits(0.03),
            "include": ["polynomials"],
            "sample_period": 0.5,
            "deadline": 30.0,
            "scene": {"objects": []},
        }
        if self.chance(0.2):
            request["mounting"] = MOUNTING
        if self.chance(0.3):
            request["frames"] = FRAMES
        if self.chance(0.5):
            request["scene"]["margin"] = self.choice((0.0, 1e-3, 0.01))
        near, time = self.position(None), 0.0
        waypoints: list[dict[str, Any]] = [{"kind": "joint", "position": near.tolist()}]
        for number in range(1 + self.chance(0.3)):
            near, time = self.position(near), time + self.random.uniform(1.0, 3.0)
            waypoints += self._ride(request, f"part_{number}", near, time)
            if self.chance(0.5):
                near = self.position(near)
                waypoints.append({"kind": "joint", "position": near.tolist()})
        if "on" in waypoints[-1] and self.chance(0.95):
            waypoints.append({"kind": "joint", "position": self.position(near).tolist()})
        for waypoint in waypoints[1:]:
            if "motion" not in waypoint and self.chance(0.3):
                waypoint["motion"] = {"kind": "free", "most_checks": 300}
        if self.chance(0.3):
            self._put_down(waypoints)
        return request | {"waypoints": waypoints}

    def _put_down(self, waypoints: list[dict[str, Any]]) -> None:
        """Put down the object that was taken at a later waypoint, which may be on another object."""
        taken = [(k, take["id"]) for k, waypoint in enumerate(waypoints) for take in waypoint.get("attach", [])]
        if taken and taken[0][0] + 1 < len(waypoints):
            k = int(self.random.integers(taken[0][0] + 1, len(waypoints)))
            waypoints[k]["detach"] = [taken[0][1]]

    def _ride(self, request: dict[str, Any], name: str, near: np.ndarray, time: float) -> list[dict[str, Any]]:
        """Add an object that passes the tool at a time, s, and return the waypoints on it."""
        frame = self.choice(["world", "base", *request.get("frames", {})])
        onto = pin.SE3(pin.exp3(self.random.normal(size=3)), np.zeros(3))  # of the object, seen from the tool
        onto.translation = np.array([0.0, 0.0, LEAST_AHEAD]) + self.random.uniform(-0.02, 0.05, 3)
        way = self.random.normal(size=3)
        velocity = way / np.linalg.norm(way) * self.between(0.01, 0.4)  # in the frame
        into = in_base(self.robot, request, frame)
        met = into.actInv(tool_at(self.robot, near, None) * onto)
        start = pin.SE3(met.rotation, met.translation - time * velocity)
        motion: dict[str, Any] = {"kind": "linear", "velocity": velocity.tolist()}
        if self.chance(0.2):
            motion["end"] = time * self.random.uniform(0.8, 3.0)
        shape = {"kind": "box", "size": self.random.uniform(0.01, 0.06, 3).tolist()}
        pose = written(start, self.choice(NOTATIONS))
        request["scene"]["objects"].append({"id": name, "frame": frame, "shape": shape, "pose": pose, "motion": motion})
        first = onto.inverse()
        waypoints = [{"kind": "pose", "on": name, "pose": written(first, self.choice(NOTATIONS))}]
        waypoints[0]["earliest_arrival"] = time * self.random.uniform(0.5, 1.0)
        if self.chance(0.3):
            waypoints[0]["latest_arrival"] = time + self.random.uniform(0.0, 2.0)
        for _ in range(int(self.random.integers(3))):
            turn = pin.exp3(self.random.normal(size=3) * self.choice((0.0, 0.05)))
            shift = pin.SE3(turn, self.random.normal(size=3) * 0.01)
            waypoint = {"kind": "pose", "on": name, "motion": {"kind": "linear"}}
            waypoints.append(waypoint | {"pose": written(first * shift, self.choice(NOTATIONS))})
            if self.chance(0.2):
                waypoints[-1]["minimum_duration"] = self.between(0.05, 1.0)
        for waypoint in waypoints:
            if self.chance(0.3):
                waypoint["dwell"] = self.between(0.01, 0.5)
        if self.chance(0.3):
            waypoints[int(self.random.integers(len(waypoints)))]["attach"] = [{"id": name}]
        return waypoints
