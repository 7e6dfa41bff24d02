"""The elements of a URDF document, read one by one without trusting any of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin

from planner.robots.build import Body, joint_motion
from planner.robots.checks import MAX_NUMBER, check_angles, check_body, check_length
from planner.robots.collision.geometry import CollisionElement
from planner.robots.collision.mesh_files import MeshReference
from planner.robots.description import Joint, JointKind
from planner.robots.findings import Findings, shown
from planner.robots.visuals import Colour, VisualElement
from planner.shapes import Box, Capsule, Cylinder, InvalidShape, Shape, Sphere
from planner.spatial import FloatArray, rotation_from_rpy

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


KINDS: dict[str, JointKind] = {"revolute": "revolute", "continuous": "continuous", "prismatic": "prismatic"}
"""The kinds of joints that may be degrees of freedom, by the values of URDF's attribute `type`."""

SHAPES = {"box": {"size": [0.0] * 3}, "cylinder": {"radius": [0.0], "length": [0.0]}, "sphere": {"radius": [0.0]}}
"""The shapes that are kept, with the attributes that give their size."""

SOLIDS: dict[str, Callable[..., Shape]] = {"box": Box, "cylinder": Cylinder, "sphere": Sphere, "capsule": Capsule}
"""The shapes that can collide, by their elements; a capsule is one of URDF 1.2, its length that between the balls."""

SIZES = {**SHAPES, "capsule": SHAPES["cylinder"]}
"""The attributes that give their size."""

MAX_SHAPES = 1000
"""Number of shapes that a document may have, for collisions and to look at each."""

ZERO_AXIS = 1e-9
"""Length of the axis of a joint below which it is zero, without unit."""

LENGTH_ERROR = 1e-3
"""Difference of the length of an axis from 1 above which a finding reports it, without unit."""


class Mimic(NamedTuple):
    """The mimic element of a joint, whose position is multiplier * (position of the leader) + offset, rad or m."""

    leader: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False)
class UrdfJoint:
    """A joint element.

    Attributes:
        name: As written.
        parent: Name of the link that it starts at.
        child: Name of the link that it moves.
        placement: Placement of the child link in the parent link, at zero.
        axis: (3,), unit vector in the child link's frame.
        moving: Kind and limits as written; None: fixed.
        mimic: The joint that it mimics, and how; None: it mimics none.
    """

    name: str
    parent: str
    child: str
    placement: pin.SE3
    axis: FloatArray
    moving: Joint | None
    mimic: Mimic | None

    @property
    def is_free(self) -> bool:
        """Whether it can be a degree of freedom."""
        return self.moving is not None and self.mimic is None

    def placement_at(self, position: float) -> pin.SE3:
        """Return the placement of the child link in the parent link, with the joint at `position`, rad or m."""
        if self.moving is None:
            return self.placement
        return self.placement * joint_motion(self.axis, self.moving.is_angle, position)


def number_of(word: str) -> float:
    """Convert a word to a number; refuse the forms that only Python reads, such as `1_000`.

    Raises:
        ValueError: It is none.
    """
    if "_" in word or not word.isascii():
        raise ValueError
    return float(word)


