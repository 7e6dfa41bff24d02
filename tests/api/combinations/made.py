"""Requests made of rows of factors, with numbers that are mostly within reach."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin

from planner.kinematics.configurations import configurations
from planner.robots import ExternalAxis, Robot, load_robot
from tests.api.combinations.factors import COUNT, NONE, ROBOTS, TOOL_MOTIONS
from tests.api.random_requests.answered import times_of
from tests.api.random_requests.draws import TOOL_LIMITS
from tests.api.random_requests.plans import FRAMES, MOUNTING, Plans
from tests.api.random_requests.poses import NOTATIONS, in_base, tool_at, written
from tests.api.random_requests.robots import EXTERNAL, arm_of_shapes
from tests.api.random_requests.waypoints import FREEDOMS, TOOLS

if TYPE_CHECKING:
    from tests.api.combinations.covering import Row

HOME = "home"
WATTS = {"power": (100.0, 1000.0), "total_power": (200.0, 2000.0)}
"""Ranges of limits of power, W, that slow some motions."""

RAIL = {"name": EXTERNAL, "kind": "prismatic", "axis": [0.0, 1.0, 0.0], "lower": -1.0, "upper": 1.0}
RAIL |= {"velocity": 1.0, "acceleration": 2.0, "jerk": 20.0, "mass": 60.0}

STEP = 0.1
"""Approximate distance between joint positions, rad or m."""

FAR = 0.6
"""Approximate distance between joint positions where a pose leaves the robot a choice, rad or m."""

LONGER = {"duration": (1.2, 1.5), "minimum_duration": (1.2, 3.0)}
"""Bounds of a duration of a segment as a multiple of its duration without it."""

OPTIONS: dict[str, Any] = {
    "acceleration_time": 0.4,
    "deceleration_time": 0.5,
    "jerk_limited": True,
    "knots": 12,
    "slowdown": 1.5,
    "time_weight": 1.0,
    "iterations": 5,
    "max_deviation": 0.05,
    "max_joint_deviation": 0.05,
}
"""Values of numeric and boolean options of back ends."""


Known = dict[str, tuple[Robot, list[dict[str, Any]]]]
"""Robots by their level, each with the requests that add it."""


@cache
def robots() -> Known:
    """Return each robot of the factor, which has a named position, with the requests that add it."""
    made = {}
    for name in ROBOTS:
        base, bodies, axes = _base(name)
        home = np.array([*([0.0] * len(axes)), *middle(base)])
        named = {f"{HOME}_{k}": (home + 0.03 * k).tolist() for k in range(COUNT)}
        changes: dict[str, Any] = {"named_positions": named}
        body = {"kind": "derived", "id": f"{name}_of_combinations", "from": base.id, **changes}
        if axes:
            body["external_axes"] = axes
            changes["external_axes"] = [ExternalAxis(**axis) for axis in axes]
        made[name] = base.derived(id=body["id"], **changes), [*bodies, body]
    return made


def _base(name: str) -> tuple[Robot, list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the base robot, the requests that add it, and the external axes of the derived robot."""
    if name == "arm_of_shapes":
        urdf = arm_of_shapes()
        return Robot.from_urdf(urdf, id=name), [{"kind": "urdf", "id": name, "urdf": urdf}], []
    if name == "on_a_rail":
        return load_robot("kuka_kr16_2"), [], [RAIL]
    return load_robot(name), [], []


def middle(robot: Robot) -> np.ndarray:
    """Draw joint positions amid the limits, and return the one farthest from singularities."""
    lower, upper = np.maximum(robot.limit("lower"), -np.pi), np.minimum(robot.limit("upper"), np.pi)
    shares = np.random.default_rng(1).uniform(0.3, 0.7, (200, robot.dof))
    return max(lower + shares * (upper - lower), key=lambda position: manipulability(robot, position))


def manipulability(robot: Robot, position: np.ndarray) -> float:
    """Return the least singular value of the Jacobian of the tool, or of its position."""
    data, rows = robot.model.createData(), 3 if robot.is_position_only or robot.dof < 6 else 6
    jacobian = pin.computeFrameJacobian(robot.model, data, position, robot.tip_frame_id, pin.LOCAL_WORLD_ALIGNED)
    return float(np.linalg.svd(jacobian[:rows], compute_uv=False)[-1])


