"""Settings of the service, from environment variables with the prefix `PLANNER_`."""

from __future__ import annotations

from functools import cache
from ipaddress import ip_address, ip_network
from pathlib import Path  # noqa: TC003 - pydantic evaluates the annotations
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, SecretStr, field_validator, model_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

from api.base.errors import message_of
from api.base.processors import available_processors

if TYPE_CHECKING:
    from pydantic import ValidationError


class Settings(BaseSettings):
    """Everything that an operator can set; `PLANNER_WORKERS=4` sets `workers`."""

    model_config = SettingsConfigDict(env_prefix="PLANNER_", frozen=True, use_attribute_docstrings=True)

    host: str = "127.0.0.1"
    """The address to listen on."""
    port: int = Field(default=8000, ge=0, le=65535)
    """The port to listen on."""
    access: Literal["keys", "open"] | None = None
    """Who may use the service: `keys` requires an API key for every request (`planner keys create`), `open` none.
    By default, a service on a loopback address is open and any other service requires keys."""
    key_requests_per_minute: int = Field(default=6000, ge=1)
    """The most requests of one key in a minute; a key may have a limit of its own."""
    key_concurrent_requests: int = Field(default=64, ge=1)
    """The most concurrent requests of one key; a key may have a limit of its own."""
    key_requests_per_day: int = Field(default=0, ge=0)
    """The most requests of one key in a day (UTC), items of batches included; 0: unlimited. A key may have a limit
    of its own."""
    cors_origins: Annotated[tuple[str, ...], NoDecode] = ()
    """The origins whose web pages may use the service from a browser, separated by commas:
    `https://cell.example.com,https://office.example.com`; `*` allows all. By default, only the service's own
    origin."""
    allowed_hosts: Annotated[tuple[str, ...], NoDecode] = ()
    """The host names of the service, separated by commas: `planner.example.com`. A request to another host name is
    refused; IP addresses and `localhost` are always allowed. By default, a service that requires keys accepts every
    name. An open service accepts names of private networks (`planner`, `planner.local`), or only `localhost` on a
    loopback address."""
    trusted_proxies: Annotated[tuple[str, ...], NoDecode] = ()
    """The reverse proxies whose `X-Forwarded-For` header names the client: IP addresses or networks, separated by
    commas, such as `127.0.0.1,10.0.0.0/8`. By default, the client is the peer address of the connection."""
    data_directory: Path | None = None
    """The folder of the SQLite file with robots, scenes, projects, batches and keys. By default, nothing survives a
    restart. Several processes of one machine may share the folder."""
    database_url: SecretStr | None = None
    """The PostgreSQL database that replaces the SQLite file when services run on several machines:
    `postgresql://user:password@host/name`."""
    database_reading_threads: int = Field(default=2, ge=1, le=12)
    """The number of threads that read the database at the same time. More help where the network to PostgreSQL is slow;
    one thread writes."""
    workers: int = Field(default_factory=available_processors, ge=1, le=256)
    """The number of worker processes; each plans one request at a time. By default, one for each processor
    available to the process (affinity and container quota)."""
    express_workers: int = Field(default=1, ge=0, le=256)
    """The number of additional workers reserved for short requests, so that short requests need not wait for long
    ones."""
    batch_workers: int = Field(default=0, ge=0, le=256)
    """The most workers that batches use at once while no request needs them. 0: one worker
    fewer than there are, so that a request need not wait for a batch item."""
    scheduler: str | None = None
    """The Dask scheduler that plans batches instead of the service's own workers: `tcp://10.0.0.1:8786`. Machines
    join with `planner worker`. Needs the extra `cluster`."""
    queue_size: int = Field(default=64, ge=0)
    """The most requests that wait for a worker; further requests get 503."""
    max_connections: int = Field(default=1024, ge=1)
    """The most connections; fewer if the limit of open files is lower."""
    max_connections_per_client: int = Field(default=256, ge=1)
    """The most connections of one address. Behind a reverse proxy all connections have one address: raise it to
    `max_connections`."""
    max_header_bytes: int = Field(default=16 * 1024, ge=1024)
    """The largest request head, bytes; a head up to twice as large may be accepted."""
    header_timeout: float = Field(default=10.0, gt=0.0)
    """The longest time for receiving the head of a request, s."""
    body_timeout: float = Field(default=30.0, gt=0.0)
    """The longest time for receiving the body of a request, s."""
    write_timeout: float = Field(default=20.0, gt=0.0)
    """The longest time for sending each MiB of an answer, s."""
    keep_alive_timeout: int = Field(default=5, ge=1)
    """The time after which an idle connection is closed, s."""
    max_body_bytes: int = Field(default=8 * 1024 * 1024, ge=1024)
    """The largest request body, bytes."""
    max_bytes_in_flight: int = Field(default=256 * 1024 * 1024, ge=8 * 1024 * 1024)
    """The most bytes of bodies and answers that the server holds at once; further ones get 503. One client may hold
    as much as it leaves free: half, if it is alone."""
    answer_cache_bytes: int = Field(default=32 * 1024 * 1024, ge=0)
    """The size of the cache of answers to repeated requests, bytes; 0: no cache."""
    max_deadline: float = Field(default=60.0, ge=10.0)
    """The largest `deadline` of a request, s."""
    max_waypoints: int = Field(default=1000, ge=2)
    """The most waypoints or poses in one request."""
    max_samples: int = Field(default=500_000, ge=1000)
    """The most values (rows times joints) in one answer, and the most rows in one request."""
    max_robots: int = Field(default=1000, ge=0)
    """The most stored robots, besides the catalogue."""
    max_robots_per_client: int = Field(default=100, ge=0)
    """The most stored robots of one address. Behind a reverse proxy that is not in `trusted_proxies`, raise it to
    `max_robots`."""
    max_robots_bytes: int = Field(default=64 * 1024 * 1024, ge=0)
    """The most bytes of stored robots in the database."""
    max_robots_bytes_per_client: int = Field(default=16 * 1024 * 1024, ge=0)
    """The most bytes of stored robots of one key or address."""
    max_scenes: int = Field(default=1000, ge=0)
    """The most stored scenes."""
    max_scenes_per_client: int = Field(default=100, ge=0)
    """The most stored scenes of one key or address."""
    max_scenes_bytes: int = Field(default=64 * 1024 * 1024, ge=0)
    """The most bytes of stored scenes in the database."""
    max_scenes_bytes_per_client: int = Field(default=16 * 1024 * 1024, ge=0)
    """The most bytes of stored scenes of one key or address."""
    max_roadmaps_per_scene: int = Field(default=4, ge=0)
    """The most roadmaps of one stored scene, each of another robot."""
    max_roadmaps_bytes_per_scene: int = Field(default=1024 * 1024, ge=0)
    """The most bytes of roadmaps of one stored scene in the database."""
    max_projects: int = Field(default=1000, ge=0)
    """The most saved projects of the page."""
    max_projects_per_client: int = Field(default=100, ge=0)
    """The most saved projects of one key or address."""
    max_projects_bytes: int = Field(default=64 * 1024 * 1024, ge=0)
    """The most bytes of saved projects in the database; one project has at most `max_body_bytes`."""
    max_projects_bytes_per_client: int = Field(default=16 * 1024 * 1024, ge=0)
    """The most bytes of saved projects of one key or address."""
    max_batch_items: int = Field(default=100_000, ge=1)
    """The most requests in one batch."""
    max_batch_bytes: int = Field(default=64 * 1024 * 1024, ge=1024)
    """The largest batch body in one JSON document, bytes; newline-delimited JSON (NDJSON) may be larger."""
    max_batch_expanded_bytes: int = Field(default=128 * 1024 * 1024, ge=1024)
    """The most bytes of all requests of one batch together; a grid counts each of its requests."""
    max_batches: int = Field(default=1000, ge=0)
    """The most unfinished batches; one client may have at most as many as it leaves free."""
    max_batches_per_client: int = Field(default=10, ge=0)
    """The most unfinished batches of one address."""
    max_batches_bytes: int = Field(default=4 * 1024**3, ge=0)
    """The most bytes of batches (requests and results) in the database; further batches are refused. One client may
    hold as much as it leaves free."""
    batch_retention_days: float = Field(default=7.0, gt=0.0)
    """The time for which finished batches are kept, days."""
    worker_memory_mib: int = Field(default=1024, ge=448)
    """The most private memory of one worker, MiB."""
    worker_niceness: int = Field(default=5, ge=0, le=19)
    """The niceness of the workers, as for `nice`. The server's higher priority lets it refuse excess requests at
    once and deliver finished answers on a busy machine."""
    worker_max_tasks: int = Field(default=10_000, ge=1)
    """The number of requests after which a fresh process replaces a worker."""
    otlp_endpoint: str | None = None
    """The OpenTelemetry collector that receives a trace of each request (OTLP over HTTP): `http://127.0.0.1:4318`.
    Needs the extra `otel`. By default, no traces."""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    """The lowest severity that is logged."""

    @property
    def asks_for_keys(self) -> bool:
        """Whether every request needs an API key."""
        return not is_loopback(self.host) if self.access is None else self.access == "keys"

    @field_validator("cors_origins", "allowed_hosts", "trusted_proxies", mode="before")
    @classmethod
    def _between_commas(cls, entries: str | tuple[str, ...]) -> tuple[str, ...]:
        if not isinstance(entries, str):
            return entries
        return tuple(entry.strip() for entry in entries.split(",") if entry.strip())

    @field_validator("trusted_proxies")
    @classmethod
    def _networks(cls, entries: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(str(ip_network(entry)) for entry in entries)

    @model_validator(mode="after")
    def _has_a_database_for_keys(self) -> Settings:
        if self.asks_for_keys and self.data_directory is None and self.database_url is None:
            raise ValueError(
                f"Requests to {self.host} need an API key, and keys are stored in a database. Set "
                "PLANNER_DATA_DIRECTORY or PLANNER_DATABASE_URL and create keys with `planner keys create`, or set "
                "PLANNER_ACCESS=open to let everybody in."
            )
        return self

    @field_validator("database_url")
    @classmethod
    def _of_postgresql(cls, url: SecretStr | None) -> SecretStr | None:
        if url is not None and not url.get_secret_value().startswith(("postgresql://", "postgres://")):
            raise ValueError("must begin with postgresql://")
        return url


@cache
def is_loopback(host: str) -> bool:
    """Tell whether only programs on the same machine reach a server that listens on an address."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def faults_of(error: ValidationError) -> list[str]:
    """List the faults of the settings, each with the name of its environment variable."""
    return [
        "".join(f"PLANNER_{str(name).upper()}: " for name in fault["loc"][:1]) + message_of(fault)
        for fault in error.errors()
    ]