class UrdfReader:
    """Reader of elements; a fault becomes a finding and a harmless value."""

    def __init__(self, findings: Findings, rotors: Mapping[str, float]) -> None:
        self.findings, self.rotors = findings, rotors
        self.visuals: list[VisualElement] = []
        self.colours: Mapping[str, Colour] = {}
        self.shapes = 0
        self.solids = 0
        self.unread: set[str] = set()

    def numbers(
        self, element: Element | None, attribute: str, default: Sequence[float], subject: str, limit: float = MAX_NUMBER
    ) -> FloatArray:
        """Read as many finite numbers as the default has, none larger than `limit`; the default if there are none."""
        fallback = np.array(default, dtype=float)
        text = None if element is None else element.get(attribute)
        if text is None:
            return fallback
        try:
            values = np.array([number_of(word) for word in text.split()])
        except ValueError:
            self.findings.error("not_a_number", subject, f"{attribute} of {subject} is not made of numbers")
            return fallback
        if values.shape != fallback.shape:
            message = f"{attribute} of {subject} needs {len(fallback)} numbers, has {len(values)}"
            self.findings.error("wrong_number_count", subject, message)
        elif not np.isfinite(values).all():
            self.findings.error("non_finite_number", subject, f"{attribute} of {subject} is not finite")
        elif np.abs(values).max() > limit:
            self.findings.error("number_out_of_range", subject, f"{attribute} of {subject} is beyond {limit:g}")
        else:
            return values
        return fallback

    def number(self, element: Element | None, attribute: str, default: float, subject: str) -> float:
        """Read one finite number of any size."""
        return float(self.numbers(element, attribute, [default], subject, limit=math.inf)[0])

    def origin(self, element: Element | None, subject: str) -> tuple[FloatArray, FloatArray]:
        """Read position (3,) and roll, pitch, yaw (3,) of the origin element inside `element`."""
        origin = None if element is None else element.find("origin")
        position = self.numbers(origin, "xyz", [0.0] * 3, subject)
        check_length(subject, position, self.findings)
        rpy = self.numbers(origin, "rpy", [0.0] * 3, subject)
        check_angles(subject, rpy, self.findings)
        return position, rpy

    def body(self, element: Element) -> Body | None:
        """Return the inertial element of a link."""
        inertial = element.find("inertial")
        if inertial is None:
            return None
        name = shown(element.get("name", ""))
        position, rpy = self.origin(inertial, name)
        mass = self.numbers(inertial.find("mass"), "value", [0.0], name)[0]
        entries = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        tensor = inertial.find("inertia")
        xx, xy, xz, yy, yz, zz = (self.numbers(tensor, entry, [0.0], name)[0] for entry in entries)
        R = rotation_from_rpy(*rpy)
        inertia = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
        return check_body(name, Body(float(mass), position, inertia), self.findings)

    def joint(self, element: Element) -> UrdfJoint:
        """Return a joint element."""
        name = element.get("name", "")
        subject = shown(name)
        position, rpy = self.origin(element, subject)
        placement = pin.SE3(rotation_from_rpy(*rpy), position)
        moving = self.moving_joint(element, name)
        mimic = None
        axis = np.array([1.0, 0.0, 0.0])
        if moving is not None:
            axis = self.axis(element, subject)
            mimic = self.mimic(element.find("mimic"), subject)
        links = (element.find(end) for end in ("parent", "child"))
        parent, child = ("" if link is None else link.get("link", "") for link in links)
        return UrdfJoint(name, parent, child, placement, axis, moving, mimic)

    def mimic(self, element: Element | None, subject: str) -> Mimic | None:
        """Return a mimic element; None: there is none."""
        if element is None:
            return None
        multiplier = float(self.numbers(element, "multiplier", [1.0], subject)[0])
        return Mimic(element.get("joint", ""), multiplier, float(self.numbers(element, "offset", [0.0], subject)[0]))

    def axis(self, element: Element, subject: str) -> FloatArray:
        """Return the joint's axis, of length 1."""
        axis = self.numbers(element.find("axis"), "xyz", [1.0, 0.0, 0.0], subject)
        length = float(np.linalg.norm(axis))
        if length < ZERO_AXIS:
            self.findings.error("zero_axis", subject, f"the axis of {subject} is zero")
            return np.array([1.0, 0.0, 0.0])
        if abs(length - 1.0) > LENGTH_ERROR:
            text = f"the axis of {subject} had length {length:g} and was normalised"
            self.findings.warning("axis_normalised", subject, text)
        # Dividing an exact axis by a rounded length would take away its exactness.
        return axis if length == 1.0 else axis / length

    def moving_joint(self, element: Element, name: str) -> Joint | None:
        """Read the kind and limits of a joint; return None for a fixed joint or a refused one."""
        subject, written = shown(name), element.get("type", "")
        if written in ("floating", "planar"):
            text = f"{subject} is a {written} joint; an arm has revolute, continuous and prismatic ones"
            self.findings.error("unsupported_joint_kind", subject, text)
        elif written not in (*KINDS, "fixed"):
            self.findings.error("unknown_joint_kind", subject, f"{subject} has no joint type that URDF knows")
        if written not in KINDS:
            return None
        limit = element.find("limit")
        # A limit element without bounds has both at 0, says the standard; infinite ones say that they are missing.
        lower, upper = -math.inf, math.inf
        if limit is not None and not (limit.get("lower") is None and limit.get("upper") is None):
            lower, upper = (self.number(limit, side, 0.0, subject) for side in ("lower", "upper"))
        velocity = self.number(limit, "velocity", math.inf, subject)
        effort = math.inf if limit is None else self.number(limit, "effort", 0.0, subject)
        acceleration, jerk = self.acceleration(limit, subject), self.number(limit, "jerk", math.inf, subject)
        joint = Joint(name, KINDS[written], lower, upper, velocity, acceleration, jerk, effort)
        dynamics = element.find("dynamics")
        friction, damping = (self.number(dynamics, value, 0.0, subject) for value in ("friction", "damping"))
        joint = replace(joint, friction=friction, damping=damping, rotor_inertia=self.rotors.get(name, 0.0))
        return self.with_soft_limits(joint, element.find("safety_controller"))

    def acceleration(self, limit: Element | None, subject: str) -> float:
        """Return the acceleration limit of URDF 1.2, infinite where there is none; it holds for braking, too."""
        acceleration, deceleration = (
            self.number(limit, name, math.inf, subject) for name in ("acceleration", "deceleration")
        )
        if not deceleration < acceleration or deceleration == 0.0:
            return acceleration
        text = f"the deceleration limit of {subject}, {deceleration:g}, is its acceleration limit, too"
        self.findings.info("deceleration_limit", subject, text)
        return deceleration

    def with_soft_limits(self, joint: Joint, controller: Element | None) -> Joint:
        """Return the joint within the soft limits of its safety controller, beyond which that does not let it go."""
        subject = shown(joint.name)
        soft_lower = self.number(controller, "soft_lower_limit", -math.inf, subject)
        soft_upper = self.number(controller, "soft_upper_limit", math.inf, subject)
        lower, upper = max(joint.lower, soft_lower), min(joint.upper, soft_upper)
        if joint.kind == "continuous" or (lower, upper) == (joint.lower, joint.upper):
            return joint
        if not lower < upper:
            text = f"the soft limits of {subject} leave it no room and are ignored: {soft_lower:g} to {soft_upper:g}"
            self.findings.warning("soft_limits_ignored", subject, text)
            return joint
        text = f"the position limits of {subject} are the soft ones of its safety controller: {lower:g} to {upper:g}"
        self.findings.info("soft_limits", subject, text)
        return replace(joint, lower=lower, upper=upper)

    def geometry(self, element: Element) -> list[Mapping[str, Any]]:
        """Return the simple visual shapes of a link; its visual meshes are added to `visuals`."""
        name = element.get("name", "")
        shapes: list[Mapping[str, Any]] = []
        for visual, shape in ((v, shape) for v in element.findall("visual") for shape in v.findall("geometry/*")):
            self.shapes += 1
            if self.shapes > MAX_SHAPES or shape.tag not in (*SHAPES, "mesh"):
                continue
            colour = self.colour(visual.find("material"))
            if shape.tag == "mesh":
                self.visual_mesh(visual, shape, name, colour)
                continue
            position, rpy = self.origin(visual, shown(name))
            size = {key: self.numbers(shape, key, none, shown(name)) for key, none in SHAPES[shape.tag].items()}
            if min(value.min() for value in size.values()) <= 0.0:
                text = f"a {shape.tag} of {shown(name)} has no size and is not drawn"
                self.findings.warning("shape_without_size", shown(name), text)
                continue
            plain = {key: value.tolist() if len(value) > 1 else float(value[0]) for key, value in size.items()}
            pose = {"position": position.tolist(), "rpy": rpy.tolist()}
            coloured = {} if colour is None else {"colour": list(colour)}
            shapes.append({"kind": shape.tag, "frame": name, **pose, **plain, **coloured})
        return shapes

    def visual_mesh(self, visual: Element, written: Element, name: str, colour: Colour | None) -> None:
        """Add a visual mesh of a link to `visuals`; a fault in its element is a warning."""
        own = UrdfReader(Findings(), {})
        position, rpy = own.origin(visual, shown(name))
        mesh = own.mesh(written, shown(name))
        errors = [finding for finding in own.findings.items if finding.severity == "error"]
        if errors:
            text = f"a visual mesh of {shown(name)} is not drawn: {errors[0].message}"
            self.findings.warning("visual_mesh_unread", shown(name), text)
        else:
            self.visuals.append(VisualElement(name, pin.SE3(rotation_from_rpy(*rpy), position), mesh, colour))

    def read_colours(self, document: Element) -> None:
        """Read the colours of the materials that the visuals of links name."""
        found = ((one.get("name", ""), self.colour(one)) for one in document.iter("material"))
        self.colours = {name: colour for name, colour in found if colour is not None}

    def colour(self, material: Element | None) -> Colour | None:
        """Return the colour of a material, its own or that of its name; None: it has no valid one."""
        if material is None:
            return None
        own = material.find("color")
        if own is None:
            return self.colours.get(material.get("name", ""))
        try:
            red, green, blue, opacity = map(number_of, own.get("rgba", "").split())
        except ValueError:
            return None
        colour = red, green, blue, opacity
        return colour if all(0.0 <= part <= 1.0 for part in colour) else None

    def collisions(self, element: Element) -> Iterator[CollisionElement]:
        """Yield the shapes of a link that can collide; one that is left out becomes a finding."""
        link = element.get("name", "")
        name = shown(link)
        for collision, written in (
            (c, shape) for c in element.findall("collision") for shape in c.findall("geometry/*")
        ):
            self.solids += 1
            if self.solids > MAX_SHAPES:
                continue
            shape = self.mesh(written, name) if written.tag == "mesh" else self.solid(written, name)
            position, rpy = self.origin(collision, name)
            if written.tag not in (*SOLIDS, "mesh"):
                self.unread.add(link)
            if shape is not None:
                yield CollisionElement(link, pin.SE3(rotation_from_rpy(*rpy), position), shape)

    def mesh(self, element: Element, name: str) -> MeshReference:
        """Return the name and scale of a mesh, whose file is read at the first use of the shapes."""
        x, y, z = self.numbers(element, "scale", [1.0] * 3, name).tolist()
        if x * y * z == 0.0:
            self.findings.error("invalid_shape", name, f"the scale of a mesh of {name} is 0")
        return MeshReference(element.get("filename", ""), (x, y, z))

    def solid(self, element: Element, name: str) -> Shape | None:
        """Return the shape of an element; None: it is left out, or the model is refused."""
        if element.tag not in SOLIDS:
            text = f"URDF has no shape {shown(element.tag)!r}: what can collide of {name} is estimated"
            self.findings.warning("unknown_shape", name, text)
            return None
        size = {key: self.numbers(element, key, none, name) for key, none in SIZES[element.tag].items()}
        numbers = np.concatenate(list(size.values()))
        if numbers.min() == 0.0:
            text = f"a {element.tag} of {name} has no size and cannot collide"
            self.findings.warning("shape_without_size", name, text)
            return None
        try:
            return SOLIDS[element.tag](**{key: np.squeeze(value) for key, value in size.items()})
        except InvalidShape as error:
            self.findings.error("invalid_shape", name, f"a {element.tag} of {name} that can collide: {error}")
            return None

    def report_left_out(self) -> None:
        """Say which visuals were left out."""
        if self.solids > MAX_SHAPES:
            text = f"the model has {self.solids} shapes that can collide, more than {MAX_SHAPES}"
            self.findings.error("too_many_shapes", None, text)
        if self.shapes > MAX_SHAPES:
            text = f"of {self.shapes} shapes only the first {MAX_SHAPES} are drawn"
            self.findings.warning("too_many_shapes", None, text)
