"""Random operations on plans: trajectory operations and collision checks."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.api.random_requests.draws import TOOL_LIMITS
from tests.api.random_requests.plans import BACKENDS, FRAMES, MOUNTING, TOOLS, Plans
from tests.api.random_requests.poses import tool_at

AS_THEY_ARE = ("mounting", "tool")
"""Fields of a plan request that its operations repeat."""


class Operations(Plans):
    """Random operations for a robot."""

    def operation(self, request: dict[str, Any], planned: dict[str, Any]) -> tuple[str, dict[str, Any]]:
        """Return an operation on a planned trajectory: its path after /v1/, and the request."""
        if self.validates and "mounting" not in request:
            return "trajectories/validate", self.validation(planned)
        trajectory, duration = {"polynomials": planned["polynomials"]}, planned["duration"]
        asked: dict[str, Any] = {"robot": self.robot.id, "include": ["polynomials"], "deadline": 30.0}
        asked |= {name: request[name] for name in AS_THEY_ARE if name in request}
        if self.chance(0.4):
            asked["limits"] = self.limits(0.1)
        if self.chance(0.3):
            quantities = ("position", "velocity", "acceleration", "jerk", *TOOL_LIMITS)
            asked["enforced"] = [quantity for quantity in quantities if self.chance(0.6)]
        at = sorted(self.random.uniform(0.0, 1.0, 2) * duration)
        name = self.choice(("retime", "stop", "stop", "reverse", "slice", "join", "resample", "check"))
        if name == "check":
            return "collisions/check", self.check(request, planned)
        if self.chance(0.2):
            asked |= {key: request[key] for key in ("frames",) if key in request}
            joint_positions = [np.array(waypoint["position"]) for waypoint in planned["waypoints"]]
            asked["scene"] = self.scene(asked, joint_positions)
            if self.slows:
                asked["speed_zones"] = self.speed_zones(asked["scene"])
        if name == "retime":
            asked.pop("enforced", None)
            asked |= {"backend": self.choice(BACKENDS), "max_deviation": self.between(1e-3, 0.05)}
            asked |= {"points": self.points()} if self.chance(0.5) else {"trajectory": trajectory}
        elif name == "stop":
            asked |= {"trajectory": trajectory, "time": at[0], "mode": self.choice(("on_path", "joints"))}
        elif name == "slice":
            asked |= {"trajectory": trajectory, "start": at[0], "end": at[1]}
        elif name == "join":
            asked |= {"trajectories": [trajectory, trajectory] if self.chance(0.3) else [trajectory]}
        elif name == "resample":
            asked |= {"trajectory": trajectory, "period": self.between(0.01, 0.5)}
        else:
            asked |= {"trajectory": trajectory}
        return f"trajectories/{name}", asked

    def check(self, request: dict[str, Any], planned: dict[str, Any] | None) -> dict[str, Any]:
        """Return a collision check of a plan, its samples, or joint positions in a scene."""
        asked: dict[str, Any] = {"robot": self.robot.id, "deadline": 30.0}
        asked |= {name: request[name] for name in (*AS_THEY_ARE, "frames") if name in request}
        if self.chance(0.2):
            asked["tolerance"] = self.choice((2e-4, 5e-3, 0.1))
        if self.chance(0.3):
            asked["self_collision"] = self.chance(0.5)
        if planned is None or self.chance(0.4):
            joint_positions = [self.position(None) for _ in range(int(self.random.integers(1, 6)))]
            asked["positions"] = [joint_position.tolist() for joint_position in joint_positions]
        elif self.chance(0.6):
            asked["polynomials"] = planned["polynomials"]
            joint_positions = [np.array(waypoint["position"]) for waypoint in planned["waypoints"]]
        else:
            rows = planned["samples"]
            asked["samples"] = {"time": rows["time"], "position": rows["position"]}
            if self.chance(0.5):
                asked["samples"]["velocity"] = rows["velocity"]
            joint_positions = [np.array(row) for row in rows["position"]]
        if not self.chance(0.1):
            asked["scene"] = self.scene(asked, joint_positions)
            if self.slows and "positions" not in asked:
                asked["speed_zones"] = self.speed_zones(asked["scene"])
        return asked

    def solutions(self) -> tuple[str, dict[str, Any]]:
        """Return a request for solutions or reachability of poses and joint positions in a scene."""
        asked: dict[str, Any] = {"robot": self.robot.id, "deadline": 30.0}
        shared = {"tool": (self.choice(TOOLS), 0.2), "mounting": (MOUNTING, 0.1), "frames": (FRAMES, 0.2)}
        asked |= {name: value for name, (value, share) in shared.items() if self.chance(share)}
        joint_positions = [self.position(None) for _ in range(int(self.random.integers(1, 5)))]
        poses = [self._pose(tool_at(self.robot, row, asked.get("tool"))) for row in joint_positions]
        if not self.chance(0.15):
            asked["scene"] = self.scene(asked, joint_positions)
        if self.chance(0.3):
            asked["self_collision"] = self.chance(0.5)
        if self.chance(0.5):
            if self.chance(0.5):
                asked["reference"] = self.position(None).tolist()
            return "kinematics/inverse", asked | {"poses": poses, "solutions": self.choice(("best", "all"))}
        waypoints = [
            {"kind": "pose", "pose": pose} if self.chance(0.7) else {"kind": "joint", "position": row.tolist()}
            for pose, row in zip(poses, joint_positions, strict=True)
        ]
        return "kinematics/reachability", asked | {"waypoints": waypoints}

    def validation(self, planned: dict[str, Any]) -> dict[str, Any]:
        """Return a validation of a plan in a scene, with limits that it may exceed."""
        asked: dict[str, Any] = {"robot": self.robot.id, "polynomials": planned["polynomials"], "deadline": 30.0}
        if self.chance(0.3):
            asked["limits"] = self.limits(0.1)
        if self.chance(0.7):
            asked["scene"] = self.scene(asked, [np.array(waypoint["position"]) for waypoint in planned["waypoints"]])
            if self.chance(0.3):
                asked["speed_zones"] = self.speed_zones(asked["scene"])
        if self.chance(0.3):
            asked["self_collision"] = self.chance(0.5)
        return asked

    def comparison(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return a request to plan with two back ends."""
        backends = [request["backend"], self.choice(BACKENDS)]
        return {name: value for name, value in request.items() if name != "backend"} | {"backends": backends}

    def points(self) -> list[list[float]]:
        """Return a walk of joint positions, smooth or rough, some of them repeated."""
        count, step = 2 + int(self.random.integers(40)), self.between(1e-4, 0.05)
        walk = self.position(None) + np.cumsum(self.random.normal(scale=step, size=(count, self.robot.dof)), axis=0)
        walk = np.clip(walk, self.robot.limit("lower"), self.robot.limit("upper"))
        rows = np.sort(self.random.integers(0, count, count)) if self.chance(0.3) else np.arange(count)
        return list(walk[rows].tolist())
