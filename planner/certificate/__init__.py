"""The exact check of a trajectory, whatever made it, against the limits of its robot."""

from planner.certificate.checks import Certificate, Check
from planner.certificate.clearance import Clearance, ClearanceReport
from planner.certificate.samples import certify_samples, interpolated
from planner.certificate.speed_zones import SpeedZoneCheck
from planner.certificate.trajectories import certify

__all__ = [
    "Certificate",
    "Check",
    "Clearance",
    "ClearanceReport",
    "SpeedZoneCheck",
    "certify",
    "certify_samples",
    "interpolated",
]
