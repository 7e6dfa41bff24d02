// The names of the service's schemas that the page uses, generated from the OpenAPI document (npm run types).
import type { components, paths } from './openapi';

type Schemas = components['schemas'];

// On the page, the request of a robot in a cell carries the rest of the cell (request/cells.ts).
export type PlanRequest = Omit<Schemas['PlanRequest'], 'waypoints'> & { waypoints: Waypoint[]; cell?: RestOfCell };
export type CellMember = Omit<Schemas['CellMember'], 'waypoints'> & { waypoints: Waypoint[] };
export type CellRequest = Omit<Schemas['CellRequest'], 'robots'> & { robots: CellMember[] };
export type CellAnswer = Schemas['CellAnswer'];
export interface RestOfCell {
  name: string; // of the robot that is shown
  index: number; // of that robot in the cell
  others: readonly CellMember[];
  held?: Pick<CellMember, 'attached' | 'allowed_pairs'>; // of that robot, beside a scene that the service keeps
  rules: CellRules;
}
export type CellRules = Pick<CellRequest, 'margin' | 'allowed_pairs' | 'meetings' | 'skew'>;
// A goal set has none of the other fields of waypoints: its options have them.
export type GoalSet = Schemas['GoalSet'] & Partial<Omit<Schemas['JointWaypoint'], 'kind' | 'name' | 'position' | 'actions'>>;
export type Waypoint = Schemas['SingleWaypoint'] | GoalSet;
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
export type OrderRequest = Schemas['OrderRequest'];
export type PlannedWaypoint = Schemas['PlannedWaypoint'];
export type Samples = Schemas['Samples'];
export type Check = Schemas['Check'];
export type Problem = Schemas['ProblemDocument'];
export type Remedy = Schemas['RemedyAnswer'];
export type ComparedBackend = Schemas['ComparedBackend'];
export type PathFileRequest = Schemas['PathFileRequest'];
export type RobotUpload = Schemas['RobotDefinition'];
export type RobotSummary = Schemas['RobotSummary'];
export type Robot = Schemas['RobotDescription'];
export type LinkShape = Schemas['LinkShape'];
export type Scene = Schemas['Scene'];
export type SceneShape = Schemas['SceneShape'];
export type SceneObject = Schemas['SceneObject'];
export type SceneSummary = Schemas['SceneSummary'];
export type ProjectSummary = Schemas['ProjectSummary'];
export type OptionOutcome = Schemas['OptionOutcome'];
export type Clearance = Schemas['ClearanceAnswer'];
export type Finding = Schemas['ModelFinding'];
export type Batch = Schemas['Batch'];
export type Grid = Schemas['Grid'];
export type BatchEntry = Schemas['BatchEntry'];
export type Joint = Schemas['JointDescription'];
export type Placement = Schemas['Placement'];
export type WorkspaceAnswer = Schemas['WorkspaceAnswer'];
export type Solution = Schemas['JointSolution'];
export type InverseKinematicsRequest = Schemas['InverseKinematicsRequest'];
export type InverseKinematicsResult = Schemas['InverseKinematicsResult'];
export type PositionCollision = Schemas['PositionCollision'];
export type AttachedObject = Schemas['AttachedObject'];
export type FreeMotion = Schemas['FreeMotion'];
export type PoseConstraint = Schemas['PoseConstraint'];
export type WayGain = Schemas['WayGain'];
export type SpeedZone = Schemas['SpeedZone'];
export type SpeedZoneAnswer = Schemas['SpeedZoneAnswer'];
export type PlanFormat = NonNullable<paths['/v1/trajectories/export']['post']['parameters']['query']>['format'];
