"""Answers about the service itself and its back ends."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from api.contract.parts.common import Answer


class ServiceLimits(Answer):
    """The service's caps."""

    max_body_bytes: int
    """The largest request body, bytes."""
    default_deadline: float
    """The deadline of a request that names none, s."""
    max_deadline: float
    """The longest deadline that a request may ask, s."""
    max_waypoints: int
    """The largest number of waypoints or poses in one request."""
    max_samples: int
    """The largest number of values in one answer, counted as rows times joints, and of rows in one request."""
    max_robots: int
    """The largest number of robots that are kept besides the catalogue's."""
    max_robots_per_client: int
    """The largest number of robots that are kept for one client."""
    max_robots_bytes: int
    """The bytes that the robots of all clients may take in the database."""
    max_robots_bytes_per_client: int
    """The bytes that the robots of one client may take of these."""
    max_scenes: int
    """The largest number of scenes that are kept."""
    max_scenes_per_client: int
    """The largest number of scenes that are kept for one client."""
    max_scenes_bytes: int
    """The bytes that the scenes of all clients may take in the database."""
    max_scenes_bytes_per_client: int
    """The bytes that the scenes of one client may take of these."""
    max_roadmaps_per_scene: int
    """The largest number of roadmaps that are kept with one scene, each of another robot."""
    max_roadmaps_bytes_per_scene: int
    """The bytes that the roadmaps of one scene may take in the database."""
    max_projects: int
    """The largest number of projects that are kept."""
    max_projects_per_client: int
    """The largest number of projects that are kept for one client."""
    max_projects_bytes: int
    """The bytes that the projects of all clients may take in the database."""
    max_projects_bytes_per_client: int
    """The bytes that the projects of one client may take of these."""
    max_batch_items: int
    """The largest number of requests in one batch."""
    max_batch_bytes: int
    """The largest body of a batch that is one JSON document, bytes; newline-delimited ones may be longer."""
    max_batch_expanded_bytes: int
    """The largest number of bytes that all requests of one batch have together; every request of a grid counts."""
    max_batches: int
    """The largest number of batches that have not ended, of one client no more than it leaves to others."""
    max_batches_per_client: int
    """The largest number of batches of one address that have not ended."""
    key_requests_per_minute: int
    """The largest number of requests of one API key in a minute, where keys are required and it has no other."""
    key_concurrent_requests: int
    """The largest number of requests of one API key under way, where keys are required and it has no other."""
    key_requests_per_day: int
    """The largest number of requests of one API key in a day, batch items included; 0: any number. It holds where keys
    are required and the key has no other."""
    workers: int
    """The number of requests that are worked on at once."""
    queue_size: int
    """The number of requests that may wait; more are answered with 503."""
    worker_memory_mib: int
    """The private memory that a worker may allocate, MiB."""


class Liveness(Answer):
    """The process answers."""

    status: Literal["alive"]
    """Always `alive`: it is the answer that counts."""


class Readiness(Answer):
    """Whether requests should be sent here."""

    status: Literal["ready", "starting", "database_unavailable"]
    """Whether the service is ready for requests, still starting, or without a database that can be read."""
    workers: int
    """The number of workers that there are to be."""
    warm_workers: int
    """The number of workers that have planned once with every back end and run an example of every operation."""


class BackendDescription(Answer):
    """One back end."""

    kind: str
    """The kind by which requests name the back end."""
    summary: str
    """A summary in one sentence."""
    options: Annotated[dict[str, Any], Field(description="The JSON Schema of each of the back end's options, by name.")]
    guarantees: dict[str, Literal["hard", "reported", "none"]]
    """The promise for each quantity: the limit is kept (`hard`); the value is only reported and may exceed it
    (`reported`); or unknown (`none`)."""


class BackendsAnswer(Answer):
    """All back ends."""

    backends: list[BackendDescription]
    """The back ends, in the order of the documentation."""
