"""Requests that the tests send, each a fresh copy to be changed at will."""

from __future__ import annotations

from typing import Any, get_args

from api.contract.requests import Include

PARTS: tuple[str, ...] = get_args(get_args(Include.__value__)[0])
"""Names of the parts that an answer has on request."""

IDENTITY = {"kind": "quaternion", "xyzw": [0.0, 0.0, 0.0, 1.0]}


def joint(*position: float, **more: Any) -> dict[str, Any]:
    return {"kind": "joint", "position": list(position), **more}


def plan_request(**changes: Any) -> dict[str, Any]:
    """Return two joint waypoints of the arm with three joints."""
    return {
        "robot": "three_dof_arm",
        "waypoints": [joint(0.1, 0.2, 0.3), joint(0.3, 0.1, 0.5)],
        "backend": {"kind": "cubic"},
        **changes,
    }


def pose_waypoint(position: Any, orientation: Any = None, **more: Any) -> dict[str, Any]:
    return {"kind": "pose", "pose": {"position": position, "orientation": orientation}, **more}


def relative_waypoint(move: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"kind": "relative", "frame": "tool", "move": move, **more}


def validate_request(**changes: Any) -> dict[str, Any]:
    return {
        "robot": "three_dof_arm",
        "samples": {"time": [0.0, 1.0, 2.0], "position": [[0.1, 0.2, 0.3], [0.15, 0.2, 0.3], [0.2, 0.2, 0.3]]},
        **changes,
    }


def dh_joint(**changes: Any) -> dict[str, Any]:
    return {"kind": "revolute", "theta": 0.0, "d": 0.0, "a": 0.4, "alpha": 0.0, "velocity": 2.0, **changes}


def dh_robot(**changes: Any) -> dict[str, Any]:
    """Return a planar arm with two links of 0.4 m and 0.3 m."""
    return {
        "kind": "dh",
        "id": "planar_arm",
        "convention": "standard",
        "joints": [dh_joint(), dh_joint(a=0.3)],
        **changes,
    }


def urdf_robot(links: str, **changes: Any) -> dict[str, Any]:
    return {"kind": "urdf", "id": "uploaded", "urdf": f'<robot name="r">{links}</robot>', **changes}


def urdf_chain(joints: int) -> str:
    """Return a chain of revolute joints, each 0.1 m above the one before."""
    links = "".join(f'<link name="l{i}"/>' for i in range(joints + 1))
    return links + "".join(urdf_joint(i, f"l{i}", f"l{i + 1}") for i in range(joints))


def urdf_joint(i: int, parent: str, child: str, **limits: Any) -> str:
    bounds = {"lower": -1, "upper": 1, "velocity": 1, "effort": 10, **limits}
    limit = " ".join(f'{name}="{value}"' for name, value in bounds.items())
    return (
        f'<joint name="j{i}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 0.1"/><axis xyz="0 1 0"/><limit {limit}/></joint>'
    )
