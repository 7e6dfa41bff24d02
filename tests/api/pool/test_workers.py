"""Deadlines, deaths, overload and shutdown, on services whose workers may be killed."""

from __future__ import annotations

import json
import math
import signal
import socket
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import httpx
import numpy as np
import psutil
import pytest
from pydantic import ValidationError

from api.base.settings import Settings
from api.pool.messages import Caps, Reply, Task
from api.work.execution import execute, wants_memory
from api.work.tasks.context import TASKS
from planner.errors import UnreachableWaypoint
from tests.api.conftest import wait_until
from tests.api.requests import dh_joint, dh_robot, joint, plan_request

if TYPE_CHECKING:
    from collections.abc import Callable

    from api.work.tasks.context import TaskContext
    from tests.api.conftest import RunningService

PLAN, ROBOTS = "/v1/trajectories", "/v1/robots"
FORWARD, INVERSE = "/v1/kinematics/forward", "/v1/kinematics/inverse"
PATIENT_REQUEST = plan_request(deadline=60.0)
"""A request that waits for a worker to be started, however busy the machine is."""

WARM_WORKER_MIB = 150
"""Memory of a worker of its own that has served other tests, MiB: about 20 when it starts; 220 are shared by all."""


def slow_request(deadline: float = 10.0, poses: int = 1000) -> dict[str, Any]:
    """Return a request of about a millisecond a pose: the search abandons each only after every start failed."""
    unreachable = [{"position": [3.0 + 0.001 * i, 0.0, 0.0], "orientation": None} for i in range(poses)]
    return {"robot": "ngv_refuelling_arm", "poses": unreachable, "deadline": deadline}


def stop_workers(service: RunningService) -> None:
    """Stop the workers, so that the next requests last until their deadlines on any machine."""
    for worker in service.workers():
        worker.suspend()


def test_a_deadline_kills_the_work_and_the_next_request_is_served(one_worker: RunningService) -> None:
    before = {worker.pid for worker in one_worker.workers()}

    stop_workers(one_worker)
    answer = one_worker.post(INVERSE, slow_request(deadline=0.5))

    assert (answer.status_code, answer.json()["code"]) == (504, "deadline_exceeded")
    assert one_worker.post(PLAN, PATIENT_REQUEST).status_code == 200
    assert not before & {worker.pid for worker in one_worker.workers()}
    one_worker.wait_ready()


@pytest.mark.large_only
def test_what_waits_too_long_for_its_deadline_is_refused_at_once(one_worker: RunningService) -> None:
    stop_workers(one_worker)
    with ThreadPoolExecutor() as threads:
        slow = threads.submit(one_worker.post, INVERSE, slow_request(deadline=4.0))
        threads.submit(one_worker.post, INVERSE, slow_request(deadline=4.0))
        wait_until(lambda: 'planner_queue_jobs{lane="requests"} 1.0' in one_worker.client.get("/metrics").text)
        refused = one_worker.post(PLAN, plan_request(deadline=0.2))
        assert (refused.status_code, refused.json()["code"]) == (503, "overloaded")
        assert int(refused.headers["Retry-After"]) > 0
        assert not slow.done()
        assert slow.result().status_code == 504
    assert one_worker.post(PLAN, PATIENT_REQUEST).status_code == 200


def test_the_work_of_a_killed_worker_is_repeated_once(one_worker: RunningService) -> None:
    with ThreadPoolExecutor() as threads:
        repeated = threads.submit(one_worker.post, INVERSE, slow_request(deadline=60.0, poses=400))
        wait_until(lambda: one_worker.busy_workers() == 1)
        one_worker.workers()[0].kill()
        assert repeated.result().status_code == 200


@pytest.mark.large_only
def test_the_process_that_workers_are_forked_from_may_die(one_worker: RunningService) -> None:
    with ThreadPoolExecutor() as threads:
        repeated = threads.submit(one_worker.post, INVERSE, slow_request(deadline=60.0))
        wait_until(lambda: one_worker.busy_workers() == 1)
        one_worker.workers()[0].parent().kill()
        assert repeated.result().status_code == 200
    one_worker.wait_ready()
    assert len(one_worker.workers()) == 1


def test_the_work_of_a_client_that_hangs_up_is_given_up(one_worker: RunningService) -> None:
    """It went on for 22 s."""
    before = {worker.pid for worker in one_worker.workers()}
    with suppress(httpx.ReadTimeout):
        one_worker.post(INVERSE, slow_request(deadline=60.0), timeout=0.3)
    assert one_worker.post(PLAN, PATIENT_REQUEST).status_code == 200
    assert not before & {worker.pid for worker in one_worker.workers()}
    assert "client_disconnected" in {line.get("failure") for line in one_worker.logged()}


