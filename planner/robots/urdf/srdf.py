"""Reads groups of joints, their states and disabled collision pairs from SRDF, the semantic companion of a URDF.

Everything else that SRDF has (end effectors, virtual and passive joints) is left alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element

from planner.robots.checks import MAX_NAME_LENGTH, check_names
from planner.robots.collision.pairs import DisabledCollision
from planner.robots.derived.own_limits import is_within
from planner.robots.description import Joint, JointGroup
from planner.robots.findings import Findings, listed, shown
from planner.robots.urdf.elements import UrdfJoint, number_of
from planner.robots.urdf.xml_document import parse_robot_document

MAX_GROUPS = 64
"""Number of joint groups that a document may have."""

MAX_MEMBERS = 1024
"""Number of members that all groups together may have."""

MAX_REASON_LENGTH = 100
"""Number of characters of the reason of a disabled pair that are kept."""

MAX_STATES = 256
"""Number of states of groups that a document may have."""


class GroupState(NamedTuple):
    """A state of a group, as an SRDF has it.

    Attributes:
        name: Name of the state.
        group: Name of the group.
        positions: Positions by the names of joints, rad or m.
    """

    name: str
    group: str
    positions: Mapping[str, float]


def read_srdf(
    srdf: str | None, robot_name: str, root: str, arrivals: Mapping[str, UrdfJoint], findings: Findings
) -> tuple[tuple[JointGroup, ...], tuple[GroupState, ...], tuple[DisabledCollision, ...]]:
    """Return the groups, their states and the disabled pairs.

    A link or joint that the URDF lacks is left out, with a warning. A chain that does not exist is an error, because
    arms move along it.

    Args:
        srdf: The document; None: it has none of them.
        robot_name: The robot's name in the URDF.
        root: The root link of the URDF.
        arrivals: The joint that leads to each other link, parents first.
        findings: The findings, which are added to.

    Raises:
        InvalidRobotModel: The document cannot be read.
    """
    if srdf is None:
        return (), (), ()
    document = parse_robot_document(srdf, "SRDF", findings)
    its_name = document.get("name", robot_name)
    if its_name != robot_name:
        text = f"the SRDF is of a robot called {shown(its_name)}, the URDF of one called {shown(robot_name)}"
        findings.warning("another_robot", None, text)
    groups = _Groups(document, root, arrivals, findings).read()
    return groups, _states(document, findings), _pairs(document, {root, *arrivals}, findings)


def named_positions(
    states: Sequence[GroupState], joints: Sequence[Joint], group: str | None, findings: Findings
) -> dict[str, tuple[float, ...]]:
    """Return the states with positions for all joints of the arm, by name, its own group's first."""
    found: dict[str, tuple[float, ...]] = {}
    for state in sorted(states, key=lambda state: state.group != group):
        subject = shown(state.name)
        if state.name in found:
            findings.info(
                "state_left_out", subject, f"the state {subject} of {shown(state.group)} is not the first one"
            )
        elif missing := [joint.name for joint in joints if joint.name not in state.positions]:
            text = f"the state {subject} of {shown(state.group)} says nothing of {listed(missing)}: it is left out"
            findings.info("state_left_out", subject, text)
        elif not is_within(joints, position := tuple(state.positions[joint.name] for joint in joints)):
            text = f"the state {subject} of {shown(state.group)} is outside of the position limits and left out"
            findings.warning("state_outside_limits", subject, text)
        else:
            found[state.name] = position
    return found


def _states(document: Element, findings: Findings) -> tuple[GroupState, ...]:
    """Return the states of groups; one that is not made of numbers is left out."""
    elements = document.findall("group_state")
    if len(elements) > MAX_STATES:
        findings.error("too_many_states", None, f"the SRDF has more than {MAX_STATES} states of groups")
        return ()
    states = []
    for element in elements:
        name, group = element.get("name", ""), element.get("group", "")
        try:
            values = {joint.get("name", ""): number_of(joint.get("value", "")) for joint in element.findall("joint")}
        except ValueError:
            text = f"the state {shown(name)} of {shown(group)} is not made of numbers and left out"
            findings.warning("state_left_out", shown(name), text)
            continue
        if name and len(name) <= MAX_NAME_LENGTH and name.isprintable():
            states.append(GroupState(name, group, values))
    return tuple(states)


