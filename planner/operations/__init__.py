"""Operations on trajectories of any origin; each answer is certified against the limits of its robot."""

from planner.operations.certified import (
    CertifiedTrajectory,
    JointState,
    bounded_quantities,
    kept_clear,
    trajectory_warnings,
)
from planner.operations.editing import (
    JoinedTrajectory,
    Junction,
    ResampledTrajectory,
    join_trajectories,
    resample_trajectory,
    reverse_trajectory,
    slice_trajectory,
)
from planner.operations.max_payload import MaxPayload, max_payload
from planner.operations.retiming import RetimedTrajectory, retime_trajectory
from planner.operations.stopping import stop_joints
from planner.operations.stopping_on_path import stop_on_path

__all__ = [
    "CertifiedTrajectory",
    "JoinedTrajectory",
    "JointState",
    "Junction",
    "MaxPayload",
    "ResampledTrajectory",
    "RetimedTrajectory",
    "bounded_quantities",
    "join_trajectories",
    "kept_clear",
    "max_payload",
    "resample_trajectory",
    "retime_trajectory",
    "reverse_trajectory",
    "slice_trajectory",
    "stop_joints",
    "stop_on_path",
    "trajectory_warnings",
]
