"""The arm within a tree of links: its end, its joints, and the positions of all other joints."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from planner.robots.checks import MAX_NUMBER
from planner.robots.description import Follower, JointGroup
from planner.robots.findings import Findings, listed, note_held_mimic, shown
from planner.robots.urdf.elements import Mimic, UrdfJoint

TIP_WORDS = ("tcp", "tool0", "end_effector")
"""Parts of the names by which the links at the tips of arms are usually called."""

FINGER_WORDS = ("finger", "gripper", "jaw", "thumb", "knuckle")
"""Parts of the names by which the joints of grippers are usually called."""


@dataclass(frozen=True)
class PlanningGroup:
    """The requested part of a robot, by at most one of `group`, `joints` and `base_frame`.

    Attributes:
        tip_frame: Link at its end; None: the end of the group, or of the arm.
        base_frame: Link whose following joints move; None: the root.
        group: Name of the SRDF's group whose joints move.
        joints: Names of the joints that move.
        locked: Positions by the names of the fixed joints, rad or m.
    """

    tip_frame: str | None = None
    base_frame: str | None = None
    group: str | None = None
    joints: Sequence[str] | None = None
    locked: Mapping[str, float] = field(default_factory=dict)


class ArmFinder:
    """Finds the arm in a tree: `arrivals` has the joint that leads to each link, parents first."""

    def __init__(
        self, root: str, arrivals: Mapping[str, UrdfJoint], groups: Sequence[JointGroup], findings: Findings
    ) -> None:
        self.root, self.arrivals, self.groups, self.findings = root, arrivals, groups, findings
        self.joints = {joint.name: joint for joint in arrivals.values()}
        self.children: dict[str, list[str]] = {}
        for link, joint in arrivals.items():
            self.children.setdefault(joint.parent, []).append(link)

    def find(self, requested: PlanningGroup) -> tuple[str, list[UrdfJoint]]:
        """Return the link at the end of the arm, and its degrees of freedom, starting at the root.

        Raises:
            InvalidRobotModel: The requested part does not exist, or is not a chain.
        """
        self._check_locked(requested.locked)
        members, tip = self._members(requested)
        self.findings.raise_errors()
        tip = tip or (self._usual_tip() if members is None else self._behind(members))
        if tip != self.root and tip not in self.arrivals:
            links = ", ".join(map(shown, (self.root, *self.arrivals)))
            self.findings.error(
                "unknown_tip_frame", shown(tip), f"there is no link {shown(tip)}; the links are {links}"
            )
            self.findings.raise_errors()
        path = self.path(tip)
        if requested.base_frame is not None:
            members = self._behind_base(requested.base_frame, tip)
        if members is not None and (off := members - {joint.name for joint in path}):
            text = f"no chain to {shown(tip)} has all joints of the group: it leaves out {listed(sorted(off))}"
            self.findings.error("group_is_no_chain", requested.group and shown(requested.group), text)
            self.findings.raise_errors()
        moving = [joint for joint in path if members is None or joint.name in members]
        return tip, [joint for joint in moving if joint.name not in requested.locked]

    def path(self, tip: str) -> list[UrdfJoint]:
        """Return the joints between the root and a link that may be degrees of freedom, in that order."""
        return [self.arrivals[link] for link in self._way(tip) if self.arrivals[link].is_free]

    def _check_locked(self, locked: Mapping[str, float]) -> None:
        for name, position in locked.items():
            joint = self.joints.get(name)
            if joint is None or joint.moving is None or not joint.is_free:
                self.findings.error(
                    "unknown_joint", shown(name), f"there is no joint {shown(name)} that could be locked"
                )
            elif not joint.moving.lower <= position <= joint.moving.upper or abs(position) == float("inf"):
                text = f"{shown(name)} cannot be held at {position:g}, outside of its position limits"
                self.findings.error("outside_position_limits", shown(name), text)

    def _members(self, requested: PlanningGroup) -> tuple[set[str] | None, str | None]:
        """Return the names of the requested joints, if given, and the tip, if known."""
        if sum(way is not None for way in (requested.group, requested.joints, requested.base_frame)) > 1:
            text = "a planning group is named by a group of the SRDF, by joints or by its base frame: by one of these"
            self.findings.error("several_planning_groups", None, text)
        if requested.group is not None:
            for group in self.groups:
                if group.name == requested.group:
                    return set(group.joints), requested.tip_frame or group.tip_frame
            names = listed(group.name for group in self.groups) or "none"
            text = f"the SRDF has no group {shown(requested.group)}; it has {names}"
            self.findings.error("unknown_group", shown(requested.group), text)
        elif requested.joints is not None:
            for name in requested.joints:
                if name not in self.joints or not self.joints[name].is_free:
                    text = f"there is no joint {shown(name)} that could move by itself"
                    self.findings.error("unknown_joint", shown(name), text)
            return set(requested.joints), requested.tip_frame
        elif requested.tip_frame is None and requested.base_frame is None:
            return None, self._tip_of_only_chain()
        return None, requested.tip_frame

    def _tip_of_only_chain(self) -> str | None:
        """Return the end of the one group that is a chain; None: there is none, or several."""
        tips = [(group.name, group.tip_frame) for group in self.groups if group.tip_frame is not None]
        if len(tips) != 1:
            return None
        ((name, tip),) = tips
        text = f"the tip frame is that of the SRDF's only chain, {shown(name)}: {shown(tip)}"
        self.findings.info("tip_frame_from_srdf", shown(name), text)
        return tip

    def _behind_base(self, base: str, tip: str) -> set[str]:
        """Return the names of the joints from a link to the tip."""
        link, found = tip, set()
        while link != base and link in self.arrivals:
            if self.arrivals[link].is_free:
                found.add(self.arrivals[link].name)
            link = self.arrivals[link].parent
        if link != base:
            text = f"the link {shown(base)!r} is not on the way from the root to {shown(tip)}"
            self.findings.error("unknown_base_frame", shown(base), text)
            self.findings.raise_errors()
        return found

    def _behind(self, members: Collection[str]) -> str:
        """Return the last link behind the last of some joints that moves with it."""
        last = max(
            (link for link, joint in self.arrivals.items() if joint.name in members), key=self._depth, default=""
        )
        return self._last_fixed(last or self.root)

    def _last_fixed(self, link: str) -> str:
        """Return the last link fixed to a link, or that link; prefer links with a tip's name."""
        fixed = [link]
        for each in fixed:
            fixed += [child for child in self.children.get(each, ()) if self.arrivals[child].moving is None]
        named = [each for each in fixed if any(word in each for word in TIP_WORDS)]
        return max(named or fixed, key=self._depth)

    def _depth(self, link: str) -> tuple[int, int]:
        """Return the degrees of freedom, and the joints, on the way to a link."""
        way = self._way(link)
        return sum(self.arrivals[each].is_free for each in way), len(way)

    def _usual_tip(self) -> str:
        """Return the end of the arm where nobody says which: of the longest chain, but for the fingers behind it.

        Fingers are called so, or they begin where several branches move and no more degrees of freedom follow than lie
        before.
        """
        deepest = max((self.root, *self.arrivals), key=self._depth)
        moving = [link for link in self._way(deepest) if self.arrivals[link].is_free]
        names = {link: self.arrivals[link].name.lower() for link in moving}
        named = [link for link in moving if not any(word in names[link] for word in FINGER_WORDS)]
        tip = link = (named or moving or [deepest])[-1]
        while link in self.arrivals:
            branch, link = link, self.arrivals[link].parent
            before, after = self._depth(link)[0], self._depth(tip)[0] - self._depth(link)[0]
            others = [child for child in self.children[link] if child != branch]
            if before >= after > 0 and any(self._moves_something(child) for child in others):
                tip = link
        tip = self._last_fixed(tip)
        self._warn_of_other_tips(tip)
        return tip

    def _way(self, link: str) -> list[str]:
        """Return the links from behind the root to a link."""
        way = []
        while link in self.arrivals:
            way.append(link)
            link = self.arrivals[link].parent
        return way[::-1]

    def _moves_something(self, link: str) -> bool:
        """Tell whether a link, or anything behind it, moves relative to its parent."""
        waiting = [link]
        while waiting:
            link = waiting.pop()
            if self.arrivals[link].moving is not None:
                return True
            waiting += self.children.get(link, ())
        return False

    def _warn_of_other_tips(self, tip: str) -> None:
        """Name the other ends that the arm could have."""
        own = [joint.name for joint in self.path(tip)]
        others = {}
        for link in self.arrivals:
            names = [joint.name for joint in self.path(link)]
            is_short = len(names) < len(own) and names == own[: len(names)]
            if link != tip and link not in self.children and not is_short:
                others[link] = len(names)
        if others:
            groups = listed(group.name for group in self.groups)
            better = f"a tip frame, joints, or a group ({groups})" if groups else "a tip frame, or joints"
            ends = listed(sorted(others, key=lambda link: -others[link]))
            text = f"the arm is taken to end at {shown(tip)}, behind {len(own)} joints; other ends are {ends}"
            self.findings.warning("several_tips", None, f"{text}: ask for {better}")


