"""Runs a statement in a process that is killed as soon as Python or other code opens a socket."""

from __future__ import annotations

import platform
import subprocess
import sys

from tests.locations import ROOT

SOCKET = {"x86_64": 41, "aarch64": 198}.get(platform.machine())
"""Number of the system call `socket`; None where it is unknown."""

FORBID_SOCKETS = f"""
import ctypes, struct
# A seccomp filter (man 2 seccomp): load the number of the call; kill the process if it is `socket`; else allow.
LOAD, JUMP_IF_EQUAL, RETURN, KILL_PROCESS, ALLOW = 0x20, 0x15, 0x06, 0x80000000, 0x7FFF0000
program = b"".join(
    struct.pack("HBBI", *instruction)
    for instruction in (
        (LOAD, 0, 0, 0), (JUMP_IF_EQUAL, 0, 1, {SOCKET}), (RETURN, 0, 0, KILL_PROCESS), (RETURN, 0, 0, ALLOW)
    )
)
buffer = ctypes.create_string_buffer(program, len(program))
header = struct.pack("HP", 4, ctypes.addressof(buffer))
libc = ctypes.CDLL(None, use_errno=True)
NO_NEW_PRIVILEGES, SECCOMP, FILTER = 38, 22, 2
assert libc.prctl(NO_NEW_PRIVILEGES, 1, 0, 0, 0) == 0
assert libc.prctl(SECCOMP, FILTER, header, 0, 0) == 0, "no filter"
"""


def run_without_sockets(code: str) -> subprocess.CompletedProcess[str]:
    """Run `code` in a fresh interpreter that SIGSYS kills when it opens a socket."""
    return subprocess.run(
        [sys.executable, "-c", FORBID_SOCKETS + code], capture_output=True, text=True, cwd=ROOT, timeout=60, check=False
    )
