"""The way from a problem to its certified plan, or to a refusal with remedies."""

from planner.planning.attempts import Budget, Progress
from planner.planning.plan import plan

__all__ = ["Budget", "Progress", "plan"]
