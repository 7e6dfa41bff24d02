// Every English text of the page, by subject, so that another language is one more folder.
import { ofBatch } from './batch';
import { ofFields } from './fields';
import { ofMotion } from './motion';
import { ofPage } from './page';
import { ofReports } from './reports';
import { ofResult } from './result';
import { ofRobot } from './robot';
import { ofWaypoints } from './waypoints';

export const texts = { ...ofPage, ...ofMotion, ...ofWaypoints, ...ofFields, ...ofResult, ...ofRobot, ...ofBatch, ...ofReports };
