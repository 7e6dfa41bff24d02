"""The examples of the OpenAPI document, as a running service answers them.

`python -m tests.api.contract.recorded_examples` writes the examples that the document shows; a test compares.
"""

from __future__ import annotations

import csv
import io
import json
import re
import socket
import tempfile
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import ZipFile

import httpx
import orjson
import pytest

from api.base import errors
from api.contract.examples.request_examples import request_examples
from api.work.answers.problem_documents import problem_document
from tests.api.conftest import running_service, wait_until
from tests.api.operations import OPERATIONS
from tests.api.requests import dh_joint, dh_robot, joint, plan_request, pose_waypoint, urdf_robot
from tests.locations import ROOT

if TYPE_CHECKING:
    from tests.api.conftest import RunningService

FILE = ROOT / "api/contract/examples/openapi_examples.json"
PLAN, ROBOTS, BATCHES, SCENES = "/v1/trajectories", "/v1/robots", "/v1/batches", "/v1/scenes"
PROJECTS = "/v1/projects"
QUERIES = {"list_robots": {"limit": 2}, "list_batches": {"limit": 2}, "export_trajectory": {"format": "csv"}}
QUERIES["download_batch_results"] = {"format": "csv"}

TORQUES = plan_request(robot="ngv_refuelling_arm", waypoints=[joint(*[0.1] * 6), joint(*[0.2] * 6)], include=["torque"])
KUKA = {"robot": "kuka_kr16_l6_2"}
LINE_TO_THE_OTHER_ELBOW = KUKA | {
    "waypoints": [
        joint(0.3, -1.2, 1.4, 0.2, 0.6, 0.1),
        joint(0.2, 0.1, -1.0, 0.2, 0.6, 0.1, motion={"kind": "linear"}),
    ],
}
ROUND = [joint(0.1, 0.2, 0.3), joint(6.1, 0.2, 0.3)]
BARELY_BELOW = {
    "id": "floor",
    "margin": 0.05,
    "shape": {"kind": "half_space", "normal": [0.0, 0.0, 1.0], "offset": -0.08785694},
}
WALL = {"id": "wall", "shape": {"kind": "box", "size": [0.8, 0.1, 1.6]}, "pose": {"position": [1.3, 0.0, 0.8]}}
AROUND_A_WALL = [
    joint(0.9, -0.9, 1.2, 0.0, 0.8, 0.0),
    joint(-0.9, -0.9, 1.2, 0.0, 0.8, 0.0, motion={"kind": "free", "most_checks": 10}),
]
FLOOR = {"id": "floor", "shape": {"kind": "half_space", "normal": [0.0, 0.0, 1.0]}}
PROBLEMS: dict[str, tuple[str, str, Any]] = {
    "invalid_request": ("POST", PLAN, plan_request(waypoints=[])),
    "not_found": ("GET", "/v1/nothing", None),
    "method_not_allowed": ("PUT", PLAN, None),
    "unknown_robot": ("POST", PLAN, plan_request(robot="nobody")),
    "unknown_batch": ("GET", f"{BATCHES}/none", None),
    "unknown_project": ("GET", f"{PROJECTS}/none", None),
    "unknown_scene": ("POST", PLAN, plan_request(scene="cell_9")),
    "not_acceptable": ("POST", f"{PLAN}/export?format=xlsx", plan_request()),
    "catalogue_robot": ("DELETE", f"{ROBOTS}/three_dof_arm", None),
    "invalid_robot_model": ("POST", ROBOTS, urdf_robot("")),
    "unreachable_waypoint": ("POST", PLAN, plan_request(waypoints=[joint(0.1, 0.2, 0.3), pose_waypoint([9.0, 0, 0])])),
    "configuration_change": ("POST", PLAN, LINE_TO_THE_OTHER_ELBOW),
    "joint_position_limit": (
        "POST",
        PLAN,
        KUKA | {"waypoints": [joint(0, -1, 1, 0, 0, 0), joint(0, 3, 1, 0, 0, 0)]},
    ),
    "missing_dynamics": ("POST", PLAN, TORQUES),
    "payload_exceeded": (
        "POST",
        PLAN,
        KUKA
        | {
            "waypoints": [joint(0.0, -1.5, 1.5, 0.0, 0.5, 0.0), joint(0.2, -1.2, 1.4, 0.1, 0.5, 0.1)],
            "payload": {"mass": 20.0},
        },
    ),
    "unsupported_format": ("POST", f"{PLAN}/export?format=urscript", plan_request()),
    "infeasible_duration": (
        "POST",
        PLAN,
        plan_request(waypoints=[joint(0.1, 0.2, 0.3), joint(0.3, 0.1, 0.5, duration=0.01)]),
    ),
    "limits_unsatisfiable": (
        "POST",
        f"{PLAN}/reverse",
        {
            "robot": "three_dof_arm",
            "trajectory": request_examples()["reverse_trajectory"]["the_way_back"]["trajectory"],
            "limits": {"velocity": [0.05] * 3},
        },
    ),
    "start_in_collision": ("POST", PLAN, plan_request(scene={"objects": [FLOOR | {"margin": 1.0}]})),
    "clearance_unproved": ("POST", PLAN, plan_request(waypoints=ROUND, scene={"objects": [BARELY_BELOW]})),
    "collision": (
        "POST",
        PLAN,
        KUKA
        | {
            "waypoints": [joint(0.0, -1.5, 1.5, 0.0, 0.5, 0.0), joint(0.0, -0.2, 0.9, 0.0, 0.9, 0.0)],
            "scene": {"objects": request_examples()["check_collisions"]["two_joint_positions"]["scene"]["objects"]},
        },
    ),
    "no_path_found": ("POST", PLAN, KUKA | {"waypoints": AROUND_A_WALL, "scene": {"objects": [WALL]}}),
    "deadline_exceeded": ("POST", PLAN, plan_request(deadline=1e-6)),
}
"""A request for each problem code that a single request causes."""


