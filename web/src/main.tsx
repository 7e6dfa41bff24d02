import './style.css';
import { render } from 'preact';

render(<p>Trajectory planner</p>, document.getElementById('app')!);
