"""The exact check of a trajectory, whatever made it, against the limits of its robot."""

from planner.certificate.checks import Certificate, Check
from planner.certificate.clearance import CLEARANCE_TOLERANCE, Clearance, ClearanceReport, at_rest, certify_clearance
from planner.certificate.residual_vibration import certify_residual_vibration
from planner.certificate.samples import certify_interpolation, certify_samples, interpolated, interpolation_of
from planner.certificate.sampling import worst_overshoot
from planner.certificate.speed_zones import SpeedZoneCheck, certify_speed_zones
from planner.certificate.trajectories import certify, certify_polynomials
from planner.guarantees import EndStates
from planner.quantities import MEASURES
from planner.speed_zones import refuse_zone_faults

__all__ = [
    "CLEARANCE_TOLERANCE",
    "MEASURES",
    "Certificate",
    "Check",
    "Clearance",
    "ClearanceReport",
    "EndStates",
    "SpeedZoneCheck",
    "at_rest",
    "certify",
    "certify_clearance",
    "certify_interpolation",
    "certify_polynomials",
    "certify_residual_vibration",
    "certify_samples",
    "certify_speed_zones",
    "interpolated",
    "interpolation_of",
    "refuse_zone_faults",
    "worst_overshoot",
]
