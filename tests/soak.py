"""`python -m tests.soak`: the random tests at the size for a release, with a report of the cases.

Takes about two hours on two cores, of which 50,000 random requests over all fields take one. `--size large` is what CI
runs.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys

from tests.locations import ROOT
from tests.sizes import LARGER, SIZES


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.soak", description=__doc__)
    parser.add_argument("--size", choices=sorted(SIZES), default="soak")
    parser.add_argument("tests", nargs="*", default=["tests"], help="files or folders of tests")
    arguments = parser.parse_args()
    print(f"{arguments.size}: {SIZES[arguments.size]._asdict()}", flush=True)
    command = [sys.executable, "-m", "pytest", "-n", "logical", "-m", LARGER, "--durations=15", *arguments.tests]
    return subprocess.run(command, cwd=ROOT, env={**os.environ, "TEST_SIZE": arguments.size}, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
