// A report: one file that anyone can open. It holds a plan or a batch, and shows it with the parts of the page.
import { render } from 'preact';
import '../style/base.css';
import '../style/layout.css';
import '../style/stage.css';
import '../style/narrow.css';
import '../style/waypoints.css';
import '../style/panels.css';
import '../style/batch.css';
import '../style/report.css';
import '../style/batch_report.css';
import type { ReportedBatch } from './batch';
import { BatchReport } from './BatchReport';
import type { ReportedPlan } from './PlanReport';
import { language } from '../texts';
import { PlanReport } from './PlanReport';

document.documentElement.lang = language;
const app = document.getElementById('app')!;
const plan = document.getElementById('plan');
const batch = document.getElementById('batch');
if (plan) render(<PlanReport {...(JSON.parse(plan.textContent) as ReportedPlan)} />, app);
if (batch) render(<BatchReport {...(JSON.parse(batch.textContent) as ReportedBatch)} />, app);
