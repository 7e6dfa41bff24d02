"""Check the text of the repository: `python -m tests.lint`."""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys

from tests.lint.baseline import BASELINE, compare, count, lowered, read, write
from tests.lint.rules import RULES
from tests.lint.sources import read_sources
from tests.locations import ROOT

NEAR = 4
"""Number of lines around a changed line in which a fault counts as new."""


def changed_lines(file: str) -> set[int]:
    """Return the lines of a file that differ from the branch `main`, with some context; none without git."""
    if shutil.which("git") is None:
        return set()
    command = ["git", "diff", "--unified=0", "main", "--", file]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    hunks = re.findall(r"^@@ .* \+(\d+)(?:,(\d+))? @@", ran.stdout, re.MULTILINE)
    spans = [range(int(first) - NEAR, int(first) + int(lines or 1) + NEAR) for first, lines in hunks]
    return set().union(*spans)


def main() -> int:
    """Print every fault that the baseline does not have, and the number that fell; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tests.lint", description=__doc__)
    parser.add_argument("--lower", action="store_true", help="lower the baseline to the faults that are left")
    parser.add_argument("--start", metavar="RULE", help="take the faults of a new rule into the baseline")
    parser.add_argument("--all", action="store_true", help="print all faults, also those in the baseline")
    arguments = parser.parse_args()
    sources = read_sources()
    found = {name: list(rule(sources)) for name, rule in RULES.items()}
    counts, allowed = count(found), read()
    if arguments.start:
        allowed |= {key: number for key, number in counts.items() if key[1] == arguments.start}
        write(allowed)
    risen, fallen = compare(counts, allowed)
    for file, name in sorted(counts if arguments.all else risen):
        faults = sorted((fault.line, fault.text) for fault in found[name] if fault.file == file)
        changed = set() if arguments.all else changed_lines(file)
        for line, text in [fault for fault in faults if fault[0] in changed] or faults:
            print(f"{file}:{line}: {name}: {text}")
        if (file, name) in risen:
            before = allowed.get((file, name), 0)
            print(f"{file} breaks the rule {name} {len(faults)} times, {before} times before: mend the new ones")
    if arguments.lower:
        write(lowered(counts, allowed))
    elif fallen:
        print(f"{fallen} faults of the baseline are mended: run `python -m tests.lint --lower`")
    print(f"{len(RULES)} rules, {len(sources)} files, {sum(counts.values())} faults ({BASELINE.name})")
    return 1 if risen else 0


if __name__ == "__main__":
    sys.exit(main())
