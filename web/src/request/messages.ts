// Refusals and warnings in the language of the page: built from codes and fields, in the units that a person chose.
import { titleOf, unitOfQuantity } from '../plan/quantities';
import { unitOf, written } from '../plan/units';
import measures from '../service/quantities.json';
import type { Finding, Joint, Problem } from '../service/types';
import { texts } from '../texts';

export interface Message {
  title: string;
  sentences: readonly string[];
  original: readonly string[]; // the service's own text, where it is not what is shown
}

export function messageOf(problem: Problem, joints: readonly Joint[] = []): Message {
  const { title, detail } = problem;
  const own = texts.messages.refusals[problem.status === 0 ? 'no_answer' : problem.code];
  if (!own) return { title, sentences: [detail], original: [] };
  const isHelped = Boolean(problem.remedies?.length);
  const sentences = [figuresOf(problem, joints) ?? own.cause, searchOf(problem), isHelped ? null : own.remedy];
  return { title: own.title, sentences: sentences.filter((one) => one !== null), original: [`${title}: ${detail}`] };
}

// The title of a refusal by its code in the language of the page; null: the service's own message is shown.
export function refusalOf(code: string): string | null {
  return texts.messages.refusals[code]?.title ?? null;
}

function searchOf({ enclosed_by, checks }: Problem): string | null {
  if (enclosed_by?.length) return texts.messages.enclosed(enclosed_by);
  return typeof checks === 'number' ? texts.messages.searched(checks) : null;
}

// The value and its limit, where their unit is known.
function figuresOf(problem: Problem, joints: readonly Joint[]): string | null {
  const { code, value, limit } = problem;
  const joint = joints.find(({ name }) => name === problem.joint);
  const quantity = code === 'limits_unsatisfiable' ? quantityOf(problem.detail) : null;
  const unit = quantity === null ? UNITS[code]?.(joint) : unitOfQuantity(quantity, joint);
  const say = texts.messages.figures[code];
  if (!say || !unit || typeof value !== 'number' || typeof limit !== 'number') return null;
  const [shown, most] = distinct(value, limit, unit);
  return say({ joint: problem.joint ?? null, quantity: quantity && titleOf(quantity), value: shown, limit: most });
}

const UNITS: Readonly<Record<string, (joint: Joint | undefined) => string | null>> = {
  infeasible_duration: () => 's',
  payload_exceeded: () => 'kg',
  joint_position_limit: (joint) => (joint ? unitOf(joint, 'position') : null),
};

// The quantity that a refusal of the certificate names: its detail is made from the quantity's name.
function quantityOf(detail: string): string | null {
  const [, name] = /^the (?:requested )?([a-z ]+?)(?: of \S+)? (?:would reach|at waypoint|is) /.exec(detail) ?? [];
  const quantity = name?.replaceAll(' ', '_') ?? '';
  return quantity in measures ? quantity : null;
}

// Two numbers with as many digits as distinguish them.
function distinct(value: number, limit: number, unit: string): [string, string] {
  for (let digits = 4; digits < 12; digits += 1) {
    const found = [written(value, unit, digits), written(limit, unit, digits)] as [string, string];
    if (found[0] !== found[1]) return found;
  }
  return [written(value, unit, 12), written(limit, unit, 12)];
}

// A text in the language of the page, and the service's own where it is another.
export interface Said {
  text: string;
  original: string | null;
}

export function warningOf({ code, message }: { code: string; message: string }): Said {
  const own = texts.messages.warnings[code];
  return own ? { text: own, original: message } : { text: message, original: null };
}

export function noteOf(note: string): Said {
  for (const [pattern, say] of texts.messages.notes) {
    const found = pattern.exec(note);
    if (found) return { text: say(...found.slice(1)), original: note };
  }
  return { text: note, original: null };
}

export function robotNoteOf(note: string): Said {
  const own = texts.messages.robotNotes[note];
  return own ? { text: own, original: note } : { text: note, original: null };
}

export interface SaidFindings {
  severity: string;
  text: string;
  original: readonly string[];
}

// Findings that differ only in the joint or link are one; in another language also those that differ in numbers.
export function findingsOf(findings: readonly Finding[]): SaidFindings[] {
  const kinds = new Map<string, Finding[]>();
  for (const finding of findings) {
    const { code, severity, subject, message } = finding;
    const key = [severity, code, texts.messages.findings[code] ? '' : message.replace(subject ?? '', '')].join('\n');
    kinds.set(key, [...(kinds.get(key) ?? []), finding]);
  }
  return [...kinds.values()].map((alike) => saidFindings(alike[0]!, alike));
}

function saidFindings({ severity, code, message }: Finding, alike: readonly Finding[]): SaidFindings {
  const own = texts.messages.findings[code];
  const subjects = [...new Set(alike.flatMap(({ subject }) => subject ?? []))];
  if (own) return { severity, text: [subjects.join(', '), own].filter(Boolean).join(': '), original: alike.map((one) => one.message) };
  const others = subjects.slice(1);
  return { severity, text: others.length > 0 ? `${message} ${texts.messages.likewise(others)}` : message, original: [] };
}
