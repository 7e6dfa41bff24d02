"""Robot models, their readers for URDF and Denavit-Hartenberg tables, and the catalogue of robots."""

from planner.robots.catalogue import catalogue_ids, load_robot
from planner.robots.derived.external_axes import ExternalAxis
from planner.robots.description import DRIVE_VALUES, LIMITED_QUANTITIES, RANGED_QUANTITIES, Joint
from planner.robots.dh import DHJoint
from planner.robots.payload import PayloadTable
from planner.robots.robot import Robot
from planner.robots.varying.torque_curves import TorqueCurve
from planner.robots.varying.velocity_curves import VelocityCurves, VelocityParabola, VelocityTable

__all__ = [
    "DRIVE_VALUES",
    "LIMITED_QUANTITIES",
    "RANGED_QUANTITIES",
    "DHJoint",
    "ExternalAxis",
    "Joint",
    "PayloadTable",
    "Robot",
    "TorqueCurve",
    "VelocityCurves",
    "VelocityParabola",
    "VelocityTable",
    "catalogue_ids",
    "load_robot",
]
