"""Robot models that are accepted although they are strange, each with the finding that says so."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tests.api.requests import dh_joint, dh_robot, urdf_chain, urdf_joint, urdf_robot


@dataclass(frozen=True)
class Odd:
    """An upload that is accepted, and a finding that its answer has."""

    name: str
    body: Any
    finding: str


def _table(*rows: dict[str, Any]) -> dict[str, Any]:
    return dh_robot(id="odd", joints=list(rows))


def _urdf(links: str, **changes: Any) -> dict[str, Any]:
    return urdf_robot(links, **{"id": "odd", **changes})


def _document(document: str, **changes: Any) -> dict[str, Any]:
    return {"kind": "urdf", "id": "odd", "urdf": document, **changes}


def _inertial(mass: str, moment: str) -> str:
    return (
        f'<link name="a"/><link name="b"><inertial><mass value="{mass}"/><inertia ixx="{moment}" iyy="{moment}" '
        f'izz="{moment}" ixy="0" ixz="0" iyz="0"/></inertial></link>' + urdf_joint(0, "a", "b")
    )


def _named(first: str, second: str) -> str:
    return f'<link name="{first}"/><link name="{second}"/>' + urdf_joint(0, first, second)


CHAIN = urdf_chain(3)
PLAIN = f'<robot name="r">{CHAIN}</robot>'
MANY_ATTRIBUTES = "<a" + "".join(f' a{i}=""' for i in range(50_000)) + "/>"
SPHERES = '<link name="l0">' + '<visual><geometry><sphere radius="1"/></geometry></visual>' * 10_000 + "</link>"
ONE_CHAIN = '<robot name="r"><group name="arm"><chain base_link="l0" tip_link="l2"/></group></robot>'

FINGERS = '<link name="f"/><link name="g"/>' + urdf_joint(8, "l3", "f") + urdf_joint(9, "l3", "g")

ODD_ROBOTS = [
    # Denavit-Hartenberg tables.
    Odd("all lengths zero", _table(*[dh_joint(a=0.0)] * 3), "no_reach"),
    Odd("every row zero", _table(*[dh_joint(a=0.0, alpha=0.0)] * 6), "no_reach"),
    Odd("one joint", _table(dh_joint()), "default_limits"),
    Odd("as many rows as there may be", _table(*[dh_joint()] * 32), "default_limits"),
    Odd("slides only", _table(*[dh_joint(kind="prismatic", a=0.0, alpha=1.6)] * 3), "default_limits"),
    Odd("one slide along a line", _table(dh_joint(kind="prismatic", lower=0.0, upper=1.0)), "no_masses"),
    Odd("twists in degrees", _table(dh_joint(alpha=90.0), dh_joint(alpha=-90.0)), "suspicious_angle"),
    Odd("lengths in millimetres", _table(*[dh_joint(a=40.0)] * 3), "suspicious_length"),
    Odd("limits in degrees", _table(dh_joint(lower=-90.0, upper=90.0)), "suspicious_angle"),
    Odd("speeds in degrees", _table(dh_joint(velocity=156.0)), "suspicious_angle"),
    Odd("a speed that no machine has", _table(dh_joint(velocity=1e5)), "absurd_limit"),
    Odd("a slide faster than sound", _table(dh_joint(kind="prismatic", velocity=1e3)), "absurd_limit"),
    Odd("millions of turns", _table(*[dh_joint(lower=-1e6, upper=1e6)] * 3), "suspicious_angle"),
    Odd("a window of the least number there is", _table(dh_joint(lower=0.0, upper=5e-324)), "default_limits"),
    Odd(
        "a continuous joint with limits",
        _table(dh_joint(kind="continuous", lower=0, upper=1)),
        "position_limit_ignored",
    ),
    Odd("enormous accelerations", _table(*[dh_joint(acceleration=1e9, jerk=1e9, torque=1e9)] * 2), "no_masses"),
    Odd("as slow as can be", _table(*[dh_joint(velocity=1e-6, acceleration=1e-6, jerk=1e-6)] * 2), "no_masses"),
    Odd(
        "the mass of an electron", _table(dh_joint(mass=9e-31, inertia=[1e-9, 0, 0, 1e-9, 0, 1e-9])), "suspicious_mass"
    ),
    Odd("the least mass there is", _table(dh_joint(mass=5e-324)), "suspicious_mass"),
    Odd("masses in grams", _table(dh_joint(mass=8400.0)), "suspicious_mass"),
    Odd("one link without a mass", _table(dh_joint(mass=3.0), dh_joint()), "mass_missing"),
    Odd("inertias in kg mm^2", _table(dh_joint(mass=3.0, inertia=[2e4, 0, 0, 2e4, 0, 2e4])), "suspicious_inertia"),
    Odd(
        "an inertia of a flat world",
        _table(dh_joint(mass=1.0, inertia=[1, 0, 0, 1, 0, 5])),
        "inertia_triangle_inequality",
    ),
    Odd("a joint named after a frame", _table(dh_joint(name="flange"), dh_joint(name="link_1")), "default_limits"),
    # What is strange about the text.
    Odd("a byte order mark", _document("\ufeff" + PLAIN), "default_limits"),
    Odd("declared as UTF-16", _document('<?xml version="1.0" encoding="UTF-16"?>' + PLAIN), "default_limits"),
    Odd("declared in no encoding", _document('<?xml version="1.0" encoding="x-none"?>' + PLAIN), "default_limits"),
    Odd("a stylesheet", _document('<?xml-stylesheet href="file:///etc/passwd"?>' + PLAIN), "default_limits"),
    Odd("a comment of half a megabyte", _urdf(f"<!--{'x' * 500_000}-->" + CHAIN), "default_limits"),
    Odd("an attribute of half a megabyte", _urdf(f'<gazebo reference="{"x" * 500_000}"/>' + CHAIN), "default_limits"),
    Odd("50,000 attributes", _urdf(MANY_ATTRIBUTES + CHAIN), "default_limits"),
    Odd("60,000 unknown elements", _urdf("<a/>" * 60_000 + CHAIN), "default_limits"),
    Odd(
        "the namespace of xacro, unused",
        _document(PLAIN.replace("<robot", '<robot xmlns:xacro="http://ros.org/wiki/xacro"')),
        "default_limits",
    ),
    Odd(
        "10,000 spheres",
        _urdf(
            CHAIN.replace(
                '<link name="l0"/>',
                '<link name="l0">' + '<visual><geometry><sphere radius="1"/></geometry></visual>' * 10_000 + "</link>",
            )
        ),
        "too_many_shapes",
    ),
    # Names.
    Odd("names of other scripts", _urdf(_named("основание", "手先😀")), "default_limits"),
    Odd("names that differ in their case", _urdf(_named("Tip", "tip")), "default_limits"),
    Odd("a link named after its joint", _urdf(_named("base", "j0")), "default_limits"),
    Odd("names like paths and markup", _urdf(_named("../../etc/passwd", "&lt;script&gt;&quot;'")), "default_limits"),
    Odd("a link named tool", _urdf(_named("base", "tool")), "default_limits"),
    # Geometry and masses.
    Odd("an axis of a billion", _urdf(CHAIN.replace('xyz="0 1 0"', 'xyz="0 1e9 0"')), "axis_normalised"),
    Odd("an axis of almost nothing", _urdf(CHAIN.replace('xyz="0 1 0"', 'xyz="0 1e-8 1e-8"')), "axis_normalised"),
    Odd(
        "an angle of a billion",
        _urdf(CHAIN.replace('xyz="0 0 0.1"', 'xyz="0 0 0.1" rpy="1e9 0 0"')),
        "suspicious_angle",
    ),
    Odd("links a billion metres long", _urdf(CHAIN.replace('xyz="0 0 0.1"', 'xyz="1e9 0 0"')), "suspicious_length"),
    Odd("links of almost nothing", _urdf(CHAIN.replace('xyz="0 0 0.1"', 'xyz="0 0 1e-320"')), "no_reach"),
    Odd("an inertia of a planet", _urdf(_inertial("1e-3", "1e9")), "suspicious_inertia"),
    Odd("an inertia next to nothing", _urdf(_inertial("5", "1e-300")), "suspicious_inertia"),
    Odd("an inertia of zero", _urdf(_inertial("5", "0")), "inertia_missing"),
    Odd("an inertia without a mass", _urdf(_inertial("0", "1")), "inertia_without_mass"),
    Odd("a mimic joint in the arm", _urdf(CHAIN.replace("<axis", '<mimic joint="j2"/><axis', 1)), "mimic_joint_held"),
    Odd(
        "absurd limits off the arm",
        _urdf(CHAIN + '<link name="x"/>' + urdf_joint(9, "l0", "x", lower="1e308", upper="-1e308")),
        "joint_held",
    ),
    Odd("a speed of zero", _urdf(CHAIN.replace('velocity="1"', 'velocity="0"')), "zero_limit"),
    # SRDF.
    Odd("the tip of the only chain", _urdf(CHAIN, srdf=ONE_CHAIN), "tip_frame_from_srdf"),
    Odd(
        "states of words and strangers",
        _urdf(
            CHAIN,
            srdf='<robot><group_state name="a"><joint name="j0" value="x"/></group_state><group_state/></robot>',
        ),
        "state_left_out",
    ),
    Odd("fingers at the end", _urdf(CHAIN + FINGERS), "several_tips"),
    Odd("an SRDF without anything", _urdf(CHAIN, srdf="<robot/>"), "default_limits"),
    Odd("an SRDF of another robot", _urdf(CHAIN, srdf='<robot name="q"/>'), "another_robot"),
    Odd("a URDF for an SRDF", _urdf(CHAIN, srdf=PLAIN), "default_limits"),
    Odd(
        "a group of strangers",
        _urdf(CHAIN, srdf='<robot><group name="g"><joint name="x"/><link name="y"/></group></robot>'),
        "unknown_group_member",
    ),
    Odd(
        "20,000 pairs of strangers",
        _urdf(CHAIN, srdf="<robot>" + '<disable_collisions link1="x" link2="y"/>' * 20_000 + "</robot>"),
        "unknown_collision_link",
    ),
    Odd(
        "a link and itself",
        _urdf(CHAIN, srdf='<robot><disable_collisions link1="l0" link2="l0"/></robot>'),
        "collision_with_itself",
    ),
]
