// The page: what is asked on the left, what is seen in the middle, what came out on the right.
import { render } from 'preact';
import './style/base.css';
import './style/layout.css';
import './style/stage.css';
import './style/narrow.css';
import './style/waypoints.css';
import './style/cell.css';
import './style/forms.css';
import './style/panels.css';
import './style/robot.css';
import './style/batch.css';
import { Header } from './panels/Header';
import { Result } from './panels/Result';
import { VerdictLine } from './panels/VerdictLine';
import { Waiting } from './panels/Waiting';
import { Waypoints } from './panels/Waypoints';
import { PlotsView } from './plots/PlotsView';
import { Timeline } from './plots/Timeline';
import { StageView } from './stage/StageView';
import { dragging } from './state/dragging';
import { listenToKeys } from './state/keys';
import { start } from './state/start';
import { language } from './texts';

function Page() {
  return (
    <>
      <Header />
      <main class="page">
        <Waypoints />
        <div class="middle">
          <VerdictLine />
          <StageView dragging={dragging} />
          <Timeline />
          <PlotsView />
        </div>
        <Result />
        <Waiting />
      </main>
    </>
  );
}

document.documentElement.lang = language;
render(<Page />, document.getElementById('app')!);
listenToKeys();
void start();
