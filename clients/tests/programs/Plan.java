import java.nio.file.Files;
import java.util.List;
import java.util.stream.Collectors;
import planner.client.ApiClient;
import planner.client.ApiException;
import planner.client.api.BatchesApi;
import planner.client.api.TrajectoriesApi;
import planner.client.model.*;

/** Plans, meets a problem, fetches a file and runs a batch with the generated client; prints what came of it. */
public class Plan {
  static PlanRequest request(String robot) {
    return new PlanRequest()
        .robot(robot)
        .addWaypointsItem(new Waypoint(joint(0.1, 0.2, 0.3)))
        .addWaypointsItem(new Waypoint(joint(0.3, 0.1, 0.5)))
        .backend(new Backend(new QuinticBackend().kind(QuinticBackend.KindEnum.QUINTIC)));
  }

  static JointWaypoint joint(Double... position) {
    return new JointWaypoint().kind(JointWaypoint.KindEnum.JOINT).position(List.of(position));
  }

  public static void main(String[] arguments) throws Exception {
    ApiClient client = new ApiClient();
    client.updateBaseUri(arguments[0]);
    TrajectoriesApi trajectories = new TrajectoriesApi(client);
    PlanAnswer plan = trajectories.planTrajectory(request("three_dof_arm"));
    ProblemDocument problem = null;
    try {
      trajectories.planTrajectory(request("nobody"));
    } catch (ApiException refused) {
      problem = client.getObjectMapper().readValue(refused.getResponseBody(), ProblemDocument.class);
    }
    int lines = Files.readAllLines(trajectories.exportTrajectory("csv", request("three_dof_arm")).toPath()).size();
    BatchesApi batches = new BatchesApi(client);
    BatchRequest body = new BatchRequest().requests(List.of(request("three_dof_arm"), request("nobody")));
    Batch batch = batches.createBatch(body, null);
    while (batch.getStatus() == Batch.StatusEnum.RUNNING) {
      Thread.sleep(100);
      batch = batches.getBatch(batch.getId());
    }
    String statuses = batches.getBatchResults(batch.getId(), null, null, null).getResults().stream()
        .map(result -> '"' + result.getStatus() + '"').collect(Collectors.joining(", "));
    System.out.printf("{\"duration\": %s, \"code\": \"%s\", \"lines\": %d, \"batch\": [%s]}%n",
        plan.getDuration(), problem.getCode(), lines, statuses);
  }
}