class Combined(Plans):
    """A request of a row of factors for a robot, by random numbers."""

    def __init__(self, robot: Robot, row: Row, random: np.random.Generator) -> None:
        super().__init__(robot, random)
        self.row = row

    def has(self, name: str, level: str = "given") -> bool:
        """Tell whether a factor has a level."""
        return self.row.get(name, NONE) == level

    def request(self) -> dict[str, Any]:
        """Return the request."""
        row = self.row
        request: dict[str, Any] = {
            "robot": self.robot.id,
            "backend": self._backend(row["backend"]),
            "ik": {"prefer": row["prefer"]},
            "include": ["polynomials"],
            "sample_period": 0.5,
            "deadline": 30.0,
            "seed": 1,
            "frames": FRAMES,
        }
        if row["limits"] != NONE:
            request["limits"] = self._limits([row["limits"]])
        if self.has("ik", "reference"):
            request["ik"]["reference"] = self._near(np.array(self.robot.named_positions[f"{HOME}_0"])).tolist()
        elif self.has("ik", "tolerances"):
            request["ik"] |= {"tolerance_position": 1e-7, "tolerance_orientation": 1e-5}
        given: dict[str, Any] = {"tool": TOOLS[0], "mounting": MOUNTING, "payload": self.payload()}
        given |= {"start_tolerance": 1e-3}
        request |= {name: value for name, value in given.items() if self.has(name)}
        positions = [self._near(np.array(self.robot.named_positions[f"{HOME}_0"]), 3.0 * STEP)]
        for k in range(1, COUNT):
            positions.append(self._near(positions[-1], FAR if self._is_far(k) else STEP))
        tool, waypoints = request.get("tool"), []
        for k in range(COUNT):
            if self.has(f"tool {k}"):
                tool = TOOLS[1] if tool is TOOLS[0] else TOOLS[0]
            waypoints.append(self._waypoint(k, positions, request, tool))
            if self.has(f"tool {k}"):
                waypoints[k]["tool"] = tool
        request["waypoints"] = waypoints
        self._surround(request, positions, tool)
        if row["action"] != NONE:
            moment = {"waypoint": 1, "distance": 0.01, "time": 0.1}[row["moment"]]
            request["actions"] = [{**self._action(row["action"]), "at": {row["moment"]: moment}}]
        return request

    def with_times_of_segments(self, request: dict[str, Any], answer: dict[str, Any]) -> dict[str, Any]:
        """Return the request with the segment durations of the row, longer than in an answer without durations."""
        waypoints, times = [*request["waypoints"]], times_of(answer)
        for k in range(1, COUNT):
            if (timing := self.row[f"timing {k}"]) != NONE:
                without = max(times[k]["arrival_time"] - times[k - 1]["departure_time"], 0.1)
                waypoints[k] = {**waypoints[k], timing: without * self.random.uniform(*LONGER[timing])}
        return {**request, "waypoints": waypoints}

    def _is_far(self, k: int) -> bool:
        """Tell whether a goal leaves the robot a choice that is independent of its nearest solution."""
        is_open = self.has(f"goal {k}", "position") or self.has(f"free {k}", "all")
        return is_open and not any(self.row[f"motion {i}"] in TOOL_MOTIONS for i in (k, min(k + 1, COUNT - 1)))

    def _backend(self, level: str) -> dict[str, Any]:
        kind, *option = level.split()
        if not option:
            return {"kind": kind}
        name, *value = option
        if name.endswith("velocity"):
            return {"kind": kind, name: (0.2 * np.array(self.velocity())).tolist()}
        if name.endswith("acceleration"):
            return {"kind": kind, name: (0.1 * np.minimum(self.robot.limit("acceleration"), 10.0)).tolist()}
        assert value or name in OPTIONS, (
            f"the generator knows no value of the option {name} of {kind}: add one to OPTIONS"
        )
        return {"kind": kind, name: value[0] if value else OPTIONS[name]}

    def _limits(self, names: list[str]) -> dict[str, Any]:
        """Return limits by their names, each with a value that slows the plan slightly."""
        made: dict[str, Any] = {}
        for name in names:
            quantity, _, form = name.rpartition("_")
            if name in TOOL_LIMITS:
                made[name] = TOOL_LIMITS[name][1]
            elif form == "scale":
                made[name] = self.random.uniform(0.3, 1.0)
            elif name in WATTS:
                most = self.random.uniform(*WATTS[name])
                made[name] = most if name == "total_power" else [most] * self.robot.dof
            elif name == "rms_torque":
                made[name] = (0.9 * np.minimum(self.robot.limit("torque"), 1e4)).tolist()
            elif name == "cycle_time":
                made[name] = self.random.uniform(1.0, 60.0)
            else:
                quantity = quantity if form == "range" else name
                own = np.minimum(self.robot.limit(quantity), 1e4)
                least = 0.9 if quantity == "torque" else 0.4
                sides = self.random.uniform(least, 1.0, (2, len(own))) * own
                made[name] = np.stack([-sides[0], sides[1]], axis=1).tolist() if form == "range" else sides[0].tolist()
        return made

    def _near(self, position: np.ndarray, step: float = STEP) -> np.ndarray:
        way = self.random.normal(size=len(position))
        moved = position + self.random.uniform(0.5, 1.0) * step * way / np.linalg.norm(way) * np.sqrt(len(way)) / 2.0
        return np.clip(moved, self.robot.limit("lower"), self.robot.limit("upper"))

    def _waypoint(
        self, k: int, positions: list[np.ndarray], request: dict[str, Any], tool: dict[str, Any] | None
    ) -> dict[str, Any]:
        row = self.row
        end, into = tool_at(self.robot, positions[k], tool), pin.SE3.Identity()
        start = tool_at(self.robot, positions[k - 1] if k else positions[k], tool)
        made: dict[str, Any]
        match row[f"goal {k}"]:
            case "joint":
                made = {"kind": "joint", "position": positions[k].tolist()}
            case "named":
                made = {"kind": "named", "name": f"{HOME}_{k}"}
                positions[k] = np.array(self.robot.named_positions[made["name"]])
                end = tool_at(self.robot, positions[k], tool)
            case "relative":
                made = {"kind": "relative", "frame": row[f"axes {k}"], "move": self._move_of(row[f"move {k}"])}
            case kind:
                frame = row[f"frame {k}"]
                into = in_base(self.robot, request, None if frame == NONE else frame)
                made = {"kind": "pose", "pose": written(into.actInv(end), row.get(f"notation {k}"))}
                made |= {} if frame == NONE else {"frame": frame}
                if kind == "pose":
                    made |= self._region(row[f"free {k}"], "free")
                    if row[f"configuration {k}"] != NONE:
                        [there] = configurations(self.robot, [positions[k]])
                        side = row[f"configuration {k}"]
                        made["configuration"] = {side: getattr(there, side)}
                if self.has(f"external {k}"):
                    made["external"] = {EXTERNAL: float(positions[k][0])}
        if k:
            made["motion"] = self._motion(k, into.actInv(start), into.actInv(end))
            quantities = {"joints": ["velocity", "acceleration", "jerk"], "tool": list(TOOL_LIMITS)}
            if row[f"limits {k}"] != NONE:
                made["limits"] = self._limits(quantities[row[f"limits {k}"]])
        if f"passing {k}" in row:
            made["transition"] = self._transition(row[f"passing {k}"])
        if self.has(f"dwell {k}"):
            made["dwell"] = self.random.uniform(0.1, 1.0)
        if row[f"carries {k}"] != NONE:
            made |= {"put_down": True} if self.has(f"carries {k}", "put_down") else {"payload": self.payload()}
        if row[f"action {k}"] != NONE:
            made["actions"] = [self._action(row[f"action {k}"])]
        return made

    def _move_of(self, level: str) -> dict[str, Any]:
        match level:
            case "cylindrical":
                return {"kind": level, "r": 0.04, "alpha": self.random.uniform(-0.3, 0.3), "l": 0.03}
            case "spherical":
                return {"kind": level, "r": 0.03, "beta": 0.2, "gamma": self.random.uniform(-0.3, 0.3)}
            case _:
                turn = (
                    {"kind": "rpy", "rpy": self.random.uniform(-0.15, 0.15, 3).tolist()} if level == "turned" else None
                )
                shift = self.random.uniform(-0.05, 0.05, 3).tolist()
                return {"kind": "cartesian", "translation": shift, "orientation": turn}

    def _region(self, level: str, name: str) -> dict[str, Any]:
        if level == NONE:
            return {}
        if level == "rotation_z alone":
            return {name: "rotation_z"}
        names = FREEDOMS if level == "all" else [level]
        widths = {one: 0.02 if len(one) == 1 else 0.4 for one in names}
        return {name: {one: [-width * self.random.random(), width] for one, width in widths.items()}}

    def _motion(self, k: int, start: pin.SE3, end: pin.SE3) -> dict[str, Any]:
        kind = self.row[f"motion {k}"]
        if kind == "joint":
            return {"kind": kind, "turns": self.row[f"turns {k}"]}
        if kind == "free":
            level = self.row[f"optimise {k}"]
            made: dict[str, Any] = {"kind": kind, "most_checks": 500}
            if level != NONE:
                made |= {"optimise_checks": 50, "optimise": "duration" if level == "checks" else level}
            return made
        assert kind in TOOL_MOTIONS, f"the generator knows no values for motions of the kind {kind}"
        made = {
            "kind": kind,
            "singularity": self.row[f"singularity {k}"],
            **self._region(self.row[f"open {k}"], "free"),
        }
        if self.has(f"tolerance {k}"):
            made |= {"tolerance_position": 1e-3, "tolerance_orientation": 1e-2}
        notation = None
        if self.row[f"goal {k}"] in ("joint", "named", "pose") and not self.robot.is_position_only:
            notation = self.choice((None, *NOTATIONS))
        poses = [written(pose, notation) for pose in self._aside(start, end, 1 if kind == "circular" else 2)]
        match kind:
            case "circular":
                made["via"] = poses[0]
            case "polyline":
                made |= {"poses": poses, "blend": 0.005}
            case "spline":
                made["poses"] = poses
        return made

    def _aside(self, start: pin.SE3, end: pin.SE3, count: int) -> list[pin.SE3]:
        """Return poses between two, beside the straight line, in order."""
        poses = [pin.SE3.Interpolate(start, end, k / (count + 1.0)) for k in range(1, count + 1)]
        off = np.cross(end.translation - start.translation, self.random.normal(size=3))
        for pose in poses:
            pose.translation += 0.15 * self.random.uniform(0.5, 1.0) * off
        return poses

    def _transition(self, level: str) -> dict[str, Any]:
        match level.split():
            case ["blend"]:
                return {"kind": "blend", "radius": self.random.uniform(0.005, 0.03)}
            case ["through", _, _, _]:
                return {"kind": "through", "velocity": (0.3 * np.array(self.velocity())).tolist()}
            case _:
                return {"kind": level}

    def _action(self, kind: str) -> dict[str, Any]:
        return {
            "set_output": {"kind": kind, "name": "gripper", "value": True},
            "wait": {"kind": kind, "duration": 0.2},
        }[kind]

    def _surround(self, request: dict[str, Any], positions: list[np.ndarray], tool: dict[str, Any] | None) -> None:
        """Add objects beside the path, objects that the robot holds, and objects that it takes."""
        row, scene = self.row, dict[str, Any]()
        if row["object"] != NONE:
            there = tool_at(self.robot, positions[2], tool)
            there.translation += there.rotation @ np.array([0.0, 0.0, 0.3])
            shape = self._solid(row["object"])
            if shape["kind"] == "half_space":
                there = pin.SE3(np.eye(3), np.array([0.0, 0.0, -2.0]))
            pose = written(in_base(self.robot, request, "world").actInv(there), "quaternion")
            scene["objects"] = [{"id": "thing", "shape": shape, "pose": pose, "margin": 1e-3}]
            scene["margin"] = 2e-3
        if row["attached"] != NONE:
            held = {"position": [0.0, 0.0, 0.03], "orientation": None}
            scene["attached"] = [{"id": "held", "shape": self._solid(row["attached"], 0.01), "pose": held}]
            scene["attached"][0]["touch_links"] = [self.robot.collision_shapes[-1].link]
        if not scene and any(self.has(f"motion {k}", "free") for k in range(COUNT)):
            far = {"position": [9.0, 9.0, 9.0], "orientation": None}
            scene["objects"] = [{"id": "far", "shape": self._solid("sphere"), "pose": far}]
        if scene:
            request["scene"] = scene
        if row["self_collision"] != NONE:
            request["self_collision"] = row["self_collision"] == "true"
        if row.get("speed_zones", NONE) != NONE:
            zone: dict[str, Any] = {"clearance": 0.2, "speed": 0.2}
            request["speed_zones"] = [
                zone | ({"objects": ["thing"]} if self.has("speed_zones", "of an object") else {})
            ]
        if self.has("residual_vibration", "reported"):
            request["residual_vibration"] = {
                "frequency": 9.0,
                "damping": 0.03,
                "frequency_error": 0.1,
                "suppress": False,
            }
        if row.get("handled", NONE) != NONE:
            request["waypoints"][1]["attach"] = [{"id": "thing", "touch_links": []}]
            if self.has("handled", "attach and detach"):
                request["waypoints"][2]["detach"] = ["thing"]

    def _solid(self, kind: str, size: float = 0.03) -> dict[str, Any]:
        corners = (size * np.array(CORNERS)).tolist()
        known: dict[str, dict[str, Any]] = {
            "box": {"size": [size, 1.5 * size, size]},
            "sphere": {"radius": size},
            "cylinder": {"radius": size, "length": 2.0 * size},
            "capsule": {"radius": size, "length": 2.0 * size},
            "half_space": {"normal": [0.0, 0.0, 1.0], "offset": 0.0},
            "convex": {"vertices": corners},
            "mesh": {"vertices": corners, "triangles": FACES},
            "point_cloud": {"points": corners, "radius": 0.01, "voxel": 0.005},
        }
        assert kind in known, f"the generator knows no values for shapes of the kind {kind}"
        return {"kind": kind, **known[kind]}


CORNERS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
