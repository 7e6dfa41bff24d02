"""The node: services of ROS 2 in the manner of MoveIt, answered by the planner service through rosbridge."""

from __future__ import annotations

import argparse
import logging
import os
import time
from typing import TYPE_CHECKING, Any

import roslibpy

from planner_ros2.messages import (
    FLANGE,
    check_frame,
    check_link,
    goal_waypoint,
    pose_waypoint,
    scaled_limits,
    state_message,
    state_positions,
)
from planner_ros2.service import INVALID_GOAL_CONSTRAINTS, INVALID_LINK_NAME, SUCCESS, PlannerService, RefusedError

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner_ros2.messages import Message

LOG = logging.getLogger("planner_ros2")

DEFAULT_BACKEND = "toppra"
"""The back end of requests without a `planner_id`."""

Answer = dict[str, Any]


class Node:
    """MoveIt-style services for one robot of the planner service.

    Args:
        ros: A connection to rosbridge.
        planner: The planner service.
        robot: The id of the robot there.
        scene: The id of a scene there; goals are then reached by collision-free paths. None: no scene.
    """

    def __init__(self, ros: roslibpy.Ros, planner: PlannerService, robot: str, scene: str | None = None) -> None:
        self._planner = planner
        self._robot = planner.send(f"/v1/robots/{robot}")
        self._joints: list[str] = self._robot["joint_names"]
        self._common = {"robot": robot} | ({} if scene is None else {"scene": scene})
        self._has_scene = scene is not None
        self._current: dict[str, float] = {}
        roslibpy.Topic(ros, "/joint_states", "sensor_msgs/msg/JointState").subscribe(self._take_state)
        for name, kind, answer, refusal in (
            ("plan_kinematic_path", "GetMotionPlan", self._plan_motion, _motion_plan),
            ("compute_cartesian_path", "GetCartesianPath", self._plan_lines, _code_only),
            ("compute_ik", "GetPositionIK", self._solve_ik, _code_only),
            ("compute_fk", "GetPositionFK", self._compute_poses, _code_only),
        ):
            service = roslibpy.Service(ros, f"/planner/{name}", f"moveit_msgs/srv/{kind}")
            service.advertise(_answering(name, answer, refusal))

    def _take_state(self, message: Message) -> None:
        self._current |= dict(zip(message["name"], message["position"], strict=True))

    def _plan_motion(self, request: Message) -> Answer:
        """Answer `moveit_msgs/srv/GetMotionPlan`."""
        motion = request["motion_plan_request"]
        start = state_positions(self._joints, motion.get("start_state", {}), self._current)
        goal = goal_waypoint(motion, self._robot, start)
        if self._has_scene:
            goal["motion"] = {"kind": "free"}
        began = time.monotonic()
        trajectory = self._trajectory(start, [goal], motion)
        plan = {
            "trajectory_start": state_message(self._joints, start),
            "group_name": motion.get("group_name", ""),
            "trajectory": {"joint_trajectory": trajectory},
            "planning_time": time.monotonic() - began,
        }
        return _motion_plan(SUCCESS, plan)

    def _plan_lines(self, request: Message) -> Answer:
        """Answer `moveit_msgs/srv/GetCartesianPath`: all of the path, or none of it."""
        check_frame(request, self._robot)
        check_link(request.get("link_name", ""), self._robot)
        if not request.get("waypoints"):
            raise RefusedError(INVALID_GOAL_CONSTRAINTS, "a Cartesian path needs at least one waypoint")
        start = state_positions(self._joints, request.get("start_state", {}), self._current)
        lines = [pose_waypoint(pose) | {"motion": {"kind": "linear"}} for pose in request["waypoints"]]
        solution = {"joint_trajectory": self._trajectory(start, lines, request)}
        plan = {"start_state": state_message(self._joints, start), "solution": solution, "fraction": 1.0}
        return _code_only(SUCCESS, plan)

    def _trajectory(self, start: list[float], waypoints: list[Answer], request: Message) -> Answer:
        """Plan through the service, and return a `trajectory_msgs/msg/JointTrajectory`."""
        body: Answer = {
            **self._common,
            "tool": FLANGE,
            "waypoints": [{"kind": "joint", "position": start}, *waypoints],
            "backend": {"kind": request.get("planner_id") or DEFAULT_BACKEND},
        }
        if limits := scaled_limits(request):
            body["limits"] = limits
        if speed := request.get("max_cartesian_speed", 0.0):
            body["limits"] = {**body.get("limits", {}), "tcp_linear_velocity": speed}
        trajectory: Answer = self._planner.send("/v1/trajectories?format=ros2", body)
        return trajectory

    def _solve_ik(self, request: Message) -> Answer:
        """Answer `moveit_msgs/srv/GetPositionIK` by the solution that is nearest to the given state."""
        asked = request["ik_request"]
        check_frame(asked["pose_stamped"], self._robot)
        check_link(asked.get("ik_link_name", ""), self._robot)
        reference = state_positions(self._joints, asked.get("robot_state", {}), self._current)
        body = {"robot": self._robot["id"], "tool": FLANGE, "reference": reference}
        if asked.get("avoid_collisions"):
            body |= {**self._common, "self_collision": {}}
        pose = pose_waypoint(asked["pose_stamped"]["pose"])["pose"]
        solutions = self._planner.send("/v1/kinematics/inverse", body | {"poses": [pose]})["results"][0]["solutions"]
        if not solutions or solutions[0].get("collision"):
            raise RefusedError(-31, "no solution reaches the pose")
        return _code_only(SUCCESS, {"solution": state_message(self._joints, solutions[0]["position"])})

    def _compute_poses(self, request: Message) -> Answer:
        """Answer `moveit_msgs/srv/GetPositionFK`."""
        check_frame(request, self._robot)
        positions = [state_positions(self._joints, request.get("robot_state", {}), self._current)]
        body = {"robot": self._robot["id"], "positions": positions, "include": ["links"]}
        (links,) = self._planner.send("/v1/kinematics/forward", body)["links"]
        by_name = {each["link"]: each for each in links}
        names = list(request.get("fk_link_names") or [self._robot["tip_frame"]])
        if unknown := [name for name in names if name not in by_name]:
            raise RefusedError(INVALID_LINK_NAME, f"{self._robot['id']} has no link {', '.join(unknown)}")
        header = {"frame_id": request.get("header", {}).get("frame_id", "")}
        poses = [{"header": header, "pose": _pose_message(by_name[name])} for name in names]
        return _code_only(SUCCESS, {"pose_stamped": poses, "fk_link_names": names})


