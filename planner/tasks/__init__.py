"""Tasks in any order: the order, the joint positions and the motions between, chosen together."""

from planner.tasks.order import OrderedTasks, order_tasks
from planner.tasks.task import ARRIVAL, ChangeableTool, Origin, Task

__all__ = ["ARRIVAL", "ChangeableTool", "OrderedTasks", "Origin", "Task", "order_tasks"]
