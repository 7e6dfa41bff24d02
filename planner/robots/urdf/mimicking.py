"""The positions of all joints of a URDF that are not joints of the arm: locked, mimicking and default ones."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from planner.robots.checks import MAX_NUMBER
from planner.robots.description import Follower
from planner.robots.findings import Findings, note_held_mimic, shown
from planner.robots.urdf.elements import Mimic, UrdfJoint


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
