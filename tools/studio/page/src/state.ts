// What the page knows: the program's state, as last told, and its own view of it.
import type { Click, Job, OptionTable, Side, State, StudioObject, Volume } from './protocol';

export type Tool = Side | 'crosshair';
export type Pane = 'axial' | 'coronal' | 'sagittal' | 'solid';
export type MeshColour = 'object' | 'deviation' | 'edge';

export interface View {
  active: number | null;          // the object that clicks belong to
  tool: Tool;
  hidden: Set<number>;            // objects that are not shown
  click: { object: number; index: number } | null;  // the selected click
  candidate: { object: number; number: number } | null;  // the proposal under the mouse
  radiological: boolean;
  crosshair: boolean;             // its lines are drawn
  smooth: boolean;                // voxels are interpolated
  maximised: Pane | null;
  meshColour: MeshColour;
  listFiles: boolean;             // the list of files, although a volume is open
}

export const page = {
  state: null as State | null,
  job: null as Job | null,
  options: null as OptionTable | null,
  connected: false,
  view: {
    active: null, tool: 'inside', hidden: new Set(), click: null, candidate: null,
    radiological: remembered('radiological') !== 'no', crosshair: true, smooth: remembered('smooth') !== 'no',
    maximised: null, meshColour: 'object', listFiles: false,
  } as View,
};

type Listener = () => void;
const listeners: Listener[] = [];
let waiting = false;

export function onChange(listener: Listener): void { listeners.push(listener); }

/** Tells all listeners, once for all changes made in one go. */
export function changed(): void {
  if (waiting) return;
  waiting = true;
  queueMicrotask(() => {
    waiting = false;
    for (const listener of listeners) listener();
  });
}

export function setView(change: Partial<View>): void {
  Object.assign(page.view, change);
  changed();
}

export function setState(state: State, mayBeRestarted: boolean): void {
  // An answer that was overtaken by a later event is of no use.
  if (!mayBeRestarted && page.state && state.revision < page.state.revision) return;
  const view = page.view, click = view.click;
  const selected = click ? object(click.object)?.clicks[click.index] : undefined;
  page.state = state;
  page.job = state.job;
  // Objects of another scan have the numbers of this one's.
  const scan = JSON.stringify([state.volume?.revision, state.volume?.path]);
  if (scan !== shownScan) { shownScan = scan; view.hidden.clear(); }
  if (!state.objects.some((o) => o.id === view.active)) view.active = state.objects.at(-1)?.id ?? null;
  if (click) view.click = placeNow(click, selected);
  changed();
}
let shownScan = '';

/** Where a click stands now: those before it may have gone or come back. */
function placeNow(before: { object: number; index: number }, was: Click | undefined): View['click'] {
  const clicks = object(before.object)?.clicks ?? [], there = clicks[before.index];
  const isIt = (c: Click) => !was || (c.side === was.side && c.point.every((x, k) => x === was.point[k]));
  const index = there && isIt(there) ? before.index : was ? clicks.findIndex(isIt) : -1;
  return index < 0 ? null : { object: before.object, index };
}

export function object(id: number | null | undefined): StudioObject | null {
  return page.state?.objects.find((o) => o.id === id) ?? null;
}
export function activeObject(): StudioObject | null { return object(page.view.active); }
export function volume(): Volume | null { return page.state?.volume ?? null; }

/** Settings of the person, not of the scan; they survive in the browser where it allows that. */
export function remembered(key: string): string | null {
  try { return localStorage.getItem(`surfseg-studio-${key}`); } catch { return null; }
}
export function remember(key: string, value: string): void {
  try { localStorage.setItem(`surfseg-studio-${key}`, value); } catch { /* private windows have no storage */ }
}
