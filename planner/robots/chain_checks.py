"""Checks of an arm as a whole: its reach, and the masses and inertias that its joints carry."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from planner.robots.build import MovingJoint
from planner.robots.checks import MAX_LENGTH
from planner.robots.findings import Findings, shown

LEAST_ARM_REACH = 1e-3
"""m."""
USUAL_RADII_OF_GYRATION = (1e-3, 1.0)
"""m; outside of them, and beyond the reach of the arm, an inertia does not go with its mass."""


def check_chain(chain: Sequence[MovingJoint], tip: str, findings: Findings) -> None:
    """Check the lengths, masses and inertias of an arm."""
    reach = _reach(chain, tip)
    if reach > MAX_LENGTH:
        text = f"stretched out, the arm is {reach:g} m long: are its lengths in metres?"
        findings.warning("suspicious_length", None, text)
    elif reach < LEAST_ARM_REACH:
        findings.warning("no_reach", None, f"no joint moves the origin of {shown(tip)}: all lengths of the arm are 0")
    _check_masses(chain, findings)
    _check_inertias(chain, max(reach, USUAL_RADII_OF_GYRATION[1]), findings)


def _reach(chain: Sequence[MovingJoint], tip: str) -> float:
    """Bound the distance of the tip's origin from the first joint, m, except for slides without limits."""
    lengths = [float(np.linalg.norm(moving.placement.translation)) for moving in chain[1:]]
    lengths += [float(np.linalg.norm(link.placement.translation)) for link in chain[-1].links if link.name == tip]
    for joint in (moving.joint for moving in chain):
        if not joint.is_angle and math.isfinite(joint.upper):
            lengths.append(max(abs(joint.lower), abs(joint.upper)))
        elif not joint.is_angle:
            lengths.append(LEAST_ARM_REACH)
    return sum(lengths)


def _check_masses(chain: Sequence[MovingJoint], findings: Findings) -> None:
    """Say which joints carry no mass."""
    massless = [
        shown(moving.joint.name)
        for moving in chain
        if not any(link.body is not None and link.body.mass > 0.0 for link in moving.links)
    ]
    if len(massless) == len(chain):
        findings.info("no_masses", None, "nothing that moves has a mass: torques are those of a payload alone")
    elif massless:
        listed = ", ".join(massless)
        text = f"nothing has a mass between {listed} and the next joint: is a mass missing there?"
        findings.warning("mass_missing", None, text)


def _check_inertias(chain: Sequence[MovingJoint], largest: float, findings: Findings) -> None:
    """Warn of inertias that do not go with their mass and the size of the arm (`largest`, m)."""
    for link in (link for moving in chain for link in moving.links):
        if link.body is None or link.body.mass == 0.0:
            continue
        moment = float(np.linalg.norm(link.body.inertia, 2))
        radius = math.sqrt(moment) / math.sqrt(link.body.mass)  # their quotient may overflow
        if radius > largest or 0.0 < radius < USUAL_RADII_OF_GYRATION[0]:
            name = shown(link.name)
            text = f"the inertia of {name} is that of its mass at {radius:.3g} m: is it in kg m^2?"
            findings.warning("suspicious_inertia", name, text)
