"""Settings of the service, from environment variables with the prefix `PLANNER_`."""

from __future__ import annotations

from ipaddress import ip_address, ip_network
from pathlib import Path  # noqa: TC003 - pydantic evaluates the annotations
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, SecretStr, field_validator, model_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

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
    """Who may use the service: with `keys` every request needs an API key (`planner keys create`), with `open` none
    does. Without this setting the service is open where it listens on a loopback address, and asks for keys
    elsewhere."""
    key_requests_per_minute: int = Field(default=6000, ge=1)
    """The largest number of requests of one key in a minute, unless the key has a number of its own."""
    key_concurrent_requests: int = Field(default=64, ge=1)
    """The largest number of requests of one key under way, unless the key has a number of its own."""
    key_requests_per_day: int = Field(default=0, ge=0)
    """The largest number of requests of one key in a day (UTC), those of batches among them, unless the key has a
    number of its own; 0: as many as it likes."""
    cors_origins: Annotated[tuple[str, ...], NoDecode] = ()
    """The origins whose web pages may use the service from a browser, with commas between them, as in
    `https://cell.example.com,https://office.example.com`; `*` are all. Without any, only the service's own may."""
    allowed_hosts: Annotated[tuple[str, ...], NoDecode] = ()
    """The names that the service is served under, with commas between them, as in `planner.example.com`; a request to
    another one is refused. IP addresses and `localhost` always pass. Without any, a service that asks for keys goes by
    every name, one on a loopback address by no other, and one that is open elsewhere by those of private networks, as
    `planner` or `planner.local`."""
    trusted_proxies: Annotated[tuple[str, ...], NoDecode] = ()
    """The reverse proxies whose `X-Forwarded-For` names the client, by their IP addresses or networks, with commas
    between them, as in `127.0.0.1,10.0.0.0/8`. Without any, a client is the address that its connection comes from."""
    data_directory: Path | None = None
    """The folder in which robots and all else that clients leave is kept, in a file of SQLite; None: nothing outlives
    the service. Processes on one machine may share it."""
    database_url: SecretStr | None = None
    """The database that takes the place of SQLite's file, for services on several machines:
    `postgresql://user:password@host/name`."""
    workers: int = Field(default_factory=available_processors, ge=1, le=256)
    """The number of worker processes, each with one plan at a time; default: one for each processor that the process
    may use, by its affinity and the quota of its container."""
    express_workers: int = Field(default=1, ge=0, le=256)
    """The number of further worker processes, which take only requests that are known to be done soon: these need not
    wait for long ones."""
    batch_workers: int = Field(default=0, ge=0, le=256)
    """The number of workers that batches may use at once, while no request wants them; 0: all but one, so that a
    request need not wait for a plan of a batch to end."""
    scheduler: str | None = None
    """The scheduler of a Dask cluster that plans batches in place of the service's own workers, as in
    `tcp://10.0.0.1:8786`; machines join it with `planner worker`. Needs the extra `cluster`."""
    queue_size: int = Field(default=64, ge=0)
    """The number of requests that may wait for a worker; more are answered with 503."""
    max_connections: int = Field(default=1024, ge=1)
    """The largest number of connections; fewer if the process may not have that many open files."""
    max_connections_per_client: int = Field(default=256, ge=1)
    """The largest number of connections from one address; raise it to `max_connections` behind a reverse proxy, from
    which all come."""
    max_header_bytes: int = Field(default=16 * 1024, ge=1024)
    """The largest head of a request, bytes; up to twice as large ones may be let through."""
    header_timeout: float = Field(default=10.0, gt=0.0)
    """The time that a client may take to send the head of a request, s."""
    body_timeout: float = Field(default=30.0, gt=0.0)
    """The time that a client may take to send the body of a request, s."""
    write_timeout: float = Field(default=20.0, gt=0.0)
    """The time that a client may take to read each MiB of an answer, s."""
    keep_alive_timeout: int = Field(default=5, ge=1)
    """The time for which a connection without a request is kept, s."""
    max_body_bytes: int = Field(default=8 * 1024 * 1024, ge=1024)
    """The largest request body, bytes."""
    max_bytes_in_flight: int = Field(default=256 * 1024 * 1024, ge=8 * 1024 * 1024)
    """The bytes of bodies and answers that the server holds at once, of one client no more than it leaves free (half,
    if it is alone); what would go beyond is answered with 503."""
    answer_cache_bytes: int = Field(default=32 * 1024 * 1024, ge=0)
    """The bytes of answers that are kept for those who ask the same again; 0: none are."""
    max_deadline: float = Field(default=60.0, ge=10.0)
    """The longest deadline that a request may ask, s."""
    max_waypoints: int = Field(default=1000, ge=2)
    """The largest number of waypoints or poses in one request."""
    max_samples: int = Field(default=500_000, ge=1000)
    """The largest number of values in one answer, counted as rows times joints, and of rows in one request."""
    max_robots: int = Field(default=1000, ge=0)
    """The largest number of robots that are kept besides the catalogue's."""
    max_robots_per_client: int = Field(default=100, ge=0)
    """The largest number of robots that are kept for one address; raise it to `max_robots` behind a reverse proxy that
    is not one of `trusted_proxies`."""
    max_robots_bytes: int = Field(default=64 * 1024 * 1024, ge=0)
    """The bytes that the robots of all clients may take in the database."""
    max_robots_bytes_per_client: int = Field(default=16 * 1024 * 1024, ge=0)
    """The bytes that the robots of one key, or of one address, may take of these."""
    max_scenes: int = Field(default=1000, ge=0)
    """The largest number of scenes that are kept."""
    max_scenes_per_client: int = Field(default=100, ge=0)
    """The largest number of scenes that are kept for one key, or for one address."""
    max_scenes_bytes: int = Field(default=64 * 1024 * 1024, ge=0)
    """The bytes that the scenes of all clients may take in the database."""
    max_scenes_bytes_per_client: int = Field(default=16 * 1024 * 1024, ge=0)
    """The bytes that the scenes of one key, or of one address, may take of these."""
    max_batch_items: int = Field(default=100_000, ge=1)
    """The largest number of requests in one batch."""
    max_batch_bytes: int = Field(default=64 * 1024 * 1024, ge=1024)
    """The largest body of a batch that is one JSON document, bytes; newline-delimited ones may be longer."""
    max_batch_expanded_bytes: int = Field(default=128 * 1024 * 1024, ge=1024)
    """The largest number of bytes that all requests of one batch have together, those of a grid one by one."""
    max_batches: int = Field(default=1000, ge=0)
    """The largest number of batches that have not ended, of one client no more than it leaves to others."""
    max_batches_per_client: int = Field(default=10, ge=0)
    """The largest number of batches of one address that have not ended."""
    max_batches_bytes: int = Field(default=4 * 1024**3, ge=0)
    """The bytes that requests and results of batches may take in the database before no more batches are taken; those
    of one client may take as many as they leave free."""
    batch_retention_days: float = Field(default=7.0, gt=0.0)
    """The time for which a batch that has ended is kept, days."""
    worker_memory_mib: int = Field(default=1024, ge=448)
    """The private memory that one worker may allocate, MiB."""
    worker_niceness: int = Field(default=5, ge=0, le=19)
    """How far the workers stand back for the server when the processors are busy, as in `nice`: so that it refuses at
    once what is too much, and nobody waits for answers that are there."""
    worker_max_tasks: int = Field(default=10_000, ge=1)
    """The number of requests after which a worker is replaced by a fresh one."""
    otlp_endpoint: str | None = None
    """The OpenTelemetry collector that gets a trace of each request by OTLP over HTTP, as in `http://127.0.0.1:4318`;
    needs the extra `otel`. None: no traces."""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    """The least severe event that is logged."""

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
                f"who sends requests to {self.host} needs an API key, and keys are kept in a database: set "
                "PLANNER_DATA_DIRECTORY or PLANNER_DATABASE_URL and make keys with `planner keys create`, or let "
                "everybody in with PLANNER_ACCESS=open"
            )
        return self

    @field_validator("database_url")
    @classmethod
    def _of_postgresql(cls, url: SecretStr | None) -> SecretStr | None:
        if url is not None and not url.get_secret_value().startswith(("postgresql://", "postgres://")):
            raise ValueError("it begins with postgresql://")
        return url


def is_loopback(host: str) -> bool:
    """Tell whether only programs on the same machine reach what listens on an address."""
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def faults_of(error: ValidationError) -> list[str]:
    """Say what is wrong with the settings, each with the name of its environment variable, if it is about one."""
    return [
        "".join(f"PLANNER_{str(name).upper()}: " for name in fault["loc"][:1]) + fault["msg"]
        for fault in error.errors()
    ]
