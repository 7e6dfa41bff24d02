"""Collects the remarks about a robot description, and says names in them that nobody trusts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from planner.errors import Finding, InvalidRobotModel

NAMES_IN_A_MESSAGE = 10
"""Number of names that a message lists before it says how many more there are."""

LONGEST_SHOWN = 100
"""Number of characters of a client's name that a message shows."""


@dataclass
class Findings:
    """Collects the remarks about one model, so that its author sees all of them at once."""

    items: list[Finding] = field(default_factory=list)

    def error(self, code: str, subject: str | None, message: str) -> None:
        """Record that the model is refused."""
        self.items.append(Finding(code, "error", subject, message))

    def warning(self, code: str, subject: str | None, message: str) -> None:
        """Record that the model is used as it is."""
        self.items.append(Finding(code, "warning", subject, message))

    def info(self, code: str, subject: str | None, message: str) -> None:
        """Add a finding about an omitted or completed value."""
        self.items.append(Finding(code, "info", subject, message))

    def raise_errors(self) -> None:
        """Refuse the model if there is an error among the findings.

        Raises:
            InvalidRobotModel: With all findings, the errors first: an answer may truncate the list.
        """
        errors = [item for item in self.items if item.severity == "error"]
        if errors:
            more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
            others = [item for item in self.items if item.severity != "error"]
            raise InvalidRobotModel(f"the robot model cannot be used: {errors[0].message}{more}", errors + others)


def shown(name: str) -> str:
    """Return a client's name, cut in the middle and escaped for a message: its end tells it from others."""
    cut = name if len(name) <= LONGEST_SHOWN else f"{name[:20]}...{name[23 - LONGEST_SHOWN :]}"
    return cut.encode("unicode_escape").decode()


def listed(names: Iterable[str], quoted: bool = False) -> str:
    """Return the different names, cut to a few."""
    counted = list(dict.fromkeys(names))
    more = f" and {len(counted) - NAMES_IN_A_MESSAGE} more" if len(counted) > NAMES_IN_A_MESSAGE else ""
    few = (shown(name) for name in counted[:NAMES_IN_A_MESSAGE])
    return ", ".join(map(repr, few) if quoted else few) + more


def note_held_mimic(findings: Findings, name: str, leader: str, position: float) -> None:
    """Note that a mimic joint is held, since its leader is: position in rad or m."""
    text = f"{shown(name)} mimics {shown(leader)}, which is held: it is held at {position:g}"
    findings.info("mimic_joint_held", shown(name), text)
