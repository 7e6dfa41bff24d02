"""Starts a built image as a container engine would, on a read-only root file system, and plans over HTTP.

Usage: check_image.py ROOT CONFIG, as root, in a network namespace of its own: ROOT is the image's mounted file system,
CONFIG its configuration in Docker's form (JSON).
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path
from typing import IO, Any

ADDRESS = "http://127.0.0.1:8000"
READY_TIMEOUT = 60.0  # s
REQUEST = {
    "robot": "ngv_refuelling_arm",
    "waypoints": [
        {"kind": "joint", "position": [0.1, -0.4, 0.2, 0.0, 0.3, 0.0]},
        {"kind": "joint", "position": [0.2, -0.5, 0.3, 0.1, 0.2, 0.1]},
    ],
    "backend": {"kind": "quintic"},
}


def main() -> None:
    """Run every check; the first that fails ends the program with the service's log and a traceback."""
    root, config = sys.argv[1], json.loads(Path(sys.argv[2]).read_text())
    subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
    check_refusal(root, config)
    check_extras(root, config)
    config["Env"].append("PLANNER_ACCESS=open")
    with tempfile.TemporaryFile("w+") as log:
        try:
            check_service(root, config, log)
        except BaseException:
            log.seek(0)
            print("the service's log:", *log.readlines()[:100], sep="\n")
            raise


def check_refusal(root: str, config: dict[str, Any]) -> None:
    """Check that the image's command, as it is, does not let everybody in: it ends, and says what to set."""
    ended = subprocess.run(
        command(root, config, config["Cmd"], []), capture_output=True, text=True, timeout=30, check=False
    )
    assert ended.returncode == 2, f"exit status {ended.returncode} without keys and without PLANNER_ACCESS=open"
    assert "PLANNER_ACCESS" in ended.stderr, ended.stderr
    print("without a database for keys it does not start")


def check_extras(root: str, config: dict[str, Any]) -> None:
    """Check that the image has the packages of the extras that it was built with."""
    for program in (
        ["python", "-c", "import psycopg"],
        ["dask", "scheduler", "--help"],
        ["planner", "worker", "--help"],
    ):
        subprocess.run(command(root, config, program, []), check=True, timeout=60, stdout=subprocess.DEVNULL)
    print("PostgreSQL's driver and Dask are there")


def check_service(root: str, config: dict[str, Any], log: IO[str]) -> None:
    """Start the image's command as process 1, check what it serves and how it stops."""
    read_info, write_info = os.pipe()
    sandbox = ["--as-pid-1", "--unshare-pid", "--info-fd", str(write_info)]
    started = time.monotonic()
    service = subprocess.Popen(
        command(root, config, config["Cmd"], sandbox), stdout=log, stderr=log, pass_fds=[write_info]
    )
    os.close(write_info)
    try:
        with os.fdopen(read_info) as info:
            pid = json.load(info)["child-pid"]
        wait_until_ready(service)
        print(f"ready after {time.monotonic() - started:.1f} s")
        check_process(pid, int(config["User"].split(":")[0]))
        check_plan()
        kind, *health_check = config["Healthcheck"]["Test"]
        assert kind == "CMD", "the health check needs a shell"
        subprocess.run(command(root, config, health_check, []), check=True, timeout=30)
        print("health check: ok")
        os.kill(pid, signal.SIGTERM)
        status = service.wait(timeout=30)
        assert status == 0, f"exit status {status} after SIGTERM"
        print("SIGTERM: exit status 0")
    finally:
        service.kill()


def command(root: str, config: dict[str, Any], arguments: list[str], sandbox: list[str]) -> list[str]:
    """Return the command line that runs arguments in the image: as its user, nothing writable but /dev/shm."""
    user, group = config["User"].split(":")
    environment = [option for entry in config["Env"] for option in ("--setenv", *entry.split("=", 1))]
    return [
        *f"bwrap --ro-bind {root} / --proc /proc --dev /dev --perms 1777 --tmpfs /dev/shm".split(),
        *f"--chdir {config['WorkingDir'] or '/'} --die-with-parent --clearenv".split(),
        *(*environment, *sandbox, "--"),
        *f"setpriv --reuid {user} --regid {group} --clear-groups --no-new-privs".split(),
        *arguments,
    ]


def wait_until_ready(service: subprocess.Popen[bytes]) -> None:
    """Poll /readyz until it answers 200."""
    deadline = time.monotonic() + READY_TIMEOUT
    while True:
        assert service.poll() is None, f"the service ended with status {service.returncode}"
        assert time.monotonic() < deadline, f"not ready after {READY_TIMEOUT} s"
        try:
            urllib.request.urlopen(f"{ADDRESS}/readyz", timeout=5).close()
        except OSError:
            time.sleep(0.1)
        else:
            return


def check_process(pid: int, user: int) -> None:
    """Check that the process runs as the image's user, who is not root, with no capability and a read-only root."""
    assert user > 0, "the image runs as root"
    status = dict(line.split(":\t", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines())
    assert status["Uid"].split() == [str(user)] * 4, f"user ids {status['Uid']}"
    assert int(status["CapEff"], 16) == 0, f"capabilities {status['CapEff']}"
    mounts = [line.split() for line in Path(f"/proc/{pid}/mounts").read_text().splitlines()]
    assert all("ro" in mount[3].split(",") for mount in mounts if mount[1] == "/"), "the root is writable"
    print(f"user {user}, no capabilities, root file system read-only")


def check_plan() -> None:
    """One plan over HTTP comes back certified, from 0 to its duration."""
    request = urllib.request.Request(
        f"{ADDRESS}/v1/trajectories", json.dumps(REQUEST).encode(), {"Content-Type": "application/json"}
    )
    try:
        with urllib.request.urlopen(request, timeout=30) as response:
            plan = json.load(response)
    except urllib.error.HTTPError as error:
        raise AssertionError(error.read().decode()) from error
    assert plan["certificate"]["satisfied"] is True
    assert plan["samples"]["time"][0] == 0.0
    assert plan["samples"]["time"][-1] == plan["duration"] > 0.0
    print(f"planned {plan['duration']:.3f} s on {plan['robot']}")


main()
