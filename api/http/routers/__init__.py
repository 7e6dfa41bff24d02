"""The routes of the service by subject, in the order of the documentation."""

from api.http.routers import (
    batches,
    cells,
    collisions,
    dynamics,
    kinematics,
    page,
    path_files,
    projects,
    robots,
    scenes,
    service,
    tasks,
    trajectories,
)

ROUTERS = (
    trajectories.router,
    tasks.router,
    cells.router,
    path_files.router,
    batches.router,
    robots.router,
    scenes.router,
    projects.router,
    collisions.router,
    kinematics.router,
    dynamics.router,
    service.router,
    service.documentation,
    page.router,
)
"""The routers of the service."""
