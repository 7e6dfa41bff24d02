"""Random waypoints: every kind, motion and transition, with goals that are nearly always within reach."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from tests.api.random_requests.draws import Draws
from tests.api.random_requests.poses import NOTATIONS, in_base, tool_at, written
from tests.api.random_requests.robots import EXTERNAL

TOOLS = (
    {"position": [0.0, 0.0, 0.1], "orientation": None},
    {"position": [0.05, 0.0, 0.1], "orientation": {"kind": "rpy", "rpy": [0.0, 0.4, 0.0]}},
)
MOTIONS = ("joint", "joint", "linear", "linear", "circular", "polyline", "spline")
SINGULARITY = ("refuse", "refuse", "slow", "deviate")
FREEDOMS = ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z")


class Waypoints(Draws):
    """Random waypoints of a robot."""

    def waypoint(
        self, near: np.ndarray, request: dict[str, Any], tool: dict[str, Any] | None
    ) -> tuple[dict[str, Any], np.ndarray, dict[str, Any] | None]:
        """Return the waypoint after a joint position, a joint position near it, and the following tool."""
        made: dict[str, Any]
        if self.chance(0.07):
            tool = self.choice(TOOLS)
            changed = {"tool": tool}
        else:
            changed = {}
        if self.robot.named_positions and self.chance(0.03):
            name = self.choice(sorted(self.robot.named_positions))
            return {"kind": "named", "name": name, **changed}, np.array(self.robot.named_positions[name]), tool
        if self.chance(0.45):
            position = self.position(near)
            made = {"kind": "joint", "position": position.tolist(), **changed}
            if self.chance(0.1):
                made["motion"] = {"kind": "joint", "turns": self.choice(("nearest", "as_given"))}
            return made, position, tool
        start = tool_at(self.robot, near, tool)
        end, reach = self._goal(start), self.between(0.005, 0.1)
        if self.chance(0.35):
            made = {"kind": "relative", "frame": self.choice(("tool", "base")), "move": self._move(reach), **changed}
            frame, into = None, pin.SE3.Identity()
        else:
            frame = self.choice((None, None, "base", "world", *request.get("frames", {})))
            into = in_base(self.robot, request, frame)
            made = {"kind": "pose", "pose": self._pose(into.actInv(end)), **changed}
            if frame is not None:
                made["frame"] = frame
            if self.chance(0.25) and (made["pose"]["orientation"] or self.chance(0.1)):
                made["free"] = self.region()
            if EXTERNAL in self.robot.joint_names and self.chance(0.3):
                made["external"] = {EXTERNAL: float(near[0]) if self.chance(0.5) else self.random.uniform(-0.5, 0.5)}
            if self.chance(0.04):
                sides = {"shoulder": ("left", "right"), "elbow": ("up", "down"), "wrist": ("flip", "no_flip")}
                made["configuration"] = {side: self.choice(names) for side, names in sides.items() if self.chance(0.5)}
        kind = self.choice(MOTIONS)
        if kind != "joint":
            made["motion"] = self._tool_motion(kind, into.actInv(start), into.actInv(end))
        return made, near, tool

    def _goal(self, start: pin.SE3) -> pin.SE3:
        """Return a pose near another one: shifted, moved along an axis, turned, or equal."""
        shift = self.between(0.005, 0.1) * self.random.normal(size=3)
        turn = self.between(1e-3, 0.5) * self.random.normal(size=3)
        if self.chance(0.3):
            shift = np.round(shift, 1) if self.chance(0.3) else shift * (np.arange(3) == self.random.integers(3))
        if self.chance(0.5):
            turn *= 0.0
        if self.chance(0.03):
            shift *= 1e-7
        return pin.SE3(start.rotation @ pin.exp3(turn), start.translation + shift)

    def _pose(self, where: pin.SE3) -> dict[str, Any]:
        open_turn = self.robot.is_position_only or self.chance(0.1 if self.robot.dof > 5 else 0.8)
        return written(where, None if open_turn else self.choice(NOTATIONS))

    def _move(self, reach: float) -> dict[str, Any]:
        match int(self.random.integers(6)):
            case 0:
                r, alpha, l = (reach * self.random.normal(size=3)).tolist()  # noqa: E741 - the contract's letter
                return {"kind": "cylindrical", "r": r, "alpha": alpha, "l": l}
            case 1:
                r, beta, gamma = (reach * self.random.normal(size=3)).tolist()
                return {"kind": "spherical", "r": r, "beta": beta, "gamma": gamma}
        translation = (reach * self.random.normal(size=3)).tolist()
        turn = (0.3 * self.random.normal(size=3)).tolist()
        orientation = {"kind": "rpy", "rpy": turn} if self.chance(0.2) else None
        return {"kind": "cartesian", "translation": translation, "orientation": orientation}

    def region(self) -> Any:
        """Return a tolerance region, sometimes malformed."""
        if self.chance(0.3):
            return "rotation_z"
        region = {}
        for name in FREEDOMS:
            if self.chance(0.4):
                width = self.between(1e-3, 0.05 if len(name) == 1 else 1.5)
                least = 0.0 if self.chance(0.2) else -width * self.random.random()
                region[name] = [least, least + width]
                if self.chance(0.02):
                    region[name] = self.choice(([0.1, -0.1], [0.0, 0.0], [1.0, 4.0], [-1e6, 1e6]))
        return region

    def _tool_motion(self, kind: str, start: pin.SE3, end: pin.SE3) -> dict[str, Any]:
        """Return a motion of the tool between two poses in the frame of the waypoint."""
        motion: dict[str, Any] = {"kind": kind, "singularity": self.choice(SINGULARITY)}
        if self.chance(0.2):
            motion["free"] = self.region()
        if self.chance(0.15):
            motion["tolerance_position"] = self.between(1e-5, 1e-2)
            motion["tolerance_orientation"] = self.between(1e-4, 1e-1)
        poses = [written(pose, self._notation()) for pose in self._between(start, end, kind)]
        if kind == "circular":
            motion["via"] = poses[0]
        elif kind in ("polyline", "spline"):
            motion["poses"] = poses
        if kind == "polyline":
            motion["blend"] = self.between(1e-4, 0.05)
        return motion

    def _notation(self) -> str | None:
        return None if self.robot.is_position_only or self.chance(0.6) else str(self.choice(NOTATIONS))

    def _between(self, start: pin.SE3, end: pin.SE3, kind: str) -> list[pin.SE3]:
        """Return poses off the straight line, on it, or one of them twice."""
        count = 1 if kind == "circular" else int(self.random.integers(1, 5))
        length = float(np.linalg.norm(end.translation - start.translation))
        aside = 0.0 if self.chance(0.1) else 0.3 * max(length, 0.01)
        poses = []
        for share in np.linspace(0.0, 1.0, count + 2)[1:-1]:
            pose = pin.SE3.Interpolate(start, end, float(share))
            pose.translation += aside * self.random.normal(size=3)
            poses.append(pose)
        if len(poses) > 1 and self.chance(0.06):
            poses[1] = poses[0].copy()
        return poses
