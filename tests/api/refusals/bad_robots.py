"""The part of the table of bad requests that is about robot models."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tests.api.requests import dh_joint, dh_robot, urdf_chain, urdf_joint, urdf_robot


@dataclass(frozen=True)
class Bad:
    """A bad request; `pointer`, `finding` None: there is none to expect."""

    name: str
    path: str
    body: Any
    code: str
    pointer: str | None = None
    finding: str | None = None


ROBOTS = "/v1/robots"
INVALID, MODEL = "invalid_request", "invalid_robot_model"
ENTITIES = '<!DOCTYPE r [<!ENTITY a "aaaaaaaa"><!ENTITY b "&a;&a;&a;&a;"><!ENTITY c "&b;&b;&b;&b;">]>'
EXTERNAL = '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]>'


def _table(name: str, finding: str, *rows: dict[str, Any], **changes: Any) -> Bad:
    return Bad(name, ROBOTS, dh_robot(joints=list(rows), **changes), MODEL, finding=finding)


def _document(name: str, finding: str, document: str, **changes: Any) -> Bad:
    return Bad(name, ROBOTS, {"kind": "urdf", "id": "uploaded", "urdf": document, **changes}, MODEL, finding=finding)


def _chain(name: str, finding: str, old: str, new: str) -> Bad:
    """Return a valid chain with every occurrence of a text replaced."""
    return _document(name, finding, PLAIN.replace(old, new))


def _derived(
    name: str,
    code: str,
    pointer: str | None = None,
    finding: str | None = None,
    base: str = "kuka_kr16_2",
    id: str = "uploaded",
    **changes: Any,
) -> Bad:
    return Bad(name, ROBOTS, {"kind": "derived", "id": id, "from": base, **changes}, code, pointer, finding)


def _srdf(name: str, finding: str, content: str) -> Bad:
    return _document(name, finding, PLAIN, srdf=f'<robot name="r">{content}</robot>')


WINDOW = {"lower": 1.0, "upper": -1.0}
CHAIN = urdf_chain(3)
PLAIN = f'<robot name="r">{CHAIN}</robot>'
ORIGIN = 'xyz="0 0 0.1"'
XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
BROKEN_CHAINS = '<chain base_link="x" tip_link="end"/>' * 1000
LONG_CHAIN = urdf_chain(30) + '<link name="end"/>' + urdf_joint(99, "l30", "end")

BAD_ROBOTS = [
    # Denavit-Hartenberg tables.
    Bad("unknown convention", ROBOTS, dh_robot(convention="hayati"), INVALID, "/convention"),
    Bad("no rows", ROBOTS, dh_robot(joints=[]), INVALID, "/joints"),
    Bad("hundreds of rows", ROBOTS, dh_robot(joints=[dh_joint()] * 200), INVALID, "/joints"),
    Bad(
        "row without alpha",
        ROBOTS,
        dh_robot(joints=[{"kind": "revolute", "theta": 0, "d": 0, "a": 1}]),
        INVALID,
        "/joints/0/alpha",
    ),
    Bad("helical joint", ROBOTS, dh_robot(joints=[dh_joint(kind="helical")]), INVALID, "/joints/0/kind"),
    Bad("negative velocity", ROBOTS, dh_robot(joints=[dh_joint(velocity=-1)]), INVALID, "/joints/0/velocity"),
    Bad("id with a slash", ROBOTS, dh_robot(id="a/b"), INVALID, "/id"),
    Bad("lower above upper", ROBOTS, dh_robot(joints=[dh_joint(lower=1.0, upper=-1.0)]), MODEL),
    Bad("id of the catalogue", ROBOTS, dh_robot(id="three_dof_arm"), "catalogue_robot"),
    # URDF documents.
    Bad("not xml", ROBOTS, {"kind": "urdf", "id": "uploaded", "urdf": "robot"}, MODEL),
    Bad("empty urdf", ROBOTS, {"kind": "urdf", "id": "uploaded", "urdf": ""}, INVALID, "/urdf"),
    Bad("another root", ROBOTS, {"kind": "urdf", "id": "uploaded", "urdf": "<svg/>"}, MODEL),
    Bad("no links", ROBOTS, urdf_robot(""), MODEL),
    Bad("thousands of links", ROBOTS, urdf_robot(urdf_chain(3000)), MODEL),
    Bad(
        "doctype with nested entities",
        ROBOTS,
        {"kind": "urdf", "id": "uploaded", "urdf": ENTITIES + '<robot name="&c;"><link name="a"/></robot>'},
        MODEL,
    ),
    Bad(
        "external entity",
        ROBOTS,
        {"kind": "urdf", "id": "uploaded", "urdf": EXTERNAL + '<robot name="r"><link name="&x;"/></robot>'},
        MODEL,
    ),
    Bad("deeply nested elements", ROBOTS, urdf_robot("<a>" * 50_000 + "</a>" * 50_000), MODEL),
    Bad(
        "cycle",
        ROBOTS,
        urdf_robot('<link name="a"/><link name="b"/>' + urdf_joint(0, "a", "b") + urdf_joint(1, "b", "a")),
        MODEL,
    ),
    Bad(
        "two roots",
        ROBOTS,
        urdf_robot('<link name="a"/><link name="b"/><link name="c"/>' + urdf_joint(0, "a", "b")),
        MODEL,
    ),
    Bad("link that is not there", ROBOTS, urdf_robot('<link name="a"/>' + urdf_joint(0, "a", "b")), MODEL),
    Bad(
        "negative mass",
        ROBOTS,
        urdf_robot(
            '<link name="a"/><link name="b"><inertial><mass value="-1"/>'
            '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>' + urdf_joint(0, "a", "b")
        ),
        MODEL,
    ),
    Bad(
        "mass that is not a number",
        ROBOTS,
        urdf_robot(
            '<link name="a"/><link name="b"><inertial><mass value="nan"/>'
            '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>' + urdf_joint(0, "a", "b")
        ),
        MODEL,
    ),
    Bad("zero axis", ROBOTS, urdf_robot(urdf_chain(1).replace('xyz="0 1 0"', 'xyz="0 0 0"')), MODEL),
    Bad(
        "limits the wrong way round",
        ROBOTS,
        urdf_robot('<link name="a"/><link name="b"/>' + urdf_joint(0, "a", "b", lower=1, upper=-1)),
        MODEL,
    ),
    Bad("tip that is not there", ROBOTS, urdf_robot(urdf_chain(2), tip_frame="nowhere"), MODEL),
    # Text that is no URDF.
    _document(
        "macros of xacro left in", "unexpanded_elements", PLAIN.replace("<link", f"<xacro:arm {XACRO}/><link", 1)
    ),
    _document("a macro deep inside", "unexpanded_elements", PLAIN.replace("<limit", f"<xacro:x {XACRO}/><limit", 1)),
    _document("a prefix that is not bound", "not_xml", PLAIN.replace("<link", "<xacro:arm/><link", 1)),
    _document(
        "a file to include",
        "unexpanded_elements",
        PLAIN.replace(
            "<link", '<i:include xmlns:i="http://www.w3.org/2001/XInclude" href="file:///etc/passwd"/><link', 1
        ),
    ),
    _document(
        "links of a namespace", "no_links", f'<robot xmlns:u="urn:u">{CHAIN.replace("<link", "<u:link")}</robot>'
    ),
    _document("two byte order marks", "not_xml", "\ufeff\ufeff" + PLAIN),
    _document("UTF-16 read as something else", "not_xml", PLAIN.encode("utf-16").decode("latin-1")),
    _document("a null character", "not_xml", PLAIN.replace('"r"', '"\0"')),
    _document("a reference to a null character", "not_xml", PLAIN.replace('"r"', '"&#0;"')),
    _document("two documents", "not_xml", PLAIN + PLAIN),
    _document("SDF", "not_a_robot", '<sdf version="1.7"><model name="r"/></sdf>'),
    _document("an attribute twice", "not_xml", '<robot><link name="a" name="b"/></robot>'),
    _document(
        "a parameter entity", "forbidden_xml", '<!DOCTYPE r [<!ENTITY % x SYSTEM "http://127.0.0.1:9/">%x;]>' + PLAIN
    ),
    _document("one long entity", "forbidden_xml", f'<!DOCTYPE r [<!ENTITY a "{"a" * 50_000}">]>' + PLAIN),
    _document("a name of a megabyte", "document_too_large", PLAIN.replace('"r"', f'"{"r" * 2**20}"')),
    Bad("half a surrogate pair", ROBOTS, b'{"kind": "urdf", "id": "a", "urdf": "\\ud800"}', INVALID),
    Bad("bytes that are no UTF-8", ROBOTS, b'{"kind": "urdf", "id": "a", "urdf": "\xff\xfe"}', INVALID),
    # Numbers that other programs read differently, or not at all.
    _chain("a hexadecimal number", "not_a_number", ORIGIN, 'xyz="0 0 0x10"'),
    _chain("a decimal comma", "not_a_number", ORIGIN, 'xyz="0 0 0,1"'),
    _chain("commas between numbers", "not_a_number", ORIGIN, 'xyz="0,0,0.1"'),
    _chain("digits of another script", "not_a_number", ORIGIN, 'xyz="0 0 \u0661"'),
    _chain("grouped digits", "not_a_number", ORIGIN, 'xyz="0 0 1_000"'),
    _chain("a typographic minus", "not_a_number", ORIGIN, 'xyz="0 0 \u22121"'),
    _chain("a fraction", "not_a_number", ORIGIN, 'rpy="0 0 pi/2"'),
    _chain("a substitution", "not_a_number", ORIGIN, 'xyz="0 0 $(arg height)"'),
    _chain("no numbers at all", "wrong_number_count", ORIGIN, 'xyz=""'),
    _chain("100,000 numbers", "wrong_number_count", ORIGIN, f'xyz="{"0 " * 100_000}"'),
    _chain("a number of 300,000 digits", "non_finite_number", ORIGIN, f'xyz="0 0 {"1" * 300_000}"'),
    _chain("a limit without a number", "wrong_number_count", 'velocity="1"', 'velocity=""'),
    _chain("a limit of infinity", "non_finite_number", 'velocity="1"', 'velocity="infinity"'),
    _chain("the least speed there is", "absurd_limit", 'velocity="1"', 'velocity="5e-324"'),
    _chain("a torque next to nothing", "absurd_limit", 'effort="10"', 'effort="1e-300"'),
    # Trees that are none.
    _chain("planar joints", "unsupported_joint_kind", "revolute", "planar"),
    _chain("floating joints", "unsupported_joint_kind", "revolute", "floating"),
    _chain("kinds in capitals", "unknown_joint_kind", "revolute", "Revolute"),
    _chain("only mimic joints", "no_joints", "<axis", '<mimic joint="j0"/><axis'),
    _chain("a link of two parents", "several_parents", 'child link="l3"', 'child link="l2"'),
    _chain("a joint from a link to itself", "cycle", 'parent link="l0"', 'parent link="l1"'),
    _chain("a name that is blank", "invalid_name", '"l3"', '" "'),
    _chain("a name with a space behind it", "invalid_name", '"l3"', '"l3 "'),
    _document("two hundred joints", "too_many_joints", f"<robot>{urdf_chain(200)}</robot>"),
    _document("a joint as the tip", "unknown_tip_frame", PLAIN, tip_frame="j1"),
    _document("the root as the tip", "no_joints", PLAIN, tip_frame="l0"),
    # Denavit-Hartenberg tables.
    _table("one row too many", "too_many_joints", *[dh_joint()] * 33),
    _table("two rows of a name", "duplicate_name", dh_joint(name="a"), dh_joint(name="a")),
    _table("a row named after the base", "reserved_name", dh_joint(name="universe")),
    _table("one limit without the other", "one_sided_position_limit", dh_joint(upper=1.0)),
    _table("a window of no width for the only joint", "no_joints", dh_joint(lower=0.0, upper=-0.0)),
    _table("a window that ends before it begins", "lower_not_below_upper", dh_joint(lower=0.1, upper=-0.1)),
    _table("a speed of nothing", "absurd_limit", dh_joint(velocity=5e-324)),
    _table("a jerk of nothing", "absurd_limit", dh_joint(jerk=1e-9)),
    _table("a train for a link", "absurd_mass", dh_joint(mass=4e5)),
    _table("a negative moment", "inertia_not_positive_definite", dh_joint(mass=1, inertia=[1, 0, 0, -1, 0, 1])),
    _table("products above the moments", "inertia_not_positive_definite", dh_joint(mass=1, inertia=[1, 9, 0, 1, 0, 1])),
    Bad("an angle in words", ROBOTS, dh_robot(joints=[dh_joint(alpha="pi/2")]), INVALID, "/joints/0/alpha"),
    Bad("a length that is true", ROBOTS, dh_robot(joints=[dh_joint(a=True)]), INVALID, "/joints/0/a"),
    Bad("a speed of zero", ROBOTS, dh_robot(joints=[dh_joint(velocity=0)]), INVALID, "/joints/0/velocity"),
    Bad("an inertia of five", ROBOTS, dh_robot(joints=[dh_joint(inertia=[1] * 5)]), INVALID, "/joints/0/inertia"),
    Bad("an SRDF for a table", ROBOTS, dh_robot(srdf="<robot/>"), INVALID, "/srdf"),
    # Robots made from others.
    _derived("a robot from nothing", "unknown_robot", base="nothing"),
    _derived("a robot from no name", INVALID, "/from", base="a b"),
    _derived("the robot of a catalogue", "catalogue_robot", id="ur5e"),
    _derived("a joint that is not there", MODEL, finding="unknown_joint", limits={"hand": {}}),
    _derived("a limit above the data sheet", MODEL, finding="wider_limit", limits={"joint_a1": {"velocity": 9.0}}),
    _derived("a limit of no name", INVALID, "/limits/joint_a1/speed", limits={"joint_a1": {"speed": 1.0}}),
    _derived("a limit of zero", INVALID, "/limits/joint_a1/velocity", limits={"joint_a1": {"velocity": 0}}),
    _derived("a speed of all but nothing", MODEL, finding="absurd_limit", limits={"joint_a1": {"velocity": 1e-8}}),
    _derived("a window turned round", MODEL, finding="lower_not_below_upper", limits={"joint_a1": WINDOW}),
    _derived("a joint locked out of reach", MODEL, finding="outside_position_limits", locked={"joint_a2": 2.0}),
    _derived("every joint locked", MODEL, finding="no_joints", locked={f"joint_a{k}": 0.0 for k in range(1, 7)}),
    _derived("a mounting without axes", MODEL, finding="invalid_pose", mounting={"position": [0.0, 0.0, 1.0]}),
    _derived("a home of two", MODEL, finding="wrong_number_count", named_positions={"home": [0.0, 0.0]}),
    _derived("a home out of reach", MODEL, finding="outside_position_limits", named_positions={"home": [9.0] * 6}),
    _derived("a group that is not there", MODEL, finding="unknown_group", group="arm"),
    # Planning groups.
    _document("a group without an SRDF", "unknown_group", PLAIN, group="arm"),
    _document("a joint that cannot be there", "unknown_joint", PLAIN, joints=["j9"]),
    _document("a base beside the arm", "unknown_base_frame", PLAIN, base_frame="l9"),
    _document("two ways to name a group", "several_planning_groups", PLAIN, base_frame="l1", joints=["j1"]),
    _document("a joint locked beyond its limit", "outside_position_limits", PLAIN, locked={"j0": 2.0}),
    _document("all joints locked", "no_joints", PLAIN, locked={"j0": 0.0, "j1": 0.0, "j2": 0.0}),
    Bad("no joints at all", ROBOTS, urdf_robot(CHAIN, joints=[]), INVALID, "/joints"),
    # SRDF.
    _srdf("thousands of states", "too_many_states", '<group_state name="s" group="g"/>' * 10_000),
    Bad("an empty SRDF", ROBOTS, urdf_robot(CHAIN, srdf=""), INVALID, "/srdf"),
    _document("an SRDF that is not closed", "not_xml", PLAIN, srdf="<robot>"),
    _document("an SRDF with entities", "forbidden_xml", PLAIN, srdf=ENTITIES + "<robot>&c;</robot>"),
    _document("an SRDF with a file", "forbidden_xml", PLAIN, srdf=EXTERNAL + "<robot>&x;</robot>"),
    _document("an SRDF of another root", "not_a_robot", PLAIN, srdf="<semantics/>"),
    _document("an SRDF of two megabytes", "document_too_large", PLAIN, srdf="<robot>" + " " * 2**20 + "</robot>"),
    _srdf("a chain of strangers", "broken_chain", '<group name="g"><chain base_link="x" tip_link="y"/></group>'),
    _srdf("a chain the wrong way", "broken_chain", '<group name="g"><chain base_link="l3" tip_link="l0"/></group>'),
    _srdf("a chain without ends", "broken_chain", '<group name="g"><chain/></group>'),
    _srdf("a group of itself", "group_cycle", '<group name="g"><group name="g"/></group>'),
    _srdf(
        "groups in a circle",
        "group_cycle",
        '<group name="g"><group name="h"/></group><group name="h"><group name="g"/></group>',
    ),
    _srdf("two groups of a name", "duplicate_name", '<group name="g"><joint name="j0"/></group>' * 2),
    _srdf("a group without a name", "invalid_name", '<group><joint name="j0"/></group>'),
    _srdf("thousands of groups", "too_many_groups", '<group name="g"/>' * 20_000),
    _srdf("thousands of members", "too_many_groups", f'<group name="g">{"<joint/>" * 20_000}</group>'),
    _document(
        "thousands of broken chains",
        "broken_chain",
        f"<robot>{LONG_CHAIN}</robot>",
        srdf=f'<robot><group name="g">{BROKEN_CHAINS}</group></robot>',
    ),
]
