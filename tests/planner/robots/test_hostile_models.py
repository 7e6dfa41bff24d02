"""Descriptions that must be refused with a finding: never a crash, never a model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import InvalidRobotModel
from planner.robots import DHJoint, Robot
from planner.robots.dh import DHModel
from planner.spatial import Pose
from tests.planner.robots.frames import product, rot
from tests.planner.robots.urdfs import LIMIT, chain, inertial, joint, link, robot, two_links

NESTED = "<!DOCTYPE r [" + "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 10)) + "]>"
INCLUDED = '<!DOCTYPE robot [<!ENTITY file SYSTEM "file:///etc/hostname">]>'
OUTSIDE = '<!DOCTYPE robot SYSTEM "http://127.0.0.1:9/robot.dtd">'
HUGE = "1" + "0" * 400
MANY = robot(
    *(link(f"l{i}") for i in range(5001)),
    *(joint(f"j{i}", f"l{i}", f"l{i + 1}", kind="fixed", origin="", axis="", limit="") for i in range(5000)),
)
TREE = (link("a"), link("b"), link("c"))

URDFS: list[tuple[str, str, str]] = [
    # what, code of the finding, document
    ("empty", "not_xml", ""),
    ("words", "not_xml", "not a robot at all"),
    ("unclosed", "not_xml", "<robot><link name='a'>"),
    ("a null character", "not_xml", "<robot>\0</robot>"),
    ("half a surrogate pair", "not_xml", "<robot name='\ud800'/>"),
    ("an undefined entity", "not_xml", "<robot>&boom;</robot>"),
    ("unclosed nesting", "not_xml", "<a>" * 100_000),
    ("deep nesting", "not_a_robot", "<a>" * 100_000 + "</a>" * 100_000),
    ("deep nesting in a robot", "no_links", "<robot>" + "<a>" * 100_000 + "</a>" * 100_000 + "</robot>"),
    ("ten million characters", "document_too_large", "<robot>" + " " * 10_000_000 + "</robot>"),
    ("just too long", "document_too_large", two_links() + " " * 2**20),
    ("a document type", "forbidden_xml", "<!DOCTYPE robot>" + two_links()),
    ("nested entities", "forbidden_xml", NESTED + "<robot>&e9;</robot>"),
    ("a file as an entity", "forbidden_xml", INCLUDED + "<robot>&file;</robot>"),
    ("an outer document type", "forbidden_xml", OUTSIDE + two_links()),
    ("another root", "not_a_robot", "<model><link name='a'/></model>"),
    ("another namespace", "not_a_robot", two_links().replace("<robot", "<robot xmlns='urn:x'", 1)),
    ("macros left in", "unexpanded_elements", two_links("<x:body xmlns:x='http://www.ros.org/wiki/xacro'/>")),
    ("nothing in it", "no_links", "<robot name='r'/>"),
    ("thousands of links", "too_many_links", MANY),
    ("thousands of joints", "too_many_links", robot(link("a"), link("b"), *[joint("j", "a", "b")] * 2000)),
    ("too many joints", "too_many_joints", chain(33)),
    ("one link", "no_joints", robot(link("a"))),
    ("only fixed joints", "no_joints", chain(5, kind="fixed")),
    ("two roots", "several_roots", robot(*TREE, joint("j", "a", "b"))),
    ("a cycle", "cycle", robot(*TREE, joint("1", "a", "b"), joint("2", "b", "c"), joint("3", "c", "a"))),
    ("a cycle beside a tree", "cycle", robot(link("root"), *TREE[:2], joint("1", "a", "b"), joint("2", "b", "a"))),
    ("a joint on itself", "cycle", robot(link("root"), link("a"), joint("1", "a", "a"))),
    ("two parents", "several_parents", robot(*TREE, joint("1", "a", "c"), joint("2", "b", "c"))),
    ("an unknown parent", "unknown_link", robot(link("a"), joint("1", "nowhere", "a"))),
    ("an unknown child", "unknown_link", robot(link("a"), joint("1", "a", "nowhere"))),
    ("no child at all", "unknown_link", two_links().replace('<child link="tip"/>', "")),
    ("two links of a name", "duplicate_name", robot(link("a"), link("b"), link("b"), joint("1", "a", "b"))),
    ("two joints of a name", "duplicate_name", robot(*TREE, joint("1", "a", "b"), joint("1", "b", "c"))),
    ("a link without a name", "invalid_name", two_links()[:-8] + "<link/></robot>"),
    ("a name that is blank", "invalid_name", two_links().replace('"turn"', '" "')),
    ("a name with a space before it", "invalid_name", two_links().replace('"tip"', '" tip"')),
    ("an enormous name", "invalid_name", two_links().replace('"turn"', '"' + "x" * 500_000 + '"')),
    ("a name of control characters", "invalid_name", two_links().replace('"turn"', '"a&#10;b"')),
    ("the name of Pinocchio's base", "reserved_name", two_links().replace('"base"', '"universe"')),
    ("a joint named like it", "reserved_name", two_links().replace('"turn"', '"universe"')),
    ("a floating joint", "unsupported_joint_kind", two_links(kind="floating")),
    ("a planar joint", "unsupported_joint_kind", two_links(kind="planar")),
    ("a kind of joint that is none", "unknown_joint_kind", two_links(kind="spherical")),
    ("a joint without a kind", "unknown_joint_kind", two_links().replace(' type="revolute"', "")),
    ("only a mimic joint", "no_joints", two_links(more='<mimic joint="turn" multiplier="2"/>')),
    ("a zero axis", "zero_axis", two_links(axis='<axis xyz="0 0 0"/>')),
    ("an axis next to zero", "zero_axis", two_links(axis='<axis xyz="1e-300 0 0"/>')),
    ("an axis of two numbers", "wrong_number_count", two_links(axis='<axis xyz="0 1"/>')),
    ("an axis of words", "not_a_number", two_links(axis='<axis xyz="up up up"/>')),
    ("an unexpanded macro", "not_a_number", two_links(origin='<origin xyz="0 0 ${height}"/>')),
    ("digits of another script", "not_a_number", two_links(origin='<origin xyz="0 0 \u0661"/>')),
    ("grouped digits", "not_a_number", two_links(origin='<origin xyz="0 0 1_000"/>')),
    ("a hexadecimal number", "not_a_number", two_links(origin='<origin xyz="0 0 0x10"/>')),
    ("an infinite axis", "non_finite_number", two_links(axis='<axis xyz="inf 0 0"/>')),
    ("an origin of NaN", "non_finite_number", two_links(origin='<origin xyz="nan 0 0"/>')),
    ("a number of 400 digits", "non_finite_number", two_links(origin=f'<origin xyz="{HUGE} 0 0"/>')),
    ("a length of 1e308", "number_out_of_range", two_links(origin='<origin xyz="1e308 0 0"/>')),
    ("an angle of 1e308", "number_out_of_range", two_links(origin='<origin rpy="0 0 1e308"/>')),
    ("a mimic offset of 1e308", "number_out_of_range", two_links(more='<mimic joint="x" offset="1e308"/>')),
    ("lower above upper", "lower_not_below_upper", two_links(limit='<limit lower="1" upper="-1" velocity="1"/>')),
    (
        "the only joint is fixed by its limits",
        "no_joints",
        two_links(limit='<limit lower="1" upper="1" velocity="1"/>'),
    ),
    ("upper forgotten", "lower_not_below_upper", two_links(limit='<limit lower="1" velocity="1"/>')),
    ("both beyond all reason", "lower_not_below_upper", two_links(limit='<limit lower="1e308" upper="1e308"/>')),
    ("a limit of NaN", "non_finite_number", two_links(limit='<limit lower="nan" upper="1" velocity="1"/>')),
    ("an infinite limit", "non_finite_number", two_links(limit='<limit lower="-inf" upper="inf" velocity="1"/>')),
    ("no limit element", "missing_position_limit", two_links(limit="")),
    ("no position limits", "missing_position_limit", two_links(limit='<limit velocity="1" effort="1"/>')),
    ("a slide without limits", "missing_position_limit", two_links(kind="prismatic", limit="")),
    ("a negative speed", "negative_limit", two_links(limit=LIMIT.replace('velocity="2"', 'velocity="-2"'))),
    ("a speed next to nothing", "absurd_limit", two_links(limit=LIMIT.replace('velocity="2"', 'velocity="1e-320"'))),
    ("an effort next to nothing", "absurd_limit", two_links(limit=LIMIT.replace('effort="30"', 'effort="1e-9"'))),
    ("a negative effort", "negative_limit", two_links(limit=LIMIT.replace('effort="30"', 'effort="-30"'))),
    ("a speed of NaN", "non_finite_number", two_links(limit=LIMIT.replace('velocity="2"', 'velocity="nan"'))),
    ("a negative acceleration", "negative_limit", two_links(limit=LIMIT.replace("/>", ' acceleration="-2"/>'))),
    ("a negative deceleration", "negative_limit", two_links(limit=LIMIT.replace("/>", ' deceleration="-2"/>'))),
    ("a jerk of words", "not_a_number", two_links(limit=LIMIT.replace("/>", ' jerk="soft"/>'))),
    ("a soft limit of NaN", "non_finite_number", two_links(more='<safety_controller soft_lower_limit="nan"/>')),
    ("a negative mass", "negative_mass", two_links(inertial(mass="-1"))),
    ("a mass of NaN", "non_finite_number", two_links(inertial(mass="nan"))),
    ("an infinite mass", "non_finite_number", two_links(inertial(mass="inf"))),
    ("a mass of 1e308", "number_out_of_range", two_links(inertial(mass="1e308"))),
    ("a mass of a train", "absurd_mass", two_links(inertial(mass="400000"))),
    ("a mass of words", "not_a_number", two_links(inertial(mass="heavy"))),
    ("a negative moment", "inertia_not_positive_definite", two_links(inertial(moments='ixx="-1" iyy="1" izz="1"'))),
    (
        "moments that cannot be",
        "inertia_not_positive_definite",
        two_links(inertial().replace('ixy="0"', 'ixy="5"')),
    ),
    ("an inertia of NaN", "non_finite_number", two_links(inertial(moments='ixx="nan" iyy="1" izz="1"'))),
    ("an inertia of 1e308", "number_out_of_range", two_links(inertial(moments='ixx="1e308" iyy="1" izz="1"'))),
    ("a center of mass of NaN", "non_finite_number", two_links(inertial(origin='<origin xyz="0 nan 0"/>'))),
    ("a box of NaN", "non_finite_number", two_links('<visual><geometry><box size="nan 1 1"/></geometry></visual>')),
]


@pytest.mark.parametrize(("code", "urdf"), [case[1:] for case in URDFS], ids=[case[0] for case in URDFS])
def test_urdf_is_refused(code: str, urdf: str) -> None:
    with pytest.raises(InvalidRobotModel) as caught:
        Robot.from_urdf(urdf)
    errors = {finding.code for finding in caught.value.findings if finding.severity == "error"}
    assert code in errors
    for finding in caught.value.findings:
        assert len(finding.message) < 1000
        assert finding.message.isprintable()


def test_an_unknown_tip_lists_the_links() -> None:
    with pytest.raises(InvalidRobotModel, match="base, tip") as caught:
        Robot.from_urdf(two_links(), tip_frame="hand")
    assert [finding.code for finding in caught.value.findings] == ["unknown_tip_frame"]


def test_the_base_is_no_tip() -> None:
    with pytest.raises(InvalidRobotModel) as caught:
        Robot.from_urdf(two_links(), tip_frame="base")
    assert "no_joints" in {finding.code for finding in caught.value.findings}


def test_all_errors_are_reported_at_once() -> None:
    wrong = two_links(inertial(mass="-1"), axis='<axis xyz="0 0 0"/>', origin='<origin xyz="nan 0 0"/>')
    with pytest.raises(InvalidRobotModel) as caught:
        Robot.from_urdf(wrong)
    codes = {finding.code for finding in caught.value.findings}
    assert {"negative_mass", "zero_axis", "non_finite_number"} <= codes
    assert "(and 2 more)" in str(caught.value)


def test_errors_come_before_remarks() -> None:
    """A reply lists a limited number of findings: the error of this arm stood behind its 200 remarks."""
    with pytest.raises(InvalidRobotModel) as caught:
        Robot.from_urdf(chain(200))
    assert [finding.code for finding in caught.value.findings[:2]] == ["too_many_joints", "default_limits"]


def test_the_caps_themselves_are_allowed() -> None:
    arm = Robot.from_urdf(chain(32))
    assert arm.dof == 32
    twigs = [link(f"t{i}") for i in range(223)]
    fixed = [joint(f"f{i}", "l0", f"t{i}", kind="fixed", axis="", limit="") for i in range(223)]
    arm = Robot.from_urdf(chain(32).replace("</robot>", "".join([*twigs, *fixed]) + "</robot>"))
    assert arm.dof == 32
    assert len(arm.model.frames) == 1 + 256


GOOD = DHJoint("revolute", a=0.5)
TURNED = Pose(np.zeros(3), np.diag([1.0, 1.0, -1.0]))
DH_TABLES: list[tuple[str, str, DHModel]] = [
    ("no rows", "no_joints", DHModel("standard", ())),
    ("too many rows", "too_many_joints", DHModel("standard", (GOOD,) * 33)),
    ("an unknown convention", "unknown_convention", DHModel("distal", (GOOD,))),  # type: ignore[arg-type]
    ("an unknown kind", "unknown_joint_kind", DHModel("standard", (DHJoint("floating"),))),  # type: ignore[arg-type]
    ("NaN", "non_finite_number", DHModel("standard", (replace(GOOD, alpha=np.nan),))),
    ("infinity", "non_finite_number", DHModel("modified", (replace(GOOD, d=np.inf),))),
    ("an infinite limit", "non_finite_number", DHModel("standard", (replace(GOOD, velocity=np.inf),))),
    ("1e308", "number_out_of_range", DHModel("standard", (replace(GOOD, a=1e308),))),
    ("a mass of NaN", "non_finite_number", DHModel("standard", (replace(GOOD, mass=np.nan),))),
    ("a negative mass", "negative_mass", DHModel("standard", (replace(GOOD, mass=-1.0),))),
    ("an absurd mass", "absurd_mass", DHModel("standard", (replace(GOOD, mass=1e8),))),
    (
        "a negative moment",
        "inertia_not_positive_definite",
        DHModel("standard", (replace(GOOD, mass=1.0, inertia=(1.0, 0.0, 0.0, -1.0, 0.0, 1.0)),)),
    ),
    ("lower above upper", "lower_not_below_upper", DHModel("standard", (replace(GOOD, lower=1.0, upper=0.0),))),
    ("limited on one side", "one_sided_position_limit", DHModel("standard", (replace(GOOD, lower=1.0),))),
    (
        "the upper side beyond all reason",
        "one_sided_position_limit",
        DHModel("standard", (replace(GOOD, lower=0.0, upper=1e12),)),
    ),
    (
        "every joint is fixed by its limits",
        "no_joints",
        DHModel("standard", (replace(GOOD, lower=1.0, upper=1.0),) * 2),
    ),
    ("a negative speed", "negative_limit", DHModel("standard", (replace(GOOD, velocity=-1.0),))),
    ("a negative torque", "negative_limit", DHModel("standard", (replace(GOOD, torque=-1.0),))),
    ("two joints of a name", "duplicate_name", DHModel("standard", (replace(GOOD, name="a"),) * 2)),
    ("a given name that is taken", "duplicate_name", DHModel("standard", (replace(GOOD, name="joint_2"), GOOD))),
    ("an empty name", "invalid_name", DHModel("standard", (replace(GOOD, name=""),))),
    ("a reserved name", "reserved_name", DHModel("standard", (replace(GOOD, name="universe"),))),
    ("a mirrored base", "invalid_pose", DHModel("standard", (GOOD,), base=TURNED)),
    ("a tip that is no rotation", "invalid_pose", DHModel("standard", (GOOD,), tip=Pose(np.zeros(3), np.ones((3, 3))))),
    ("a base of NaN", "invalid_pose", DHModel("standard", (GOOD,), base=Pose(np.full(3, np.nan)))),
    ("a base at 1e308", "number_out_of_range", DHModel("standard", (GOOD,), base=Pose(np.full(3, 1e308)))),
]


@pytest.mark.parametrize(("code", "model"), [case[1:] for case in DH_TABLES], ids=[case[0] for case in DH_TABLES])
def test_dh_table_is_refused(code: str, model: DHModel) -> None:
    with pytest.raises(InvalidRobotModel) as caught:
        Robot.from_dh(model.joints, convention=model.convention, base=model.base, tip=model.tip)
    assert code in {finding.code for finding in caught.value.findings if finding.severity == "error"}


NUMBER = st.one_of(st.floats(), st.sampled_from(["", "x", "1e308", "-0", "1e-320", "nan", "1 2"])).map(str)


LIMIT_NAMES = ("lower", "upper", "velocity", "effort", "acceleration", "deceleration", "jerk")
LIMITS = st.fixed_dictionaries(dict.fromkeys(LIMIT_NAMES[:4], NUMBER), optional=dict.fromkeys(LIMIT_NAMES[4:], NUMBER))
SOFT_LIMITS = st.fixed_dictionaries({}, optional={"soft_lower_limit": NUMBER, "soft_upper_limit": NUMBER})


def attributes(values: dict[str, str]) -> str:
    return " ".join(f'{name}="{value}"' for name, value in values.items())


@given(values=st.lists(NUMBER, min_size=10, max_size=10), limits=LIMITS, soft=SOFT_LIMITS)
def test_any_numbers_give_a_finite_model_or_a_refusal(
    values: list[str], limits: dict[str, str], soft: dict[str, str]
) -> None:
    x, y, z, a, b, c, mass, xx, yy, zz = values
    document = two_links(
        inertial(mass, f'ixx="{xx}" iyy="{yy}" izz="{zz}"'),
        origin=f'<origin xyz="{x} {y} {z}"/>',
        axis=f'<axis xyz="{a} {b} {c}"/>',
        limit=f"<limit {attributes(limits)}/>",
        more=f"<safety_controller {attributes(soft)}/>",
    )
    try:
        arm = Robot.from_urdf(document)
    except InvalidRobotModel as refusal:
        assert any(finding.severity == "error" for finding in refusal.findings)
    else:
        assert np.isfinite(arm.model.inertias[1].toDynamicParameters()).all()
        assert np.isfinite(arm.model.jointPlacements[1].homogeneous).all()
        assert np.isfinite([arm.limit(name) for name in ("velocity", "acceleration", "jerk")]).all()
        assert arm.limit("lower") < arm.limit("upper")


@given(
    moments=st.tuples(*[st.one_of(st.just(0.0), st.floats(-1e-7, 1e-7), st.floats(0.0, 1e6))] * 3),
    angles=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    mass=st.floats(0.0, 1e5),
)
def test_any_inertia_that_is_not_clearly_negative_is_accepted(
    moments: tuple[float, ...], angles: tuple[float, ...], mass: float
) -> None:
    """Pinocchio refuses some of them with an exception of its own, which must never occur."""
    R = product(rot("x", angles[0]), rot("y", angles[1]), rot("z", angles[2]))[:3, :3]
    tensor = R @ np.diag(moments) @ R.T
    row = replace(GOOD, mass=mass, inertia=tuple(tensor[np.triu_indices(3)]))
    arm = Robot.from_dh([row])
    assert arm.mass == pytest.approx(mass)
    assert np.isfinite(arm.model.inertias[1].toDynamicParameters()).all()