def examples(service: RunningService) -> dict[str, Any]:
    """Return the service's answers to the document's example requests, and to requests that it refuses."""
    return {"answers": answers(service), "problems": dict(sorted(problems(service).items()))}


def answers(service: RunningService) -> dict[str, dict[str, dict[str, Any]]]:
    """Return the answers by operation, status and name."""
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for operation in sorted(OPERATIONS, key=lambda one: one.method == "GET"):  # there are batches before they are read
        if operation.method == "DELETE":
            continue
        requests = operation.examples or {"an_answer": None}
        of_operation = found.setdefault(operation.id, {})
        for name, body in requests.items():
            for _ in range(1 + (len(operation.answers) - 1) * (operation.method in {"POST", "PUT"})):
                path = operation.path_of(_id(service, operation.tag))
                reply = service.client.request(operation.method, path, json=body, params=QUERIES.get(operation.id))
                assert reply.is_success, reply.text
                is_json = reply.headers["Content-Type"] == "application/json"
                shown = reply.json() if is_json else _excerpt(reply)
                of_operation.setdefault(str(reply.status_code), {})[name] = shown
    for added in (f"{ROBOTS}/planar_arm", f"{ROBOTS}/kuka_in_cell_4", f"{SCENES}/cell_4", f"{PROJECTS}/welding"):
        service.client.delete(added)
    found["get_readiness"]["503"] = {"starting": {"status": "starting", "workers": 2, "warm_workers": 1}}
    return found


def _excerpt(reply: httpx.Response) -> str:
    """Return the text of a reply without large or changing content; for an archive, the names of its files."""
    if reply.headers["Content-Type"] == "application/zip":
        return " ".join(ZipFile(BytesIO(reply.content)).namelist())
    if reply.headers["Content-Type"] == "model/gltf-binary":
        return reply.text[:4]
    if reply.headers["Content-Type"].startswith("text/html"):
        return reply.text.partition("<style>")[0]
    metrics = [line for line in reply.text.splitlines(keepends=True) if "planner_batches_running" in line]
    return "".join(metrics) or reply.text


def _id(service: RunningService, tag: str) -> str:
    """Return the id of a robot, scene or project, or of the batch of two requests once all ended."""
    if tag != "batches":
        return {"scenes": "cell_4", "projects": "welding"}.get(tag, "three_dof_arm")

    def newest() -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = service.client.get(BATCHES, params={"limit": 2}).json()["batches"]
        return found

    wait_until(lambda: all(batch["status"] != "running" for batch in newest()))
    return next((str(batch["id"]) for batch in newest() if batch["total"] == 2), "none")


