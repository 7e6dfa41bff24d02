"""Tasks in any order: the order, the joint positions and the motions between, chosen together."""

from planner.tasks.order import OrderedTasks, order_tasks
from planner.tasks.task import ARRIVAL, Origin, Task

__all__ = ["ARRIVAL", "OrderedTasks", "Origin", "Task", "order_tasks"]
