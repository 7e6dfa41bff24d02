// The names of the service's schemas that the page uses, generated from the OpenAPI document (npm run types).
import type { components } from './openapi';

type Schemas = components['schemas'];

export type PlanRequest = Schemas['PlanRequest'];
export type Waypoint = Schemas['Waypoint'];
export type JointWaypoint = Schemas['JointWaypoint'];
export type PoseWaypoint = Schemas['PoseWaypoint'];
export type RelativeWaypoint = Schemas['RelativeWaypoint'];
export type Motion = Schemas['Motion'];
export type Transition = Schemas['Transition'];
export type Pose = Schemas['Pose'];
export type Limits = Schemas['Limits'];
export type Include = Schemas['Include'];
export type Backend = Schemas['Backend'];
export type BackendDescription = Schemas['BackendDescription'];
export type PlanAnswer = Schemas['PlanAnswer'];
export type PlannedWaypoint = Schemas['PlannedWaypoint'];
export type Samples = Schemas['Samples'];
export type Check = Schemas['Check'];
export type Problem = Schemas['ProblemDocument'];
export type Remedy = Schemas['RemedyAnswer'];
export type ComparedBackend = Schemas['ComparedBackend'];
export type RobotSummary = Schemas['RobotSummary'];
export type Robot = Schemas['RobotDescription'];
export type LinkShape = Schemas['LinkShape'];
export type Scene = Schemas['Scene'];
export type SceneShape = Schemas['SceneShape'];
export type Clearance = Schemas['ClearanceAnswer'];
export type Finding = Schemas['ModelFinding'];
export type Batch = Schemas['Batch'];
export type Grid = Schemas['Grid'];
export type BatchEntry = Schemas['BatchEntry'];
export type Joint = Schemas['JointDescription'];
export type Placement = Schemas['Placement'];
export type WorkspaceAnswer = Schemas['WorkspaceAnswer'];
export type Solution = Schemas['JointSolution'];
