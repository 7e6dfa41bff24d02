"""How many processors this process may use: those it may run on, or fewer by the quota of its container."""

from __future__ import annotations

import math
import os
from contextlib import suppress
from pathlib import Path

CONTROL_GROUPS = Path("/sys/fs/cgroup")
"""Where Linux shows control groups; in a container, that of the container is the topmost one."""

OWN_GROUPS = Path("/proc/self/cgroup")
"""Where Linux tells which control groups this process belongs to."""


def available_processors(groups: Path = CONTROL_GROUPS, own: Path = OWN_GROUPS) -> int:
    """Count the processors; a share of one counts as one.

    Args:
        groups: Where control groups are.
        own: The file that names the groups of this process.
    """
    quotas = [quota for group in _groups(groups, own) if (quota := _quota(group)) is not None]
    return max(1, math.ceil(min([float(len(os.sched_getaffinity(0))), *quotas])))


def _groups(groups: Path, own: Path) -> list[Path]:
    """Find the groups of this process and their parents, each of which may have a quota."""
    found: list[Path] = []
    with suppress(OSError):
        for line in own.read_text(encoding="utf-8").splitlines():
            _, controllers, path = line.split(":", 2)
            if controllers == "" or "cpu" in controllers.split(","):
                root = groups / controllers if controllers else groups
                group = root / path.lstrip("/")
                found += [group, *(parent for parent in group.parents if parent.is_relative_to(root))]
    return found


def _quota(group: Path) -> float | None:
    """Read the processors that a control group may use, of version 2 or 1; None: it has no quota."""
    with suppress(OSError, ValueError):
        quota, period = (group / "cpu.max").read_text(encoding="utf-8").split()
        return None if quota == "max" else int(quota) / int(period)
    with suppress(OSError, ValueError):
        quota, period = ((group / f"cpu.cfs_{name}_us").read_text(encoding="utf-8") for name in ("quota", "period"))
        return None if int(quota) < 0 else int(quota) / int(period)
    return None
