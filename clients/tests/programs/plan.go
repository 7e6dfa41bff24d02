// Plans, meets a problem, fetches a file and runs a batch with the generated client; prints what came of it.
package main

import (
	"bytes"
	"context"
	"encoding/json"
	"errors"
	"fmt"
	"io"
	"log"
	"os"
	"time"

	planner "example.com/planner/client"
)

func request(robot string) planner.PlanRequest {
	var waypoints []planner.Waypoint
	for _, position := range [][]float64{{0.1, 0.2, 0.3}, {0.3, 0.1, 0.5}} {
		waypoints = append(waypoints, planner.JointWaypointAsWaypoint(planner.NewJointWaypoint("joint", position)))
	}
	made := planner.NewPlanRequest(robot, waypoints)
	made.SetBackend(planner.QuinticBackendAsBackend(planner.NewQuinticBackend("quintic")))
	return *made
}

func must[T any](answer T, err error) T {
	if err != nil {
		log.Fatal(err)
	}
	return answer
}

func main() {
	configuration := planner.NewConfiguration()
	configuration.Servers = planner.ServerConfigurations{{URL: os.Args[1]}}
	client, always := planner.NewAPIClient(configuration), context.Background()

	plan, _, err := client.TrajectoriesAPI.PlanTrajectory(always).PlanRequest(request("three_dof_arm")).Execute()
	must(plan, err)
	_, _, err = client.TrajectoriesAPI.PlanTrajectory(always).PlanRequest(request("nobody")).Execute()
	var refused *planner.GenericOpenAPIError
	if !errors.As(err, &refused) {
		log.Fatal("there is no problem")
	}
	problem := refused.Model().(planner.ProblemDocument)
	file, _, err := client.TrajectoriesAPI.ExportTrajectory(always).Format("csv").
		PlanRequest(request("three_dof_arm")).Execute()
	content := must(io.ReadAll(must(file, err)))

	body := planner.NewBatchRequest()
	body.SetRequests([]planner.PlanRequest{request("three_dof_arm"), request("nobody")})
	batch, _, err := client.BatchesAPI.CreateBatch(always).BatchRequest(*body).Execute()
	for must(batch, err).Status == "running" {
		time.Sleep(100 * time.Millisecond)
		batch, _, err = client.BatchesAPI.GetBatch(always, batch.Id).Execute()
	}
	results, _, err := client.BatchesAPI.GetBatchResults(always, batch.Id).Execute()
	var statuses []string
	for _, result := range must(results, err).Results {
		statuses = append(statuses, result.Status)
	}
	shown := map[string]any{
		"duration": plan.Duration, "code": problem.Code, "lines": bytes.Count(content, []byte("\r\n")), "batch": statuses,
	}
	fmt.Println(string(must(json.Marshal(shown))))
}
