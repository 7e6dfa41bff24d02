"""Robots: what they are, how they are read from URDF and Denavit-Hartenberg tables, and those that ship."""

from planner.robots.catalogue import catalogue_ids, load_robot
from planner.robots.describe import describe
from planner.robots.dh import DHJoint, DHModel, read_dh
from planner.robots.robot import Joint, Robot
from planner.robots.urdf import read_urdf

__all__ = [
    "DHJoint",
    "DHModel",
    "Joint",
    "Robot",
    "catalogue_ids",
    "describe",
    "load_robot",
    "read_dh",
    "read_urdf",
]