class WholeConfiguration:
    """The position of every joint off the arm, and the mimic joints that follow a joint of the arm."""

    def __init__(self, arrivals: Mapping[str, UrdfJoint], arm: Collection[str], findings: Findings) -> None:
        """Take the joint that leads to each link, parents first, and the names of the arm's joints."""
        self.arrivals, self.arm, self.findings = arrivals, arm, findings
        self.joints = {joint.name: joint for joint in arrivals.values()}
        self.mimics = {name: self._resolved(joint.mimic) for name, joint in self.joints.items() if joint.mimic}

    def positions(self, locked: Mapping[str, float], on_the_way: Collection[str]) -> dict[str, float]:
        """Return the positions, rad or m, of joints that could move but are no joints of the arm.

        Args:
            locked: The requested positions of some of them.
            on_the_way: Names of the joints between the root and the tip.
        """
        held = {
            joint.name: locked[joint.name] if joint.name in locked else self._default(joint, on_the_way)
            for joint in self.joints.values()
            if joint.is_free and joint.name not in self.arm
        }
        return held | {name: self._mimicking(name, held) for name in self.mimics}

    def followers(self) -> Iterator[Follower]:
        """Yield the mimic joints whose leader is a joint of the arm, parents first."""
        for link, joint in self.arrivals.items():
            mimic = self.mimics.get(joint.name)
            if mimic is not None and joint.moving is not None and mimic.leader in self.arm:
                behind = {link}
                for other, arrival in self.arrivals.items():
                    if arrival.parent in behind:
                        behind.add(other)
                yield Follower(
                    joint.name,
                    mimic.leader,
                    mimic.multiplier,
                    mimic.offset,
                    link,
                    joint.axis,
                    joint.moving.is_angle,
                    frozenset(behind),
                )

    def _resolved(self, mimic: Mimic) -> Mimic | None:
        """Return the mimic with the leader at the end of its chain; None: the chain never ends."""
        seen: set[str] = set()
        while mimic.leader not in seen:
            leader = self.joints.get(mimic.leader)
            if leader is None or leader.moving is None:
                return None
            if leader.mimic is None:
                return mimic
            seen.add(leader.name)
            offset = mimic.multiplier * leader.mimic.offset + mimic.offset
            mimic = Mimic(leader.mimic.leader, mimic.multiplier * leader.mimic.multiplier, offset)
        return None

    def _mimicking(self, name: str, held: Mapping[str, float]) -> float:
        """Return the position of a mimic joint; the position of a leader that moves counts as 0."""
        subject, mimic = shown(name), self.mimics[name]
        if mimic is None:
            written = self.joints[name].mimic
            position = 0.0 if written is None else written.offset
            text = f"{subject} mimics no joint that could move: it is held at {position:g}"
            self.findings.warning("mimic_joint_held", subject, text)
            return position
        position = mimic.multiplier * held.get(mimic.leader, 0.0) + mimic.offset
        if not (abs(position) <= MAX_NUMBER and abs(mimic.multiplier) <= MAX_NUMBER):
            text = f"the position of {subject}, which mimics {shown(mimic.leader)}, is beyond {MAX_NUMBER:g}"
            self.findings.error("number_out_of_range", subject, text)
        elif mimic.leader in held:
            note_held_mimic(self.findings, name, mimic.leader, position)
        else:
            text = f"{subject} mimics {shown(mimic.leader)}, which moves: it is held at {position:g} nonetheless"
            self.findings.warning("mimic_joint_held", subject, text)
        return position

    def _default(self, joint: UrdfJoint, on_the_way: Collection[str]) -> float:
        """Return 0 or the limit nearest to it."""
        subject = shown(joint.name)
        position = 0.0 if joint.moving is None else min(max(0.0, joint.moving.lower), joint.moving.upper)
        if abs(position) > MAX_NUMBER:  # its limits are nonsense, but it is none of the arm's joints
            position = 0.0
        if joint.name in on_the_way:
            text = f"{subject} moves the arm but is none of its joints: it is held at {position:g}"
            self.findings.warning("joint_held_on_the_way", subject, text)
        else:
            text = f"{subject} is not on the way to the tip: it is held at {position:g}"
            self.findings.info("joint_held", subject, text)
        return position