def test_workers_leave_the_signals_of_the_process_group_to_the_server(two_workers: RunningService) -> None:
    before = {worker.pid for worker in two_workers.workers()}
    for worker in two_workers.workers():
        worker.terminate()
        worker.send_signal(signal.SIGINT)
    assert two_workers.post(PLAN, PATIENT_REQUEST).status_code == 200
    assert {worker.pid for worker in two_workers.workers()} == before


def test_idle_workers_that_die_are_replaced(two_workers: RunningService) -> None:
    """A request assigned to an ended worker, before the pool noticed, stopped the supervision of its place for good."""
    for victims in (1, 2, 2, 1, 2):
        killed = two_workers.workers()[:victims]
        for worker in killed:
            worker.kill()
        psutil.wait_procs(killed, 10.0)
        assert two_workers.post(PLAN, PATIENT_REQUEST).status_code == 200
        two_workers.wait_ready()
        wait_until(lambda: len(two_workers.workers()) == 2)


def test_workers_that_die_leave_no_open_files_behind(one_worker: RunningService) -> None:
    server = psutil.Process(one_worker.process.pid)
    one_worker.post(PLAN, PATIENT_REQUEST)
    before = server.num_fds()
    for _ in range(2):
        (worker,) = one_worker.workers()
        worker.kill()
        psutil.wait_procs([worker], 10.0)
        assert one_worker.post(PLAN, PATIENT_REQUEST).status_code == 200
    assert server.num_fds() == before


def test_stopped_workers_do_not_stop_the_service(two_workers: RunningService) -> None:
    stopped = two_workers.workers()
    for worker in stopped:
        worker.suspend()
    answer = two_workers.post(PLAN, plan_request(deadline=0.3))
    assert (answer.status_code, answer.json()["code"]) == (504, "deadline_exceeded")
    assert two_workers.client.get("/livez").status_code == 200
    for worker in stopped:
        with suppress(psutil.NoSuchProcess):  # the one that had the task was killed
            worker.resume()
    assert two_workers.post(PLAN, PATIENT_REQUEST).status_code == 200


@pytest.mark.large_only
def test_a_full_queue_turns_away(one_worker: RunningService) -> None:
    """One request runs, some wait if their deadlines permit, and all others are refused at once."""
    stop_workers(one_worker)
    with ThreadPoolExecutor(10) as threads:
        answers = list(threads.map(lambda _: one_worker.post(INVERSE, slow_request(deadline=2.0)), range(10)))
    refused = [answer for answer in answers if answer.status_code == 503]
    assert len(refused) >= 6
    assert {answer.status_code for answer in answers} == {503, 504}
    for answer in refused:
        assert answer.json()["code"] == "overloaded"
        assert int(answer.headers["Retry-After"]) > 0
    assert one_worker.post(PLAN, PATIENT_REQUEST).status_code == 200


@pytest.mark.large_only
def test_sigterm_drains(start_service: Callable[..., RunningService]) -> None:
    """The signal reaches the process group, as from a terminal: plans are finished, unread bodies are hurried."""
    service = start_service(workers=1)
    workers = service.workers()
    stop_workers(service)
    with ThreadPoolExecutor() as threads, unfinished_body(service) as client:
        slow = threads.submit(service.post, INVERSE, slow_request(deadline=4.0))
        wait_until(lambda: service.busy_workers() == 1)
        for process in (*workers, service.process):
            process.send_signal(signal.SIGTERM)
        wait_until(lambda: refuses_connections(service.url))
        assert not slow.done()
        # The request in flight is worked on until its own end: here its deadline.
        assert slow.result().status_code == 504
        assert b"overloaded" in client.recv(65536)
    assert service.process.wait(10.0) == 0
    wait_until(lambda: not any(worker.is_running() for worker in workers))


