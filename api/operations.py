"""Every operation of the service: the routes and the OpenAPI document are made from this table."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from api.routes import info, planning, robots
from api.schemas import answers, dynamics, kinematics, requests
from api.schemas import robots as robot_schemas

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    from fastapi import Response
    from starlette.requests import Request

WORKER_CODES = ("overloaded", "deadline_exceeded", "internal_error")
BODY_CODES = ("invalid_request", "payload_too_large", "unsupported_media_type", "memory_exceeded", *WORKER_CODES)


@dataclass(frozen=True)
class Operation:
    """One operation.

    Attributes:
        id: Its `operationId`.
        method: HTTP method.
        path: With parameters in braces.
        tag: Group in the documentation.
        summary: One sentence.
        endpoint: What answers.
        answer: Schema of the answer; None: there is no body.
        request: Schema of the request's body; None: there is none.
        status: HTTP status of success.
        also: Other statuses with the same schema, and what they mean.
        problems: Codes of the problems that may be the answer instead.
        examples: Request bodies by name.
        formats: Whether `?format=` and `Accept` choose the form of the answer.
    """

    id: str
    method: str
    path: str
    tag: str
    summary: str
    endpoint: Callable[[Request], Awaitable[Response]]
    answer: Any
    request: Any = None
    status: int = 200
    also: Mapping[int, str] = field(default_factory=dict)
    problems: tuple[str, ...] = ()
    examples: Mapping[str, Any] = field(default_factory=dict)
    formats: bool = False


OPERATIONS = (
    Operation(
        id="plan_trajectory",
        method="POST",
        path="/v1/trajectories",
        tag="trajectories",
        summary="Plan a certified joint trajectory through waypoints.",
        endpoint=planning.plan_trajectory,
        request=requests.PlanRequest,
        answer=answers.PlanAnswer,
        problems=(
            *BODY_CODES,
            "unknown_robot",
            "not_acceptable",
            "unreachable_waypoint",
            "configuration_change",
            "singular_path",
            "joint_position_limit",
            "missing_dynamics",
            "infeasible_duration",
            "limits_unsatisfiable",
        ),
        examples={
            "two_joint_waypoints": {
                "robot": "ngv_refuelling_arm",
                "waypoints": [
                    {"kind": "joint", "name": "P1", "position": [0.1, -0.4, 0.2, 0.0, 0.3, 0.0]},
                    {"kind": "joint", "name": "P2", "position": [0.2, -0.3, 0.2, 0.0, 0.3, 0.0]},
                ],
                "backend": {"kind": "quintic"},
                "sample_period": 0.05,
            },
            "a_line_and_a_blended_corner": {
                "robot": "kuka_kr16_l6_2",
                "waypoints": [
                    {"kind": "joint", "position": [0.3, -1.2, 1.4, 0.2, 0.6, 0.1]},
                    {
                        "kind": "relative",
                        "frame": "base",
                        "move": {"kind": "cartesian", "translation": [0.0, -0.2, 0.0]},
                        "motion": {"kind": "linear"},
                        "transition": {"kind": "blend", "radius": 0.05},
                    },
                    {
                        "kind": "relative",
                        "frame": "base",
                        "move": {"kind": "cartesian", "translation": [0.0, 0.0, -0.2]},
                        "motion": {"kind": "linear"},
                    },
                ],
                "limits": {"tcp_linear_velocity": 0.25},
            },
        },
        formats=True,
    ),
    Operation(
        id="compare_backends",
        method="POST",
        path="/v1/trajectories/compare",
        tag="trajectories",
        summary="Plan the same waypoints with several back ends, side by side.",
        endpoint=planning.compare_backends,
        request=requests.CompareRequest,
        answer=answers.ComparisonAnswer,
        problems=(*BODY_CODES, "unknown_robot"),
        examples={
            "two_back_ends": {
                "robot": "ngv_refuelling_arm",
                "waypoints": [
                    {"kind": "joint", "position": [0.1, -0.4, 0.2, 0.0, 0.3, 0.0]},
                    {"kind": "joint", "position": [0.2, -0.3, 0.2, 0.0, 0.3, 0.0]},
                ],
                "backends": [{"kind": "cubic"}, {"kind": "quintic"}],
                "sample_period": 0.05,
            },
        },
    ),
    Operation(
        id="validate_trajectory",
        method="POST",
        path="/v1/trajectories/validate",
        tag="trajectories",
        summary="Hold a trajectory of any origin against limits.",
        endpoint=planning.validate_trajectory,
        request=requests.ValidateRequest,
        answer=answers.CertificateAnswer,
        problems=(*BODY_CODES, "unknown_robot"),
        examples={
            "three_samples": {
                "robot": "three_dof_arm",
                "samples": {
                    "time": [0.0, 1.0, 2.0],
                    "position": [[0.0, 0.0, 0.0], [0.05, 0.0, 0.0], [0.1, 0.0, 0.0]],
                },
            },
        },
    ),
    Operation(
        id="list_backends",
        method="GET",
        path="/v1/backends",
        tag="trajectories",
        summary="Every back end, its options and what it guarantees.",
        endpoint=info.list_backends,
        answer=answers.BackendsAnswer,
    ),
    Operation(
        id="list_robots",
        method="GET",
        path="/v1/robots",
        tag="robots",
        summary="Every robot: the catalogue's and the added ones.",
        endpoint=robots.list_robots,
        answer=robot_schemas.RobotsAnswer,
        problems=WORKER_CODES,
    ),
    Operation(
        id="get_robot",
        method="GET",
        path="/v1/robots/{id}",
        tag="robots",
        summary="One robot.",
        endpoint=robots.get_robot,
        answer=robot_schemas.RobotDescription,
        problems=("unknown_robot", *WORKER_CODES),
    ),
    Operation(
        id="add_robot",
        method="POST",
        path="/v1/robots",
        tag="robots",
        summary="Add a robot from a URDF document or a Denavit-Hartenberg table.",
        endpoint=robots.add_robot,
        request=robot_schemas.RobotDefinition,
        answer=robot_schemas.AddedRobot,
        status=201,
        also={200: "The same robot was there already."},
        problems=(*BODY_CODES, "invalid_robot_model", "robot_exists", "catalogue_robot", "too_many_robots"),
        examples={
            "two_joint_table": {
                "kind": "dh",
                "id": "planar_arm",
                "convention": "standard",
                "joints": [
                    {"kind": "revolute", "theta": 0.0, "d": 0.0, "a": 0.4, "alpha": 0.0, "velocity": 2.0},
                    {"kind": "revolute", "theta": 0.0, "d": 0.0, "a": 0.3, "alpha": 0.0, "velocity": 2.0},
                ],
            },
        },
    ),
    Operation(
        id="delete_robot",
        method="DELETE",
        path="/v1/robots/{id}",
        tag="robots",
        summary="Forget an added robot.",
        endpoint=robots.delete_robot,
        answer=None,
        status=204,
        problems=("unknown_robot", "catalogue_robot", "internal_error"),
    ),
    Operation(
        id="forward_kinematics",
        method="POST",
        path="/v1/kinematics/forward",
        tag="kinematics",
        summary="Poses of the tool at joint positions.",
        endpoint=planning.forward_kinematics,
        request=kinematics.ForwardKinematicsRequest,
        answer=kinematics.ForwardKinematicsAnswer,
        problems=(*BODY_CODES, "unknown_robot"),
        examples={"one_position": {"robot": "three_dof_arm", "positions": [[0.1, 0.2, 0.3]]}},
    ),
    Operation(
        id="inverse_kinematics",
        method="POST",
        path="/v1/kinematics/inverse",
        tag="kinematics",
        summary="Joint positions that bring the tool to poses.",
        endpoint=planning.inverse_kinematics,
        request=kinematics.InverseKinematicsRequest,
        answer=kinematics.InverseKinematicsAnswer,
        problems=(*BODY_CODES, "unknown_robot"),
        examples={
            "one_position": {
                "robot": "ngv_refuelling_arm",
                "poses": [{"position": [-0.8, 1.0, -0.3], "orientation": None}],
            }
        },
    ),
    Operation(
        id="reachability",
        method="POST",
        path="/v1/kinematics/reachability",
        tag="kinematics",
        summary="Which waypoints can be reached, in how many configurations, and by what margin; nothing is planned.",
        endpoint=planning.reachability,
        request=kinematics.ReachabilityRequest,
        answer=kinematics.ReachabilityAnswer,
        problems=(*BODY_CODES, "unknown_robot"),
        examples={
            "a_pose_and_a_move": {
                "robot": "ngv_refuelling_arm",
                "waypoints": [
                    {"kind": "pose", "pose": {"position": [-0.8, 1.0, -0.3], "orientation": None}},
                    {
                        "kind": "relative",
                        "frame": "base",
                        "move": {"kind": "cartesian", "translation": [0.0, 0.0, 0.1]},
                    },
                ],
            }
        },
    ),
    Operation(
        id="jacobian",
        method="POST",
        path="/v1/kinematics/jacobian",
        tag="kinematics",
        summary="Jacobian of the tool at a joint position, and how far that is from singular.",
        endpoint=planning.jacobian,
        request=kinematics.JacobianRequest,
        answer=kinematics.JacobianAnswer,
        problems=(*BODY_CODES, "unknown_robot"),
        examples={"one_position": {"robot": "three_dof_arm", "position": [0.1, 0.2, 0.3]}},
    ),
    Operation(
        id="workspace",
        method="POST",
        path="/v1/kinematics/workspace",
        tag="kinematics",
        summary="How far the tool reaches within the position limits, and a cloud of points where it can be.",
        endpoint=planning.workspace,
        request=kinematics.WorkspaceRequest,
        answer=kinematics.WorkspaceAnswer,
        problems=(*BODY_CODES, "unknown_robot"),
        examples={"hundred_points": {"robot": "date_sorting_arm", "samples": 100}},
    ),
    Operation(
        id="inverse_dynamics",
        method="POST",
        path="/v1/dynamics/inverse",
        tag="dynamics",
        summary="Joint torques of states of motion.",
        endpoint=planning.inverse_dynamics,
        request=dynamics.InverseDynamicsRequest,
        answer=dynamics.InverseDynamicsAnswer,
        problems=(*BODY_CODES, "unknown_robot", "missing_dynamics"),
        examples={
            "holding_a_payload": {
                "robot": "date_sorting_arm",
                "payload": {"mass": 1.0},
                "positions": [[0.0, 0.25, 0.0, 0.0, 1.5, 0.0]],
            }
        },
    ),
    Operation(
        id="get_limits",
        method="GET",
        path="/v1/limits",
        tag="service",
        summary="The caps of the service.",
        endpoint=info.get_limits,
        answer=answers.ServiceLimits,
    ),
    Operation(
        id="get_liveness",
        method="GET",
        path="/livez",
        tag="service",
        summary="Whether the process answers.",
        endpoint=info.get_liveness,
        answer=answers.Liveness,
    ),
    Operation(
        id="get_readiness",
        method="GET",
        path="/readyz",
        tag="service",
        summary="Whether the workers are warm: each has planned once with every back end.",
        endpoint=info.get_readiness,
        answer=answers.Readiness,
        also={503: "Not yet."},
    ),
)