def problems(service: RunningService) -> dict[str, Any]:
    """Return the problem documents by code: some caused by requests, the others by the service itself."""
    found = {}
    requests = PROBLEMS | {"singular_path": ("POST", PLAN, _past_a_singularity())}
    for code, (method, path, body) in requests.items():
        found[code] = service.client.request(method, path, json=body).json()
    found["unsupported_media_type"] = service.client.post(PLAN, content="robot", headers={"Content-Type": "text/plain"})
    json_of_a_gigabyte = "Content-Type: application/json\r\nContent-Length: 999999999\r\n\r\n"
    found["payload_too_large"] = _raw(service, f"POST {PLAN} HTTP/1.1\r\nHost: localhost\r\n{json_of_a_gigabyte}")
    found["misdirected_request"] = service.client.get("/livez", headers={"Host": "planner.example.com"})
    elsewhere = {"Origin": "https://elsewhere.example.com"}
    found["foreign_origin"] = service.client.post(PLAN, json=plan_request(), headers=elsewhere)
    found["malformed_request"] = _raw(service, "robot\r\n\r\n")
    found["header_too_large"] = _raw(service, f"GET / HTTP/1.1\r\nX: {'a' * 70_000}")
    found["robot_exists"], found["robot_of_another"] = _robots(service)
    found["scene_exists"], found["scene_of_another"] = _scenes(service)
    found["project_changed"], found["project_of_another"] = _projects(service)
    found["unknown_roadmap"] = _roadmap(service)
    found["conflict"] = _conflict(service)
    found = {code: reply.json() if isinstance(reply, httpx.Response) else reply for code, reply in found.items()}
    for error in (
        errors.RequestTimeout("The head of the request did not arrive in time."),
        errors.TooManyRequests("This client has too many connections. Retry after 1 s."),
        errors.Unauthorized("Send an API key in the header `Authorization: Bearer planner_...`."),
        errors.Forbidden("The API key must have the scope `robots:write`."),
        errors.TooManyRobots("The service stores no more robots. Delete one first."),
        errors.TooManyScenes("The service stores no more scenes. Delete one first."),
        errors.TooManyRoadmaps("A scene may have at most 4 roadmaps. Delete the roadmap of another robot first."),
        errors.TooManyProjects("The service keeps no more projects. Delete one first."),
        errors.TooManyBatches("This client has too many unfinished batches. Wait for one to end, or cancel one."),
        errors.MemoryExceeded(),
        errors.InternalError(),
        errors.Overloaded("The queue is full. Retry after 1 s."),
        errors.DatabaseUnavailable("The database does not answer. Retry after 5 s."),
    ):
        found[error.code] = orjson.loads(problem_document(error, PLAN)[1])
    for problem in found.values():
        problem.get("remedies", [])[1:] = []
    return found


def _past_a_singularity() -> dict[str, Any]:
    request: dict[str, Any] = json.loads((ROOT / "examples" / "past_a_singularity.json").read_text(encoding="utf-8"))
    request["waypoints"][1]["motion"] = {"kind": "linear"}
    return request


def _robots(service: RunningService) -> tuple[httpx.Response, httpx.Response]:
    """Add another robot of the same id, and delete it from another address."""
    service.post(ROBOTS, dh_robot(id="somebodys_arm"))
    exists = service.post(ROBOTS, dh_robot(id="somebodys_arm", joints=[dh_joint(a=0.2)]))
    with httpx.Client(transport=httpx.HTTPTransport(local_address="127.0.0.2"), base_url=service.url) as another:
        of_another = another.delete(f"{ROBOTS}/somebodys_arm")
    service.client.delete(f"{ROBOTS}/somebodys_arm")
    return exists, of_another


def _scenes(service: RunningService) -> tuple[httpx.Response, httpx.Response]:
    """Add another scene of the same id, and delete it from another address."""
    service.post(SCENES, {"id": "somebodys_cell"})
    exists = service.post(SCENES, {"id": "somebodys_cell", "margin": 0.02})
    with httpx.Client(transport=httpx.HTTPTransport(local_address="127.0.0.2"), base_url=service.url) as another:
        of_another = another.delete(f"{SCENES}/somebodys_cell")
    service.client.delete(f"{SCENES}/somebodys_cell")
    return exists, of_another


def _projects(service: RunningService) -> tuple[httpx.Response, httpx.Response]:
    """Save a project that is there already, and delete it from another address."""
    path = f"{PROJECTS}/somebodys"
    service.client.put(path, json={})
    changed = service.client.put(path, json={"robot": "ur5e"}, headers={"If-None-Match": "*"})
    with httpx.Client(transport=httpx.HTTPTransport(local_address="127.0.0.2"), base_url=service.url) as another:
        of_another = another.delete(path)
    service.client.delete(path)
    return changed, of_another