class _Groups:
    """Reads the groups, each once, whatever the order in which they contain each other."""

    def __init__(self, document: Element, root: str, arrivals: Mapping[str, UrdfJoint], findings: Findings) -> None:
        self.elements = document.findall("group")
        self.by_name = {element.get("name", ""): element for element in self.elements}
        self.links = {root, *arrivals}
        # Members that exist, but bring no joint of the URDF with them.
        self.jointless = {root} | {element.get("name", "") for element in document.findall("virtual_joint")}
        self.arrivals, self.findings = arrivals, findings
        self.joints = {joint.name: joint for joint in arrivals.values()}
        self.members: dict[str, set[str]] = {}
        self.open: list[str] = []

    def read(self) -> tuple[JointGroup, ...]:
        """Read all groups, in the order of the document."""
        if len(self.elements) > MAX_GROUPS or sum(map(len, self.elements)) > MAX_MEMBERS:
            text = f"the SRDF has more than {MAX_GROUPS} groups, or more than {MAX_MEMBERS} members in them"
            self.findings.error("too_many_groups", None, text)
            self.findings.raise_errors()
        check_names("group", [element.get("name", "") for element in self.elements], self.findings)
        groups = []
        for name, element in self.by_name.items():
            members = self._members(name)
            # In the order of the tree, from the root to the tips.
            joints = tuple(joint.name for joint in self.arrivals.values() if joint.name in members and joint.is_free)
            if not joints:
                text = f"no joint of the group {shown(name)} moves"
                self.findings.warning("empty_group", shown(name), text)
            is_chain = [member.tag for member in element] == ["chain"]
            groups.append(JointGroup(name, joints, element[0].get("tip_link") if is_chain else None))
        return tuple(groups)

    def _members(self, name: str) -> set[str]:
        """Return the names of the joints of a group, fixed ones included."""
        if name in self.open:
            self.findings.error("group_cycle", shown(name), f"the group {shown(name)} contains itself")
            return set()
        if name in self.members:
            return self.members[name]
        self.open.append(name)
        found: set[str] = set()
        unknown = []
        for member in self.by_name[name]:
            its_name = member.get("name", "")
            match member.tag:
                case "chain":
                    found |= self._chain(shown(name), member)
                case "joint" if its_name in self.joints:
                    found.add(its_name)
                case "link" if its_name in self.arrivals:
                    found.add(self.arrivals[its_name].name)
                case "group" if its_name in self.by_name:
                    found |= self._members(its_name)
                case "joint" | "link" | "group" if its_name not in self.jointless:
                    unknown.append(its_name)
        if unknown:
            text = f"the group {shown(name)} has unknown joints or links, left out: {listed(unknown, quoted=True)}"
            self.findings.warning("unknown_group_member", shown(name), text)
        self.open.pop()
        self.members[name] = found
        return found

    def _chain(self, group: str, element: Element) -> set[str]:
        """Return the names of the joints from the base link to the tip link of a chain."""
        base, tip = element.get("base_link", ""), element.get("tip_link", "")
        found = set()
        link = tip
        while link != base and link in self.arrivals:
            found.add(self.arrivals[link].name)
            link = self.arrivals[link].parent
        if link != base or base not in self.links:
            text = f"the chain of the group {group} does not lead from a link {shown(base)!r} to a link {shown(tip)!r}"
            self.findings.error("broken_chain", group, text)
        return found


def _pairs(document: Element, links: set[str], findings: Findings) -> tuple[DisabledCollision, ...]:
    """Return the pairs of links that need no check against each other, each once, whichever link is named first."""
    pairs: dict[frozenset[str], DisabledCollision] = {}
    unknown = []
    for element in document.findall("disable_collisions"):
        first, second = element.get("link1", ""), element.get("link2", "")
        unknown += [name for name in (first, second) if name not in links]
        if first in links and second in links:
            reason = element.get("reason")
            cut = None if reason is None else reason[:MAX_REASON_LENGTH]
            pairs.setdefault(frozenset((first, second)), DisabledCollision(first, second, cut))
    if unknown:
        text = (
            f"disabled collision pairs name links that are not there and are left out: {listed(unknown, quoted=True)}"
        )
        findings.warning("unknown_collision_link", None, text)
    for pair in [pair for pair in pairs if len(pair) == 1]:
        del pairs[pair]
        (link,) = pair
        findings.warning("collision_with_itself", shown(link), f"a collision pair has {shown(link)} twice")
    return tuple(pairs.values())