def _pose_message(link: Message) -> Answer:
    """Return a pose of the service as a `geometry_msgs/msg/Pose`."""
    return {
        "position": dict(zip("xyz", link["position"], strict=True)),
        "orientation": dict(zip("xyzw", link["orientation"]["xyzw"], strict=True)),
    }


def _motion_plan(code: int, plan: Answer) -> Answer:
    return {"motion_plan_response": _code_only(code, plan)}


def _code_only(code: int, plan: Answer) -> Answer:
    return {**plan, "error_code": {"val": code}}


def _answering(
    name: str, answer: Callable[[Message], Answer], refusal: Callable[[int, Answer], Answer]
) -> Callable[[Message, Answer], bool]:
    """Return the callback of a service: it fills in the response, and logs the reason of a refusal."""

    def callback(request: Message, response: Answer) -> bool:
        try:
            response |= answer(request)
        except RefusedError as error:
            LOG.warning("%s: %s", name, error)
            response |= refusal(error.code, {})
        except (KeyError, TypeError) as error:
            LOG.warning("%s: malformed request: %r", name, error)
            response |= refusal(INVALID_GOAL_CONSTRAINTS, {})
        return True

    return callback


def main() -> None:
    """Run the node until SIGINT."""
    parser = argparse.ArgumentParser(prog="planner-ros2", description=__doc__)
    parser.add_argument("--robot", required=True, metavar="ID", help="the robot in the planner service")
    parser.add_argument("--scene", metavar="ID", help="a scene of the planner service")
    parser.add_argument("--planner", default="http://127.0.0.1:8000", metavar="URL", help="the planner service")
    parser.add_argument("--bridge", default="127.0.0.1:9090", metavar="HOST:PORT", help="rosbridge's WebSocket server")
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(name)s: %(message)s")
    host, _, port = options.bridge.rpartition(":")
    if not host or not port.isdigit():
        parser.error("--bridge must be HOST:PORT, as in 127.0.0.1:9090")
    ros = roslibpy.Ros(host, int(port), transport="asyncio")
    ros.run()
    try:
        Node(ros, PlannerService(options.planner, os.environ.get("PLANNER_KEY")), options.robot, options.scene)
        LOG.info("plans for %s", options.robot)
        while True:
            time.sleep(1.0)
    except RefusedError as error:
        parser.exit(1, f"{error}\n")
    except KeyboardInterrupt:
        pass
    finally:
        ros.close()


if __name__ == "__main__":
    main()