def _roadmap(service: RunningService) -> httpx.Response:
    """Delete the roadmap of a scene without one."""
    service.post(SCENES, {"id": "somebodys_cell"})
    unknown = service.client.delete(f"{SCENES}/somebodys_cell/roadmap", params={"robot": "ur5e"})
    service.client.delete(f"{SCENES}/somebodys_cell")
    return unknown


def _conflict(service: RunningService) -> httpx.Response:
    headers = {"Idempotency-Key": "recorded examples"}
    first, second = (service.post(BATCHES, {"requests": [plan_request(seed=seed)]}, headers=headers) for seed in (0, 1))
    service.client.delete(first.headers["Location"])
    return second


def _raw(service: RunningService, request: str) -> Any:
    """Send bytes that are no valid HTTP request, and read the problem document."""
    url = httpx.URL(service.url)
    with socket.create_connection((url.host, url.port or 80), timeout=30.0) as connection:
        connection.sendall(request.encode())
        answer = b""
        while part := connection.recv(2**16):
            answer += part
    return json.loads(answer.partition(b"\r\n\r\n")[2])


OF_THE_MOMENT = {"id", "created", "ended", "rate", "remaining_time", "request_hash", "next_cursor", "digest", "changed"}
"""Fields whose values differ in every run; the digest of a roadmap is that of its numbers."""

FOR_PEOPLE = {"detail", "message", "explanation"}
"""Fields whose words name the robots that are installed, or a time."""

TIED = re.compile(
    r"/checks/\d+/(joint|time)$|/clearance/(\w+/)?time$|/speed_zones/\d+/(time|link|lower)$"
    r"|^/workspace/.*/position/\d+$"
)
"""Fields that rounding decides, so that they differ between processors.

They are ties between joints or instants of equal limit use, and joint positions of equal reach. Others are the instants
of the least distance and the fastest instant of a slowed motion."""


def differences(shown: Any, answered: Any, where: str = "") -> list[str]:
    """List the places where an answer differs from the example; it may have further fields."""
    if isinstance(shown, dict) and isinstance(answered, dict):
        found = [f"{where}/{name} is missing" for name in shown.keys() - answered.keys()]
        for name in shown.keys() & answered.keys():
            if name not in OF_THE_MOMENT | FOR_PEOPLE:
                found += differences(shown[name], answered[name], f"{where}/{name}")
        return found
    if isinstance(shown, list) and isinstance(answered, list) and len(shown) == len(answered):
        pairs = enumerate(zip(shown, answered, strict=True))
        return [found for i, pair in pairs for found in differences(*pair, f"{where}/{i}")]
    if TIED.search(where) and type(shown) is type(answered):
        return []
    if isinstance(shown, float) and isinstance(answered, float):
        # The nearest pose of an unreachable one is found to about 1e-8 m and rad.
        return [] if answered == pytest.approx(shown, rel=1e-5, abs=1e-7) else [f"{where}: {answered} for {shown}"]
    if isinstance(shown, str) and isinstance(answered, str) and parsed(shown) != shown:
        return differences(parsed(shown), parsed(answered), where)
    return [] if type(shown) is type(answered) and shown == answered else [f"{where}: {answered!r} for {shown!r}"]


def parsed(text: str) -> Any:
    """Return the values in lines of JSON, in events or in a table."""
    lines = [line.removeprefix("data: ") for line in text.splitlines()]
    if any(line.startswith("{") for line in lines):
        return [json.loads(line) for line in lines if line.startswith("{")]
    if len(lines) > 1 and "," in lines[0]:
        header, *rows = csv.reader(io.StringIO(text, newline=""))
        return [header, *([float(cell) for cell in row] for row in rows)]
    return text


def kept(shown: dict[str, Any], recorded: dict[str, Any]) -> dict[str, Any]:
    """Return the recorded examples, but keep each shown example, with its rounding, that is equal."""
    return {
        name: shown[name]
        if name in shown
        and not differences(value, shown[name], f"/{name}") + differences(shown[name], value, f"/{name}")
        else value
        for name, value in recorded.items()
    }


if __name__ == "__main__":
    SHOWN = json.loads(FILE.read_bytes())
    with tempfile.TemporaryDirectory() as folder, running_service(Path(folder) / "log.jsonl") as running:
        parts = [
            f'"{part}": {{\n' + ",\n".join(f'"{name}": {json.dumps(value)}' for name, value in entries.items()) + "\n}"
            for part, entries in ((part, kept(SHOWN[part], found)) for part, found in examples(running).items())
        ]
        FILE.write_text("{" + ",\n".join(parts) + "}\n", encoding="utf-8")
