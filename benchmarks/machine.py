"""Where the figures were taken."""

from __future__ import annotations

import os
import platform
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

BUSY = 0.5
"""Load average above which other programs count as running."""


def machine() -> dict[str, Any]:
    """Return processor, cores, Python, and the load of other programs; call it before measuring."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)),
        "python": platform.python_version(),
        "load_average_before": os.getloadavg()[0],
    }


def print_machine(console: Console, machine: dict[str, Any]) -> None:
    """Print where figures were taken."""
    console.print(f"\n{machine['processor']}, {machine['cores']} cores, Python {machine['python']}")
    if machine["load_average_before"] > BUSY:
        load = machine["load_average_before"]
        busy = f"the machine was busy (load average {load:.1f}), so these figures are worse than its best"
        console.print(busy, style="yellow")


def _processor() -> str:
    models = [line for line in Path("/proc/cpuinfo").read_text().splitlines() if line.startswith("model name")]
    return models[0].partition(": ")[2] if models else platform.machine()
