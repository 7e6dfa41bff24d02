"""Waypoints in, certified joint trajectory out.

The library of the trajectory planner: `plan` takes a `PlanningProblem` to a certified `Plan`. Every public name stands
here and is loaded when it is first used, so that importing the package alone costs nothing. Positions, velocities,
forces and times are in SI units throughout (m, rad, s, N); in arrays rows are time and columns are joints.

Examples:
    >>> import planner
    >>> robot = planner.load_robot("kuka_kr16_2")
    >>> home = planner.JointWaypoint([0.0, -1.5, 1.5, 0.0, 0.5, 0.0])
    >>> pick = planner.JointWaypoint([1.0, -1.2, 1.2, 0.0, 0.5, 0.5])
    >>> plan = planner.plan(planner.PlanningProblem(robot, [home, pick]), planner.Trapezoidal())
    >>> print(f"{plan.trajectory.duration:.4f} s")
    0.7666 s
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.backends import BACKENDS as BACKENDS
    from planner.backends import Auto as Auto
    from planner.backends import BackEnd as BackEnd
    from planner.backends import Cubic as Cubic
    from planner.backends import MinEffort as MinEffort
    from planner.backends import Quintic as Quintic
    from planner.backends import Ruckig as Ruckig
    from planner.backends import Toppra as Toppra
    from planner.backends import Trapezoidal as Trapezoidal
    from planner.backends import as_backend as as_backend
    from planner.certificate import Certificate as Certificate
    from planner.certificate import Check as Check
    from planner.certificate import Clearance as Clearance
    from planner.certificate import ClearanceReport as ClearanceReport
    from planner.certificate import SpeedZoneCheck as SpeedZoneCheck
    from planner.certificate import certify as certify
    from planner.certificate import certify_samples as certify_samples
    from planner.certificate import interpolated as interpolated
    from planner.certificate.sampling import SampleCertificate as SampleCertificate
    from planner.comparison import Comparison as Comparison
    from planner.comparison import Figures as Figures
    from planner.comparison import compare as compare
    from planner.comparison import figures as figures
    from planner.dynamics import inverse_dynamics as inverse_dynamics
    from planner.errors import ClearanceUnproved as ClearanceUnproved
    from planner.errors import Collision as Collision
    from planner.errors import ConfigurationChange as ConfigurationChange
    from planner.errors import Fault as Fault
    from planner.errors import Finding as Finding
    from planner.errors import InfeasibleDuration as InfeasibleDuration
    from planner.errors import InvalidProblem as InvalidProblem
    from planner.errors import InvalidRobotModel as InvalidRobotModel
    from planner.errors import JointPositionLimit as JointPositionLimit
    from planner.errors import LimitsUnsatisfiable as LimitsUnsatisfiable
    from planner.errors import MissingDynamics as MissingDynamics
    from planner.errors import NearestPose as NearestPose
    from planner.errors import NoPathFound as NoPathFound
    from planner.errors import PathPoint as PathPoint
    from planner.errors import PlanningError as PlanningError
    from planner.errors import Remedy as Remedy
    from planner.errors import SingularPath as SingularPath
    from planner.errors import StartInCollision as StartInCollision
    from planner.errors import UnknownRobot as UnknownRobot
    from planner.errors import UnreachableWaypoint as UnreachableWaypoint
    from planner.export import FORMATS as FORMATS
    from planner.export import INCLUDABLE as INCLUDABLE
    from planner.export import ExportOptions as ExportOptions
    from planner.export import Format as Format
    from planner.export import render as render
    from planner.guarantees import QUANTITIES as QUANTITIES
    from planner.guarantees import Guarantee as Guarantee
    from planner.kinematics import Configuration as Configuration
    from planner.kinematics import Extreme as Extreme
    from planner.kinematics import InverseKinematicsResult as InverseKinematicsResult
    from planner.kinematics import Workspace as Workspace
    from planner.kinematics import all_solutions as all_solutions
    from planner.kinematics import configurations as configurations
    from planner.kinematics import forward_kinematics as forward_kinematics
    from planner.kinematics import inverse_kinematics as inverse_kinematics
    from planner.kinematics import inverse_kinematics_many as inverse_kinematics_many
    from planner.kinematics import jacobian as jacobian
    from planner.kinematics import manipulability as manipulability
    from planner.kinematics import tool_accelerations as tool_accelerations
    from planner.kinematics import tool_jerks as tool_jerks
    from planner.kinematics import tool_pose as tool_pose
    from planner.kinematics import tool_velocities as tool_velocities
    from planner.kinematics import workspace as workspace
    from planner.kinematics.options import InverseKinematicsOptions as InverseKinematicsOptions
    from planner.limits import Limits as Limits
    from planner.operations import CertifiedTrajectory as CertifiedTrajectory
    from planner.operations import JoinedTrajectory as JoinedTrajectory
    from planner.operations import JointState as JointState
    from planner.operations import Junction as Junction
    from planner.operations import ResampledTrajectory as ResampledTrajectory
    from planner.operations import RetimedTrajectory as RetimedTrajectory
    from planner.operations import join_trajectories as join_trajectories
    from planner.operations import resample_trajectory as resample_trajectory
    from planner.operations import retime_trajectory as retime_trajectory
    from planner.operations import reverse_trajectory as reverse_trajectory
    from planner.operations import slice_trajectory as slice_trajectory
    from planner.operations import stop_joints as stop_joints
    from planner.operations import stop_on_path as stop_on_path
    from planner.paths import JointPath as JointPath
    from planner.planning import Budget as Budget
    from planner.planning import plan as plan
    from planner.plans.result import Plan as Plan
    from planner.plans.tool_lines import LinePolynomial as LinePolynomial
    from planner.plans.tool_lines import line_polynomials as line_polynomials
    from planner.plans.tool_speeds import SlowPart as SlowPart
    from planner.plans.tool_speeds import ToolSpeedReport as ToolSpeedReport
    from planner.plans.tool_speeds import tool_speed_reports as tool_speed_reports
    from planner.plots.animation import Animation as Animation
    from planner.plots.picture import Picture as Picture
    from planner.plots.picture import draw_plan as draw_plan
    from planner.plots.picture import draw_robot_at as draw_robot_at
    from planner.plots.picture import draw_workspace as draw_workspace
    from planner.problems.actions import AtDistance as AtDistance
    from planner.problems.actions import AtTime as AtTime
    from planner.problems.actions import AtWaypoint as AtWaypoint
    from planner.problems.actions import SetOutput as SetOutput
    from planner.problems.actions import Wait as Wait
    from planner.problems.motion_around import FreeMotion as FreeMotion
    from planner.problems.moves import CartesianMove as CartesianMove
    from planner.problems.moves import CylindricalMove as CylindricalMove
    from planner.problems.moves import SphericalMove as SphericalMove
    from planner.problems.problem import CircularMotion as CircularMotion
    from planner.problems.problem import JointMotion as JointMotion
    from planner.problems.problem import JointWaypoint as JointWaypoint
    from planner.problems.problem import LinearMotion as LinearMotion
    from planner.problems.problem import PlanningProblem as PlanningProblem
    from planner.problems.problem import PolylineMotion as PolylineMotion
    from planner.problems.problem import PoseWaypoint as PoseWaypoint
    from planner.problems.problem import RelativeWaypoint as RelativeWaypoint
    from planner.problems.problem import SplineMotion as SplineMotion
    from planner.problems.problem import ViaWaypoint as ViaWaypoint
    from planner.problems.problem import Waypoint as Waypoint
    from planner.problems.regions import Region as Region
    from planner.problems.transitions import BlendTransition as BlendTransition
    from planner.problems.transitions import StopTransition as StopTransition
    from planner.problems.transitions import ThroughTransition as ThroughTransition
    from planner.robots import DHJoint as DHJoint
    from planner.robots import ExternalAxis as ExternalAxis
    from planner.robots import Joint as Joint
    from planner.robots import Robot as Robot
    from planner.robots import catalogue_ids as catalogue_ids
    from planner.robots import load_robot as load_robot
    from planner.robots.collision.geometry import LinkShape as LinkShape
    from planner.robots.collision.pairs import CollisionPair as CollisionPair
    from planner.robots.payload import Payload as Payload
    from planner.samples import Samples as Samples
    from planner.scene import Attach as Attach
    from planner.scene import AttachedObject as AttachedObject
    from planner.scene import CollisionChecker as CollisionChecker
    from planner.scene import PointCloud as PointCloud
    from planner.scene import PostureCollision as PostureCollision
    from planner.scene import Scene as Scene
    from planner.scene import SceneObject as SceneObject
    from planner.scene import collisions_at as collisions_at
    from planner.scene import is_free as is_free
    from planner.shapes import BoundingCapsule as BoundingCapsule
    from planner.shapes import Box as Box
    from planner.shapes import Capsule as Capsule
    from planner.shapes import ConvexHull as ConvexHull
    from planner.shapes import Cylinder as Cylinder
    from planner.shapes import HalfSpace as HalfSpace
    from planner.shapes import InvalidShape as InvalidShape
    from planner.shapes import Shape as Shape
    from planner.shapes import Sphere as Sphere
    from planner.spatial import Pose as Pose
    from planner.spatial import as_pose as as_pose
    from planner.spatial import quaternion as quaternion
    from planner.spatial import rotation_from_quaternion as rotation_from_quaternion
    from planner.spatial import rotation_from_rpy as rotation_from_rpy
    from planner.spatial import rpy_from_rotations as rpy_from_rotations
    from planner.speed_zones import SpeedZone as SpeedZone
    from planner.timing.action_times import TimedAction as TimedAction
    from planner.trajectories.trajectory import PlanWarning as PlanWarning
    from planner.trajectories.trajectory import Trajectory as Trajectory
    from planner.waypoints.reachability import LimitMargin as LimitMargin
    from planner.waypoints.reachability import Reachability as Reachability
    from planner.waypoints.reachability import reachability as reachability

_NAMES = {
    "planner.timing.action_times": ("TimedAction",),
    "planner.problems.actions": ("AtDistance", "AtTime", "AtWaypoint", "SetOutput", "Wait"),
    "planner.backends": (
        "BACKENDS",
        "Auto",
        "BackEnd",
        "Cubic",
        "MinEffort",
        "Quintic",
        "Ruckig",
        "Toppra",
        "Trapezoidal",
        "as_backend",
    ),
    "planner.certificate": (
        "Certificate",
        "Check",
        "Clearance",
        "ClearanceReport",
        "SpeedZoneCheck",
        "certify",
        "certify_samples",
        "interpolated",
    ),
    "planner.certificate.sampling": ("SampleCertificate",),
    "planner.comparison": ("Comparison", "Figures", "compare", "figures"),
    "planner.dynamics": ("inverse_dynamics",),
    "planner.errors": (
        "ClearanceUnproved",
        "Collision",
        "ConfigurationChange",
        "Fault",
        "Finding",
        "InfeasibleDuration",
        "InvalidProblem",
        "InvalidRobotModel",
        "JointPositionLimit",
        "LimitsUnsatisfiable",
        "MissingDynamics",
        "NoPathFound",
        "NearestPose",
        "PathPoint",
        "PlanningError",
        "Remedy",
        "SingularPath",
        "StartInCollision",
        "UnknownRobot",
        "UnreachableWaypoint",
    ),
    "planner.export": ("FORMATS", "INCLUDABLE", "ExportOptions", "Format", "render"),
    "planner.guarantees": ("QUANTITIES", "Guarantee"),
    "planner.kinematics": (
        "Configuration",
        "Extreme",
        "InverseKinematicsResult",
        "Workspace",
        "all_solutions",
        "configurations",
        "forward_kinematics",
        "inverse_kinematics",
        "inverse_kinematics_many",
        "jacobian",
        "manipulability",
        "tool_accelerations",
        "tool_jerks",
        "tool_pose",
        "tool_velocities",
        "workspace",
    ),
    "planner.kinematics.options": ("InverseKinematicsOptions",),
    "planner.limits": ("Limits",),
    "planner.problems.motion_around": ("FreeMotion",),
    "planner.operations": (
        "CertifiedTrajectory",
        "JoinedTrajectory",
        "JointState",
        "Junction",
        "ResampledTrajectory",
        "RetimedTrajectory",
        "join_trajectories",
        "resample_trajectory",
        "retime_trajectory",
        "reverse_trajectory",
        "slice_trajectory",
        "stop_joints",
        "stop_on_path",
    ),
    "planner.paths": ("JointPath",),
    "planner.planning": ("Budget", "plan"),
    "planner.plots.animation": ("Animation",),
    "planner.plots.picture": ("Picture", "draw_plan", "draw_robot_at", "draw_workspace"),
    "planner.problems.moves": ("CartesianMove", "CylindricalMove", "SphericalMove"),
    "planner.problems.problem": (
        "CircularMotion",
        "JointMotion",
        "JointWaypoint",
        "LinearMotion",
        "PlanningProblem",
        "PolylineMotion",
        "PoseWaypoint",
        "RelativeWaypoint",
        "SplineMotion",
        "ViaWaypoint",
        "Waypoint",
    ),
    "planner.problems.transitions": ("BlendTransition", "StopTransition", "ThroughTransition"),
    "planner.problems.regions": ("Region",),
    "planner.plans.result": ("Plan",),
    "planner.robots": ("DHJoint", "ExternalAxis", "Joint", "Robot", "catalogue_ids", "load_robot"),
    "planner.robots.collision.geometry": ("LinkShape",),
    "planner.robots.collision.pairs": ("CollisionPair",),
    "planner.robots.payload": ("Payload",),
    "planner.samples": ("Samples",),
    "planner.shapes": (
        "BoundingCapsule",
        "Box",
        "Capsule",
        "ConvexHull",
        "Cylinder",
        "HalfSpace",
        "InvalidShape",
        "Shape",
        "Sphere",
    ),
    "planner.scene": (
        "Attach",
        "AttachedObject",
        "CollisionChecker",
        "PointCloud",
        "PostureCollision",
        "Scene",
        "SceneObject",
        "collisions_at",
        "is_free",
    ),
    "planner.spatial": (
        "Pose",
        "as_pose",
        "quaternion",
        "rotation_from_quaternion",
        "rotation_from_rpy",
        "rpy_from_rotations",
    ),
    "planner.speed_zones": ("SpeedZone",),
    "planner.plans.tool_lines": ("LinePolynomial", "line_polynomials"),
    "planner.plans.tool_speeds": ("SlowPart", "ToolSpeedReport", "tool_speed_reports"),
    "planner.trajectories.trajectory": ("PlanWarning", "Trajectory"),
    "planner.waypoints.reachability": ("LimitMargin", "Reachability", "reachability"),
}
"""Public names by the module that has them; the imports above say the same to type checkers and editors."""

_MODULES = {name: module for module, names in _NAMES.items() for name in names}
"""The module of each public name."""

__all__ = sorted(_MODULES)

if not TYPE_CHECKING:  # to a type checker an unknown name is an error

    def __getattr__(name: str) -> object:
        """Load a public name when it is first used."""
        if name not in _MODULES:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(_MODULES[name]), name)
        globals()[name] = value
        return value

    def __dir__() -> list[str]:
        return [*globals(), *__all__]
