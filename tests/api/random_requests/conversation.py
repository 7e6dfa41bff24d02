"""Conversations with the service: a random robot, a plan and operations on it, each answer before a judge.

`python -m tests.api.random_requests 0 1000` holds the first thousand, prints what fails and goes on.
"""

from __future__ import annotations

import json
from collections import Counter
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.spatial import Pose
from tests.api.random_requests.handled import is_handled
from tests.api.random_requests.judged_goals import goals_hold
from tests.api.random_requests.judged_limits import limits_hold
from tests.api.random_requests.judged_refusals import is_precise, with_remedies
from tests.api.random_requests.judged_scenes import check_holds, collides, is_free, speeds_hold, validation_holds
from tests.api.random_requests.judged_solutions import reachability_holds, solutions_hold
from tests.api.random_requests.operations import Operations
from tests.api.random_requests.poses import placement
from tests.api.random_requests.rides import Rides
from tests.api.random_requests.robots import made_up_robot

if TYPE_CHECKING:
    from collections.abc import Iterator

    import httpx

    from planner.robots import Robot

BY_ID = 0.15
"""Share of the scenes that are kept first, and named by their id."""

REFUSED_BY_SCENES = ("collision", "start_in_collision", "clearance_unproved")


def stands_as_asked(waypoint: dict[str, Any]) -> bool:
    """Tell whether a start is a joint position and all objects are at their places in the scene."""
    return waypoint["kind"] == "joint" and not is_handled([waypoint])


class Judged:
    """Requests about one robot, each answer before the judges.

    Attributes:
        statuses: How many answers there were, by operation and status or code.
    """

    def __init__(self, client: httpx.Client, robot: Robot, random: np.random.Generator) -> None:
        self.client, self.robot, self.random = client, robot, random
        self.statuses = Counter[tuple[str, str]]()

    def ask(self, path: str, body: dict[str, Any]) -> tuple[dict[str, Any] | None, dict[str, Any]]:
        """Send a request, and pass its answer to the judges."""
        with self._sent(body) as sent:
            reply = self.client.post(f"/v1/{path}", json=sent, timeout=600.0)
        try:
            assert reply.status_code in (200, 422)
            found = reply.json()
            outcome = "200" if reply.status_code == 200 else found["code"]
            self.statuses[path, outcome] += 1
            self._judge(path, body, found, reply.status_code)
        except Exception as broken:
            raise AssertionError(f"/v1/{path} {json.dumps(body)} {reply.text[:600]}") from broken
        return (found, {}) if reply.status_code == 200 else (None, found)

    @contextmanager
    def _sent(self, body: dict[str, Any]) -> Iterator[dict[str, Any]]:
        """Yield the request to send."""
        yield body

    def _judge(self, path: str, body: dict[str, Any], found: dict[str, Any], status: int) -> None:
        if status != 200:
            is_precise(self.robot, body, found)
            is_plan = path == "trajectories"
            if is_plan and found["code"] == "start_in_collision" and stands_as_asked(body["waypoints"][0]):
                collides(self._mounted(body), body, found, np.array(body["waypoints"][0]["position"]))
            elif found["code"] in REFUSED_BY_SCENES:
                collides(self._mounted(body), body, found, None)
            return
        robot = self._mounted(body)
        if path == "collisions/check":
            check_holds(robot, body, found)
            return
        if path == "kinematics/inverse":
            solutions_hold(robot, body, found)
            return
        if path == "kinematics/reachability":
            reachability_holds(robot, body, found)
            return
        if path == "trajectories/validate":
            validation_holds(robot, body, found, self.random)
            return
        if path == "trajectories/compare":
            assert len(found["results"]) == len(body["backends"])
            for backend, result in zip(body["backends"], found["results"], strict=True):
                plan = {name: value for name, value in body.items() if name != "backends"} | {"backend": backend}
                done = result["trajectory"] or result["problem"]
                assert result["status"] == ("planned" if result["trajectory"] else done["code"])
                is_for_plan = not done.get("remedies") and not done.get("errors")
                self._judge("trajectories", plan if is_for_plan else body, done, done.get("status", 200))
            return
        limits_hold(robot, body, found, self.random)
        if path == "trajectories":
            goals_hold(robot, body, found)
            for gain in filter(None, (waypoint.get("gain") for waypoint in found["waypoints"])):
                assert gain["last"] <= gain["first"]
        if body.get("scene") or body.get("self_collision"):
            is_free(robot, body, found, found["certificate"].get("clearance"))
        speeds_hold(robot, body, found, checks := found["certificate"].get("speed_zones"))
        assert all(check["satisfied"] for check in checks or [])

    def _mounted(self, body: dict[str, Any]) -> Robot:
        if not body.get("mounting"):
            return self.robot
        where = placement(body["mounting"])
        return self.robot.derived(mounting=Pose(where.translation, where.rotation))


class Conversation(Judged):
    """Requests about one random robot, which follow from a number alone."""

    def __init__(self, client: httpx.Client, number: int) -> None:
        random = np.random.default_rng([12, number])
        robot, self.added = made_up_robot(random, f"own_{number}")
        super().__init__(client, robot, random)
        self.number = number

    def hold(self) -> None:
        """Plan, and continue with an operation on the answer or with a remedy of the refusal."""
        if self.added is not None:
            reply = self.client.post("/v1/robots", json=self.added)
            assert reply.status_code == 201, reply.text
        try:
            self._hold()
        finally:
            if self.added is not None:
                self.client.delete(f"/v1/robots/{self.robot.id}")

    def _hold(self) -> None:
        made = Operations(self.robot, self.random)
        if made.chance(0.1):
            self.ask(*(made.solutions() if made.chance(0.5) else ("collisions/check", made.check({}, None))))
            return
        if made.rides:
            self._ride()
            return
        request = made.plan()
        if made.chance(0.05):
            request = made.spoiled(request)
        if made.compares:
            self.ask("trajectories/compare", made.comparison(request))
            return
        answer, problem = self.ask("trajectories", request)
        if answer is not None:
            path, asked = made.operation(request, answer)
            self.ask(path, asked)
        elif problem.get("remedies") and made.chance(0.3):
            chosen = int(self.random.integers(len(problem["remedies"])))
            helped, refused = self.ask("trajectories", with_remedies(request, problem["remedies"], chosen))
            said = f"{json.dumps(request)} is refused: {json.dumps(problem)}"
            assert helped is not None, f"remedy {chosen} does not help: {json.dumps(refused)}; {said}"

    def _ride(self) -> None:
        """Plan rides, and validate or check the trajectory among the moving objects."""
        request = Rides(self.robot, self.random).plan()
        answer, _ = self.ask("trajectories", request)
        if answer is None or is_handled(request["waypoints"]):
            return
        stands = {name: request[name] for name in ("mounting", "frames") if name in request}
        asked = {name: request[name] for name in ("robot", "scene")} | {"polynomials": answer["polynomials"]}
        self.ask("collisions/check" if stands else "trajectories/validate", asked | stands)

    @contextmanager
    def _sent(self, body: dict[str, Any]) -> Iterator[dict[str, Any]]:
        """Yield the request to send; some requests name their scene by the id of a stored copy."""
        if not body.get("scene") or self.random.random() > BY_ID:
            yield body
            return
        name = f"scene_{self.number}"
        kept = self.client.post("/v1/scenes", json={**body["scene"], "id": name})
        assert kept.status_code in (201, 422), kept.text
        try:
            yield {**body, "scene": name} if kept.status_code == 201 else body
        finally:
            self.client.delete(f"/v1/scenes/{name}")
