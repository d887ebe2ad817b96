// The keyboard. Fields and dialogs keep their own keys.
import { addObject, click, deleteClick, evolve, moveClick, redo, stop, toggleHidden, undo } from './actions';
import { openExport } from './export';
import { SLICE_NAMES, type SliceName } from './geometry';
import { openHelp } from './help';
import { maximise, PANES } from './panes';
import { act } from './server';
import { activeObject, page, setView, volume } from './state';
import { cancelDrag, crosshairWorld, draw, isBlind, lookAt, nudge, resetView, step, zoom } from './slices';
import { drawSolid, resetSolid, turn, zoomSolid } from './solid';
import { switchTheme } from './theme';
import { nextPreset } from './window_level';
import { setRadiological, setTool } from './tools';

function focusedPane(): SliceName | 'solid' {
  const id = document.activeElement?.closest('.pane')?.id.replace('pane-', '');
  if (id === 'solid' || SLICE_NAMES.includes(id as SliceName)) return id as SliceName | 'solid';
  return page.view.maximised ?? 'axial';
}

function nextClick(by: number): void {
  const o = activeObject();
  if (!o?.clicks.length) return;
  const now = page.view.click?.object === o.id ? page.view.click.index : by > 0 ? -1 : 0;
  const index = (now + by + o.clicks.length) % o.clicks.length;
  setView({ click: { object: o.id, index } });
  lookAt(o.clicks[index].point);
}

function nextObject(): void {
  const objects = page.state?.objects ?? [];
  if (!objects.length) return;
  const now = objects.findIndex((o) => o.id === page.view.active);
  setView({ active: objects[(now + 1) % objects.length].id, click: null });
}

function nextCandidate(): void {
  const o = activeObject();
  if (!o?.candidates.length) return;
  const now = o.candidates.findIndex((c) => c.chosen);
  void act({ action: 'choose', object: o.id, number: o.candidates[(now + 1) % o.candidates.length].number });
}

function clickHere(other: boolean): void {
  const world = crosshairWorld();
  if (!world || page.view.tool === 'crosshair' || isBlind()) return;
  void click(world, (page.view.tool === 'inside') === other ? 'outside' : 'inside');
}

function arrow(right: number, upwards: number): void {
  const pane = focusedPane();
  if (pane === 'solid') turn(right * 0.1, -upwards * 0.1);
  else nudge(pane, right, upwards);
}

function page_(slices: number): void {
  const pane = focusedPane();
  if (pane !== 'solid') step(pane, slices);
}

function zoomBy(factor: number): void { if (focusedPane() === 'solid') zoomSolid(factor); else zoom(factor); }

const KEYS: Record<string, (event: KeyboardEvent) => void> = {
  i: () => setTool('inside'), o: () => setTool('outside'), c: () => setTool('crosshair'),
  ArrowLeft: () => arrow(-1, 0), ArrowRight: () => arrow(1, 0), ArrowUp: () => arrow(0, 1), ArrowDown: () => arrow(0, -1),
  PageUp: (e) => page_(e.shiftKey ? 10 : 1), PageDown: (e) => page_(e.shiftKey ? -10 : -1),
  Enter: (e) => clickHere(e.shiftKey),
  '[': () => nextClick(-1), ']': () => nextClick(1),
  Delete: () => { const c = page.view.click; if (c) void deleteClick(c.object, c.index); },
  m: () => { const c = page.view.click, here = crosshairWorld(); if (c && here) void moveClick(c.object, c.index, here); },
  Backspace: () => { const c = page.view.click; if (c) void deleteClick(c.object, c.index); },
  Escape: () => {
    if (cancelDrag()) return;
    if (page.job) void stop();
    else setView({ click: null, listFiles: false });
  },
  g: () => { void evolve(); }, p: nextCandidate,
  a: () => { void addObject(); }, n: nextObject,
  h: () => { if (page.view.active !== null) toggleHidden(page.view.active); },
  x: () => { setView({ crosshair: !page.view.crosshair }); draw({}); drawSolid(); },
  d: () => { const place = activeObject()?.verdict?.place; if (place) lookAt(place); },
  w: nextPreset, r: () => setRadiological(!page.view.radiological),
  '+': () => zoomBy(1.25), '=': () => zoomBy(1.25), '-': () => zoomBy(0.8), '0': () => { resetView(); resetSolid(); },
  e: openExport, l: () => { if (volume()) setView({ listFiles: !page.view.listFiles }); }, t: switchTheme, '?': openHelp,
};
PANES.forEach((pane, k) => { KEYS[String(k + 1)] = () => maximise(pane); });

export function startKeys(): void {
  document.addEventListener('keydown', (event) => {
    const target = event.target as HTMLElement;
    if (document.querySelector('dialog[open]')) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    const typing = target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement
      || (target instanceof HTMLInputElement && !['range', 'color', 'checkbox'].includes(target.type));
    if (typing) return;
    if ((event.ctrlKey || event.metaKey) && !event.altKey) {
      if (key === 'z') { event.preventDefault(); void (event.shiftKey ? redo() : undo()); }
      if (key === 'y') { event.preventDefault(); void redo(); }
      return;
    }
    if (event.altKey) return;
    // Enter and arrows belong to the control that has the focus, where it is one.
    const control = target instanceof HTMLButtonElement || target instanceof HTMLInputElement || target instanceof HTMLAnchorElement;
    if (control && (key === 'Enter' || key === ' ' || (target instanceof HTMLInputElement && key.startsWith('Arrow')))) return;
    const action = KEYS[key];
    if (!action) return;
    event.preventDefault();
    action(event);
  });
}
