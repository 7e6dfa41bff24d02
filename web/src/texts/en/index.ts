// All English texts.
import { ofBatch } from './batch';
import { ofCells } from './cells';
import { ofFields } from './fields';
import { ofMessages } from './messages';
import { ofMotion } from './motion';
import { ofPage } from './page';
import { ofReports } from './reports';
import { ofResult } from './result';
import { ofRobot } from './robot';
import { ofScene } from './scene';
import { ofWaypoints } from './waypoints';

export const english = {
  ...ofPage,
  ...ofMessages,
  ...ofMotion,
  ...ofWaypoints,
  ...ofFields,
  ...ofResult,
  ...ofRobot,
  ...ofScene,
  ...ofCells,
  ...ofBatch,
  ...ofReports,
};
