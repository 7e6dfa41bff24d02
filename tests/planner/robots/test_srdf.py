"""Groups and disabled pairs of SRDF, by the rules of its documentation."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import Finding, InvalidRobotModel
from planner.robots import Robot
from planner.robots.collision.pairs import DisabledCollision
from planner.robots.description import JointGroup
from tests.planner.robots.urdfs import joint, link, robot

FIXED = {"kind": "fixed", "axis": "", "limit": ""}
ARM = robot(
    *(link(name) for name in ("base", "shoulder", "elbow", "flange", "palm", "thumb", "finger")),
    joint("lift", "base", "shoulder"),
    joint("bend", "shoulder", "elbow"),
    joint("plate", "elbow", "flange", **FIXED),
    joint("mount", "flange", "palm", **FIXED),
    joint("grip", "palm", "thumb"),
    joint("follow", "palm", "finger", more='<mimic joint="grip"/>'),
)


def read(srdf: str, **options: str) -> tuple[Robot, tuple[Finding, ...]]:
    arm = Robot.from_urdf(ARM, srdf=f'<robot name="test">{srdf}</robot>', **options)
    return arm, arm.findings


def codes(findings: tuple[Finding, ...], severity: str) -> set[str]:
    return {finding.code for finding in findings if finding.severity == severity}


def group(name: str, *members: str) -> str:
    return f'<group name="{name}">{"".join(members)}</group>'


def chain(base: str, tip: str) -> str:
    return f'<chain base_link="{base}" tip_link="{tip}"/>'


@pytest.mark.parametrize(
    ("members", "joints"),
    [
        (chain("base", "flange"), ("lift", "bend")),
        (chain("shoulder", "thumb"), ("bend", "grip")),
        (chain("palm", "palm"), ()),
        ('<joint name="bend"/><joint name="lift"/>', ("lift", "bend")),
        ('<joint name="plate"/><joint name="grip"/><joint name="follow"/>', ("grip",)),
        ('<link name="elbow"/><link name="finger"/>', ("bend",)),
        ('<link name="base"/><joint name="lift"/>', ("lift",)),
        (chain("base", "shoulder") + '<joint name="grip"/>', ("lift", "grip")),
    ],
)
def test_a_group_has_the_moving_joints_of_its_members(members: str, joints: tuple[str, ...]) -> None:
    arm, findings = read(group("g", members), tip_frame="thumb")
    tip = {chain("base", "flange"): "flange", chain("shoulder", "thumb"): "thumb", chain("palm", "palm"): "palm"}
    assert arm.groups == (JointGroup("g", joints, tip.get(members)),)
    assert codes(findings, "warning") - {"mimic_joint_held"} == (set() if joints else {"empty_group"})


def test_groups_contain_groups_in_any_order() -> None:
    everything = group("all", '<group name="both"/>', '<group name="hand"/>')
    both = group("both", '<group name="arm"/>', '<group name="hand"/>')
    arm, _ = read(everything + group("hand", '<joint name="grip"/>') + both + group("arm", chain("base", "flange")))
    assert {g.name: g.joints for g in arm.groups} == {
        "all": ("lift", "bend", "grip"),
        "hand": ("grip",),
        "both": ("lift", "bend", "grip"),
        "arm": ("lift", "bend"),
    }


def test_the_tip_of_the_only_chain_is_the_tip_frame() -> None:
    hand, arm = group("hand", '<joint name="grip"/>'), group("arm", chain("base", "elbow"))
    with_chain, findings = read(hand + arm)
    assert (with_chain.tip_frame, with_chain.joint_names) == ("elbow", ("lift", "bend"))
    (said,) = [finding for finding in findings if finding.code == "tip_frame_from_srdf"]
    assert (said.severity, said.subject) == ("info", "arm")
    assert "elbow" in said.message


@pytest.mark.parametrize(
    ("srdf", "options", "tip"),
    [
        (group("arm", chain("base", "elbow")), {"tip_frame": "palm"}, "palm"),
        (group("arm", chain("base", "elbow")) + group("hand", chain("palm", "thumb")), {}, "palm"),
        (group("arm", chain("base", "elbow"), '<joint name="grip"/>'), {}, "palm"),
        ("", {}, "palm"),
    ],
    ids=["the upload says otherwise", "two chains", "a chain and more", "no group"],
)
def test_when_an_srdf_does_not_choose_the_tip_frame(srdf: str, options: dict[str, str], tip: str) -> None:
    arm, findings = read(srdf, **options)
    assert arm.tip_frame == tip
    assert "tip_frame_from_srdf" not in {finding.code for finding in findings}


def test_a_disabled_pair_is_kept_once_whichever_link_comes_first() -> None:
    pairs = [("base", "shoulder", "Adjacent"), ("shoulder", "base", "Never"), ("palm", "thumb", "x" * 500)]
    elements = "".join(f'<disable_collisions link1="{a}" link2="{b}" reason="{why}"/>' for a, b, why in pairs)
    arm, findings = read(elements + '<disable_collisions link1="elbow" link2="thumb"/>', tip_frame="thumb")
    assert arm.disabled_collisions == (
        DisabledCollision("base", "shoulder", "Adjacent"),
        DisabledCollision("palm", "thumb", "x" * 100),
        DisabledCollision("elbow", "thumb", None),
    )
    assert codes(findings, "warning") == {"mimic_joint_held"}


def test_what_is_not_there_is_left_out_and_said_so() -> None:
    strangers = '<joint name="lift"/><joint name="nobody"/><link name="nothing"/><group name="none"/>'
    pairs = (
        '<disable_collisions link1="base" link2="gone"/><disable_collisions link1="base"/>'
        '<disable_collisions link1="base" link2="base"/>'
    )
    arm, findings = read(group("g", strangers) + pairs)
    assert arm.groups == (JointGroup("g", ("lift",), None),)
    assert arm.disabled_collisions == ()
    messages = {finding.code: finding.message for finding in findings if finding.severity == "warning"}
    assert "'nobody', 'nothing', 'none'" in messages["unknown_group_member"]
    assert "'gone', ''" in messages["unknown_collision_link"]
    assert "collision_with_itself" in messages


def test_virtual_joints_and_what_else_srdf_has_are_no_strangers() -> None:
    virtual = '<virtual_joint name="to_world" type="fixed" parent_frame="world" child_link="base"/>'
    state = '<group_state name="home" group="g"><joint name="lift" value="0"/></group_state>'
    hand = '<end_effector name="e" parent_link="palm" group="g"/><passive_joint name="grip"/>'
    members = group("g", '<joint name="to_world"/><joint name="lift"/>')
    arm, findings = read(virtual + members + state + hand, tip_frame="thumb")
    assert arm.groups == (JointGroup("g", ("lift",), None),)
    assert codes(findings, "warning") == {"mimic_joint_held"}


def test_an_srdf_of_another_robot_is_remarked_upon() -> None:
    for name, expected in (("other", {"another_robot"}), ("test", set())):
        findings = Robot.from_urdf(ARM, srdf=f'<robot name="{name}"/>', tip_frame="thumb").findings
        assert codes(findings, "warning") - {"mimic_joint_held"} == expected
    findings = Robot.from_urdf(ARM, srdf="<robot/>", tip_frame="thumb").findings
    assert codes(findings, "warning") == {"mimic_joint_held"}


def test_a_message_lists_few_of_many_strangers() -> None:
    many = "".join(f'<disable_collisions link1="base" link2="{"x" * 60}{i}"/>' for i in range(5000))
    arm, findings = read(many)
    (said,) = [finding for finding in findings if finding.code == "unknown_collision_link"]
    assert said.message.endswith("more")
    assert len(said.message) < 1000
    assert arm.disabled_collisions == ()


HOSTILE = [
    ("a chain that ends nowhere", "broken_chain", group("g", chain("base", "nowhere"))),
    ("a chain that begins nowhere", "broken_chain", group("g", chain("nowhere", "flange"))),
    ("a chain from nowhere to nowhere", "broken_chain", group("g", chain("nowhere", "nowhere"))),
    ("a chain the wrong way", "broken_chain", group("g", chain("flange", "base"))),
    ("a chain between branches", "broken_chain", group("g", chain("thumb", "finger"))),
    ("a group of itself", "group_cycle", group("g", '<group name="g"/>')),
    ("groups in a circle", "group_cycle", group("g", '<group name="h"/>') + group("h", '<group name="g"/>')),
    ("two groups of a name", "duplicate_name", group("g") + group("g")),
    ("a group without a name", "invalid_name", "<group/>"),
    ("too many groups", "too_many_groups", "".join(group(f"g{i}") for i in range(65))),
    ("too many members", "too_many_groups", group("g", '<link name="base"/>' * 1025)),
    ("macros left in", "unexpanded_elements", '<x:arm xmlns:x="http://ros.org/wiki/xacro"/>'),
    ("nothing that XML is", "not_xml", "<group"),
    ("an undefined entity", "not_xml", "&boom;"),
]


@pytest.mark.parametrize(("code", "srdf"), [case[1:] for case in HOSTILE], ids=[case[0] for case in HOSTILE])
def test_an_srdf_that_contradicts_itself_or_the_urdf_is_refused(code: str, srdf: str) -> None:
    with pytest.raises(InvalidRobotModel) as caught:
        read(srdf)
    assert code in codes(caught.value.findings, "error")
    assert all(len(finding.message) < 1000 for finding in caught.value.findings)


NAMES = st.sampled_from(
    ["base", "shoulder", "elbow", "flange", "palm", "thumb", "lift", "bend", "plate", "grip", "g0", "?"]
)
MEMBERS = st.one_of(
    st.builds(chain, NAMES, NAMES),
    st.builds('<{} name="{}"/>'.format, st.sampled_from(["link", "joint", "group"]), NAMES),
)
GROUPS = st.lists(st.lists(MEMBERS, max_size=3), max_size=3)


@given(groups=GROUPS, pairs=st.lists(st.tuples(NAMES, NAMES), max_size=6))
def test_whatever_is_kept_belongs_to_the_robot(groups: list[list[str]], pairs: list[tuple[str, str]]) -> None:
    disabled = "".join(f'<disable_collisions link1="{a}" link2="{b}"/>' for a, b in pairs)
    document = "".join(group(f"g{i}", *members) for i, members in enumerate(groups)) + disabled
    try:
        arm, _ = read(document, tip_frame="thumb")
    except InvalidRobotModel as refusal:
        assert codes(refusal.findings, "error") <= {"broken_chain", "group_cycle"}
        return
    links = {frame.name for frame in arm.model.frames}
    order = ["lift", "bend", "grip"]
    assert [g.name for g in arm.groups] == [f"g{i}" for i in range(len(groups))]
    for kept in arm.groups:
        assert list(kept.joints) == [name for name in order if name in kept.joints]
        assert kept.tip_frame is None or kept.tip_frame in links
    requested = {frozenset(pair) for pair in pairs if set(pair) <= links and pair[0] != pair[1]}
    assert {frozenset((pair.link_1, pair.link_2)) for pair in arm.disabled_collisions} == requested
    assert len(arm.disabled_collisions) == len(requested)
