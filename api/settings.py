"""Settings of the service, from environment variables with the prefix `PLANNER_`."""

from __future__ import annotations

import os
from typing import Literal

from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict


class Settings(BaseSettings):
    """Everything that an operator can set; `PLANNER_WORKERS=4` sets `workers`."""

    model_config = SettingsConfigDict(env_prefix="PLANNER_", frozen=True, use_attribute_docstrings=True)

    host: str = "127.0.0.1"
    """Address to listen on."""
    port: int = Field(default=8000, ge=0, le=65535)
    """Port to listen on."""
    workers: int = Field(default_factory=lambda: len(os.sched_getaffinity(0)), ge=1, le=256)
    """Worker processes; one plan at a time each."""
    queue_size: int = Field(default=64, ge=0)
    """Requests that may wait for a worker; more are answered with 503."""
    max_body_bytes: int = Field(default=4 * 1024 * 1024, ge=1024)
    """Largest request body, bytes."""
    max_deadline: float = Field(default=60.0, ge=10.0)
    """Longest deadline that a request may ask, s."""
    max_waypoints: int = Field(default=1000, ge=2)
    """Most waypoints or poses in one request."""
    max_samples: int = Field(default=500_000, ge=1000)
    """Most samples in one answer, counted as rows times joints."""
    max_robots: int = Field(default=1000, ge=0)
    """Most robots kept besides the catalogue's."""
    worker_memory_mib: int = Field(default=1024, ge=384)
    """Private memory that one worker may allocate, MiB."""
    worker_max_tasks: int = Field(default=10_000, ge=1)
    """Requests after which a worker is replaced by a fresh one."""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    """Least severe event that is logged."""
