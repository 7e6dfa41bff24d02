"""Rotor inertias in the transmissions of a URDF document, as seen from the joints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from xml.etree.ElementTree import Element

ROTOR = ("rotor_inertia", "rotorInertia")
"""Elements with the inertia of a rotor about its axis, kg m^2 (Drake's, in any namespace, and another spelling)."""

RATIO = ("gear_ratio", "mechanicalReduction")
"""Elements with the gear ratio, from the actuator to the joint."""


def rotor_inertias(document: Element) -> Mapping[str, float]:
    """Return the rotor inertia by the names of joints, times the square of the gear ratio.

    Only simple transmissions count, which have one joint and one actuator. A number that cannot be read is NaN.
    """
    found: dict[str, float] = {}
    for transmission in document.findall("transmission"):
        joints, actuators = transmission.findall("joint"), transmission.findall("actuator")
        if len(joints) != 1 or len(actuators) != 1:
            continue
        inertia, ratio = _number(transmission, ROTOR), _number(transmission, RATIO)
        if inertia is not None:
            reduction = 1.0 if ratio is None else ratio
            found[joints[0].get("name", "")] = inertia * reduction * reduction  # a power would overflow with an error
    return found


def _number(transmission: Element, names: tuple[str, ...]) -> float | None:
    """Return the number in the first element with one of some names; None: there is none."""
    elements = {element.tag.rpartition("}")[2]: element for element in reversed(list(transmission.iter()))}
    for name in names:
        if name in elements:
            text = elements[name].get("value") or elements[name].text or ""
            try:
                return float(text)
            except ValueError:
                return math.nan
    return None