def unfinished_body(service: RunningService) -> socket.socket:
    """Return a client that has sent the first byte of a body."""
    url = httpx.URL(service.url)
    client = socket.create_connection((url.host, url.port or 80), 30.0)
    head = b"POST /v1/trajectories HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    client.sendall(head + b"Content-Length: 100\r\n\r\n{")
    return client


def refuses_connections(url: str) -> bool:
    """Tell whether the service refuses a connection; an accepted and reset connection does not count."""
    try:
        httpx.get(f"{url}/livez", trust_env=False)
    except httpx.ConnectError:
        return True
    except httpx.TransportError:
        return False
    return False


@pytest.mark.large_only
def test_workers_are_recycled(start_service: Callable[..., RunningService]) -> None:
    service = start_service(workers=1, worker_max_tasks=3)
    pids = set()
    for _ in range(4):
        assert service.post(PLAN, PATIENT_REQUEST, headers={"Cache-Control": "no-cache"}).status_code == 200
        pids |= {worker.pid for worker in service.workers()}
    assert len(pids) == 2


def test_a_worker_that_met_its_memory_cap_is_replaced(one_worker: RunningService) -> None:
    """Inside casadi it would keep failing, while `/readyz` says that it is ready."""
    before = {worker.pid for worker in one_worker.workers()}
    # A million rows, whose answer takes more than the cap allows.
    request = plan_request(sample_period=1e-6, include=["jerk", "tcp_pose"], deadline=60.0)
    answer = one_worker.post(PLAN, request)
    assert (answer.status_code, answer.json()["code"]) == (422, "memory_exceeded")
    for backend in ("quintic", "auto"):
        assert one_worker.post(PLAN, PATIENT_REQUEST | {"backend": {"kind": backend}}).status_code == 200
    one_worker.wait_ready()
    (worker,) = one_worker.workers()
    assert worker.pid not in before
    assert worker.memory_info().rss < 384 * 2**20


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (MemoryError(), "memory_exceeded"),
        (RuntimeError("Error in Function::call: std::bad_alloc"), "memory_exceeded"),
        (SystemError("error return without exception set"), "internal_error"),
        (ZeroDivisionError(), "internal_error"),
        (UnreachableWaypoint("too far"), "unreachable_waypoint"),
    ],
)
def test_a_worker_is_unfit_after_errors_that_nobody_foresaw(
    monkeypatch: pytest.MonkeyPatch, error: Exception, code: str
) -> None:
    def fail(_: TaskContext) -> Reply:
        raise error

    monkeypatch.setitem(TASKS, "plan_trajectory", fail)
    reply = execute(Task("plan_trajectory", PLAN, 0.0, math.inf), Caps(60.0, 10, 10, 448))
    assert json.loads(reply.body)["code"] == code
    assert reply.worker_is_fit == (code == "unreachable_waypoint")


def test_a_memory_error_behind_another_is_found() -> None:
    try:
        try:
            raise MemoryError
        except MemoryError as error:
            raise SystemError("a callback failed") from error
    except SystemError as error:
        assert wants_memory(error)


def test_there_is_room_for_so_many_robots_only(one_worker: RunningService) -> None:
    answers = [one_worker.post("/v1/robots", dh_robot(id=f"arm_{i}")) for i in range(3)]
    assert [answer.status_code for answer in answers] == [201, 201, 409]
    assert answers[-1].json()["code"] == "too_many_robots"
    assert [one_worker.client.delete(f"/v1/robots/arm_{i}").status_code for i in range(3)] == [204, 204, 404]


def test_the_memory_of_a_warm_worker(service: RunningService) -> None:
    """Workers share the memory of their parent."""
    for worker in service.workers():
        assert worker.memory_full_info().uss < WARM_WORKER_MIB * 2**20


UNTRUSTED = [f"PLANNER_TRUSTED_PROXIES={word}" for word in ("*", "proxy.example.com", "10.0.0.1/8")]


@pytest.mark.parametrize("variable", ["PLANNER_WORKERS=0", "PLANNER_PORT=-1", "PLANNER_LOG_LEVEL=loud", *UNTRUSTED])
def test_settings_out_of_bounds_are_refused(monkeypatch: pytest.MonkeyPatch, variable: str) -> None:
    monkeypatch.setenv(*variable.split("="))
    with pytest.raises(ValidationError):
        Settings()


def test_a_worker_never_answers_with_the_robot_that_had_the_id_before(one_worker: RunningService) -> None:
    """One worker, so that it is the one that built, and solved for, the robot before. The truth: x = a cos q."""
    pids = {worker.pid for worker in one_worker.workers()}
    for length in (0.5, 0.8, 0.5, 0.3):
        added = one_worker.post(ROBOTS, dh_robot(id="reused", joints=[dh_joint(a=length)]))
        assert added.status_code == 201
        forward = one_worker.post(FORWARD, {"robot": "reused", "positions": [[0.4]]}).json()["poses"][0]["position"]
        np.testing.assert_allclose(forward, [length * math.cos(0.4), length * math.sin(0.4), 0.0], atol=1e-12)
        target = {"position": [0.0, length, 0.0], "orientation": None}
        asked = {"robot": "reused", "poses": [target], "solutions": "best"}
        (solved,) = one_worker.post(INVERSE, asked).json()["results"]
        assert solved["status"] == "solved"
        assert math.sin(solved["solutions"][0]["position"][0]) == pytest.approx(1.0, abs=1e-9)
        plan = plan_request(robot="reused", waypoints=[joint(0.0), joint(0.4)], include=["tcp_pose"])
        tip = one_worker.post(PLAN, plan).json()["samples"]["tcp_pose"]["position"]
        np.testing.assert_allclose(np.linalg.norm(tip, axis=1), length, atol=1e-12)
        assert one_worker.client.delete(f"{ROBOTS}/reused").status_code == 204
    assert {worker.pid for worker in one_worker.workers()} == pids
