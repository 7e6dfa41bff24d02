"""Plans, meets a problem, fetches a file and runs a batch with the generated client; prints what came of it."""

import json
import sys
import time

from planner_client import AuthenticatedClient, models
from planner_client.api.batches import create_batch, get_batch, get_batch_results
from planner_client.api.trajectories import export_trajectory, plan_trajectory


def request(robot: str) -> models.PlanRequest:
    ends = ([0.1, 0.2, 0.3], [0.3, 0.1, 0.5])
    return models.PlanRequest(
        robot=robot,
        waypoints=[models.JointWaypoint(kind="joint", position=position) for position in ends],
        backend=models.QuinticBackend(kind="quintic"),
    )


client = AuthenticatedClient(base_url=sys.argv[1], token="none")
plan = plan_trajectory.sync(client=client, body=request("three_dof_arm"))
assert isinstance(plan, models.PlanAnswer)
problem = plan_trajectory.sync(client=client, body=request("nobody"))
assert isinstance(problem, models.ProblemDocument)
file = export_trajectory.sync(
    client=client, body=request("three_dof_arm"), format_=models.ExportTrajectoryPlanFormat.CSV
)
assert file is not None and not isinstance(file, models.ProblemDocument)
body = models.BatchRequest(requests=[request("three_dof_arm"), request("nobody")])
batch = create_batch.sync(client=client, body=body)
assert isinstance(batch, models.Batch)
while batch.status == models.BatchStatus.RUNNING:
    time.sleep(0.1)
    batch = get_batch.sync(id=batch.id, client=client)
    assert isinstance(batch, models.Batch)
results = get_batch_results.sync(id=batch.id, client=client)
assert isinstance(results, models.BatchResultsAnswer)
print(
    json.dumps(
        {
            "duration": plan.duration,
            "code": problem.code.value,
            "lines": len(file.payload.read().splitlines()),
            "batch": [result.status for result in results.results],
        }
    )
)
