// The three slices: NiiVue draws the volume, a canvas over it the outlines, clicks and crosshair; mouse and wheel.
import type { Niivue } from '@niivue/niivue';
import type { Click, Point } from './protocol';
import { byId } from './dom';
import { type Camera, type Rectangle, SLICES, type SliceName, SliceView } from './geometry';
import { GRAPHICS_LOST, showError } from './messages';
import { object, page, setView } from './state';
import { drawCrosshair, drawLetters, drawMark, drawOutline, drawScale } from './slice_drawing';
import type { Surface } from './surface';
import { surfaces } from './surfaces';
import { LoadedVolume, makeNiivue, readVolume } from './volume';
import type { Volume } from './protocol';

export interface SliceListener {
  /** A press and release at one place: a click of the object, or only a look (the crosshair's tool). */
  click(world: Point, side: 'inside' | 'outside'): void;
  moveClick(objectId: number, index: number, world: Point, was: Point): void;
  hover(world: Point | null, value: number | null): void;
  moved(): void;  // the crosshair
  window(low: number, high: number): void;
}

type Drag =
  | { kind: 'press'; x: number; y: number; view: SliceView; shift: boolean; look: boolean; moved: boolean }
  | { kind: 'click'; object: number; index: number; view: SliceView; x: number; y: number; moved: boolean; at: Point; was: Point }
  | { kind: 'pan'; x: number; y: number; view: SliceView; centre: Point }
  | { kind: 'window'; x: number; y: number; low: number; high: number };

const MARK_RADIUS = 6;

let nv: Niivue;
let started = false;
let listener: SliceListener;
export let loaded: LoadedVolume | null = null;
let views: SliceView[] = [];
const camera: Camera = { centre: [0, 0, 0], zoom: 1 };
let crosshair: Point = [0.5, 0.5, 0.5];  // fractions
export let range: [number, number] = [0, 1];  // the window: values of black and white
let drag: Drag | null = null;
let hovered: { object: number; index: number } | null = null;
let dirty = { volume: false, overlay: false, window: false };
let scheduled = false;
let rectangles = new Map<SliceName, Rectangle>();
let wheelRest = 0;

const stage = () => byId('views');
const overlay = () => byId<HTMLCanvasElement>('overlay');

export async function startSlices(l: SliceListener): Promise<void> {
  listener = l;
  nv = await makeNiivue(byId<HTMLCanvasElement>('slices'));
  // What NiiVue draws by itself (after a change of its volume) goes the same way as ours.
  nv.drawScene = () => { draw({ volume: true }); };
  nv.screenFieldOfViewExtendedVox = (type = 0) => {
    const { low, high } = views.find((view) => view.type === type)!.field();
    return { mnMM: low, mxMM: high, rotation: new Float32Array(16),
      fovMM: low.map((x, k) => high[k] - x) } as unknown as ReturnType<Niivue['screenFieldOfViewExtendedVox']>;
  };
  started = true;
  byId('slices').addEventListener('webglcontextlost', () => showError(GRAPHICS_LOST));
  const top = overlay();
  top.addEventListener('pointerdown', down);
  top.addEventListener('pointermove', move);
  top.addEventListener('pointerup', up);
  top.addEventListener('pointercancel', () => { cancelDrag(); });
  top.addEventListener('pointerleave', () => { if (!drag) { hovered = null; listener.hover(null, null); } });
  top.addEventListener('contextmenu', (event) => event.preventDefault());
  top.addEventListener('wheel', wheel, { passive: false });
  // The middle button would start the browser's own scrolling.
  top.addEventListener('mousedown', (event) => { if (event.button === 1) event.preventDefault(); });
}

/** Shows a volume that has come, in the window the program proposes, if it is still wanted once it is read; whether it was. */
export async function showVolume(buffer: ArrayBuffer, about: Volume, isWanted: () => boolean): Promise<boolean> {
  const next = await readVolume(buffer, about);
  if (!isWanted()) return false;
  for (const old of [...nv.volumes]) nv.removeVolume(old);
  loaded = null;
  const proposed = about.window;
  range = proposed ? [proposed[0], proposed[1]] : [next.image.cal_min ?? about.minimum, next.image.cal_max ?? about.maximum];
  next.image.cal_min = range[0];
  next.image.cal_max = range[1];
  nv.opts.isNearestInterpolation = !page.view.smooth;
  nv.addVolume(next.image);
  loaded = next;
  crosshair = next.snapped([0.5, 0.5, 0.5]);
  resetView();
  draw({ volume: true });
  return true;
}

export function dropVolume(): void {
  if (loaded) for (const old of [...nv.volumes]) nv.removeVolume(old);
  loaded = null;
}

export function layOut(panes: Map<SliceName, Rectangle>): void {
  rectangles = panes;
  const ratio = window.devicePixelRatio || 1;
  const { clientWidth, clientHeight } = stage();
  for (const id of ['slices', 'overlay']) {
    const canvas = byId<HTMLCanvasElement>(id);
    const w = Math.max(1, Math.round(clientWidth * ratio)), t = Math.max(1, Math.round(clientHeight * ratio));
    if (canvas.width !== w || canvas.height !== t) { canvas.width = w; canvas.height = t; }
  }
  draw({ volume: true });
}

export function draw(what: { volume?: boolean; overlay?: boolean; window?: boolean }): void {
  dirty.volume ||= !!what.volume;
  dirty.window ||= !!what.window;
  dirty.overlay = true;
  if (scheduled || !started) return;
  scheduled = true;
  requestAnimationFrame(() => {
    scheduled = false;
    const now = dirty;
    dirty = { volume: false, overlay: false, window: false };
    makeViews();
    if (now.window && loaded) {
      loaded.image.cal_min = range[0];
      loaded.image.cal_max = range[1];
      nv.updateGLVolume();  // also asks for a drawing, which comes with the next frame
      dirty.volume = false;
    }
    if (now.volume || now.window) drawVolume();
    drawOverlay();
  });
}

function makeViews(): void {
  views = loaded ? [...rectangles].map(([name, r]) => new SliceView(name, r, loaded!, camera, page.view.radiological)) : [];
}

function drawVolume(): void {
  const gl = nv.gl;
  gl.viewport(0, 0, gl.canvas.width, gl.canvas.height);
  gl.disable(gl.SCISSOR_TEST);
  gl.clearColor(0, 0, 0, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  if (!loaded) return;
  const ratio = window.devicePixelRatio || 1;
  nv.opts.isRadiologicalConvention = page.view.radiological;
  nv.scene.crosshairPos = crosshair as unknown as Niivue['scene']['crosshairPos'];
  nv.screenSlices = [];
  for (const view of views) {
    const r = view.rectangle;
    nv.draw2DMain([r.left, r.top, r.width, r.height].map((x) => x * ratio), view.type, NaN);
  }
}

// ---- the overlay

function drawOverlay(): void {
  const canvas = overlay(), c = canvas.getContext('2d')!;
  const ratio = window.devicePixelRatio || 1;
  c.setTransform(1, 0, 0, 1, 0, 0);
  c.clearRect(0, 0, canvas.width, canvas.height);
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  if (!loaded) return;
  for (const view of views) {
    const r = view.rectangle;
    c.save();
    c.beginPath();
    c.rect(r.left, r.top, r.width, r.height);
    c.clip();
    drawOutlines(c, view);
    if (page.view.crosshair) drawCrosshair(c, view, crosshair);
    drawClicks(c, view);
    drawLetters(c, view);
    drawScale(c, view);
    c.restore();
  }
}

function drawOutlines(c: CanvasRenderingContext2D, view: SliceView): void {
  for (const o of page.state?.objects ?? []) {
    const surface = surfaces.get(o.id);
    if (!surface || page.view.hidden.has(o.id)) continue;
    surface.fractions ??= loaded!.fractions(surface.points);
    drawOutline(c, view, crosshair, surface.fractions, surface.triangles,
      { colour: o.colour, width: o.id === page.view.active ? 2 : 1.25, dash: [] });
  }
  const preview = previewed;
  if (preview && page.view.candidate) {
    const o = object(page.view.candidate.object);
    preview.fractions ??= loaded!.fractions(preview.points);
    drawOutline(c, view, crosshair, preview.fractions, preview.triangles, { colour: o?.colour ?? '#ffffff', width: 1.5, dash: [5, 4] });
  }
}

let previewed: (Surface & { fractions: Float32Array | null }) | null = null;
/** The outline of a proposal, dashed, while the mouse is over it. */
export function preview(surface: Surface | null): void {
  previewed = surface && { ...surface, fractions: null };
  draw({});
}

interface Mark { object: number; index: number; click: Click; x: number; y: number; slices: number }

/** The clicks that a slice shows: those in it, and paler those up to three slices away. */
function marks(view: SliceView): Mark[] {
  const found: Mark[] = [];
  for (const o of page.state?.objects ?? []) {
    if (page.view.hidden.has(o.id)) continue;
    o.clicks.forEach((click, index) => {
      const dragged = drag?.kind === 'click' && drag.moved && drag.object === o.id && drag.index === index;
      const fraction = dragged ? (drag as { at: Point }).at : loaded!.fraction(click.point);
      const slices = Math.abs(fraction[view.normal] - crosshair[view.normal]) * loaded!.size[view.normal];
      if (slices > 3.5) return;
      const [x, y] = view.pixelOf(fraction);
      found.push({ object: o.id, index, click, x, y, slices });
    });
  }
  return found;
}

function drawClicks(c: CanvasRenderingContext2D, view: SliceView): void {
  for (const mark of marks(view)) {
    const mine = mark.object === page.view.active;
    const chosen = page.view.click?.object === mark.object && page.view.click.index === mark.index;
    const near = hovered?.object === mark.object && hovered.index === mark.index;
    c.globalAlpha = (mine ? 1 : 0.6) * (mark.slices < 0.75 ? 1 : 0.55 - 0.1 * mark.slices);
    drawMark(c, mark.x, mark.y, mark.click.side, mine ? MARK_RADIUS : MARK_RADIUS - 2, chosen || near);
    c.globalAlpha = 1;
  }
}

// ---- looking around

/** The graphics have gone: what is clicked cannot be seen. */
export function isBlind(): boolean { return nv.gl.isContextLost(); }
export function crosshairWorld(): Point | null { return loaded ? loaded.world(crosshair) : null; }
export function crosshairFraction(): Point { return [...crosshair]; }

/** Where a slice is among the others, from 1, and how many there are. */
export function sliceNumber(name: SliceName): [number, number] {
  const k = SLICES[name].normal, n = loaded?.size[k] ?? 0;
  return [Math.floor(crosshair[k] * n) + 1, n];
}

export function setCrosshair(fraction: Point): void {
  if (!loaded) return;
  const next = loaded.snapped(fraction);
  if (next.every((x, k) => x === crosshair[k])) return;
  crosshair = next;
  draw({ volume: true });
  listener.moved();
}

/** Moves the crosshair to a point, and the panes if it would lie outside of what they show. */
export function lookAt(world: Point): void {
  if (!loaded) return;
  const fraction = loaded.fraction(world).map((x) => Math.max(0, Math.min(1, x))) as Point;
  setCrosshair(fraction);
  makeViews();
  const seen = views.every((view) => view.contains(...view.pixelOf(fraction)));
  if (!seen) camera.centre = loaded.ortho(fraction);
  draw({ volume: true });
}

export function step(name: SliceName, slices: number): void {
  if (!loaded) return;
  const k = SLICES[name].normal, next = [...crosshair] as Point;
  next[k] += slices / loaded.size[k];
  setCrosshair(next.map((x) => Math.max(0, Math.min(1, x))) as Point);
}

/** Moves the crosshair by voxels, to the right and upwards as the slice is seen. */
export function nudge(name: SliceName, right: number, upwards: number): void {
  if (!loaded) return;
  const { h, v } = SLICES[name], next = [...crosshair] as Point;
  const mirror = page.view.radiological && h === 0 ? -1 : 1;
  next[h] += mirror * right / loaded.size[h];
  next[v] += upwards / loaded.size[v];
  setCrosshair(next.map((x) => Math.max(0, Math.min(1, x))) as Point);
}

export function setSlice(name: SliceName, slice: number): void {
  if (!loaded) return;
  const k = SLICES[name].normal, next = [...crosshair] as Point;
  next[k] = (slice - 0.5) / loaded.size[k];
  setCrosshair(next);
}

export function zoom(factor: number, fixed: Point | null = null): void {
  if (!loaded) return;
  const at = fixed ?? loaded.ortho(crosshair);
  const next = Math.max(0.5, Math.min(40, camera.zoom * factor)), f = camera.zoom / next;
  camera.centre = camera.centre.map((c, k) => at[k] + (c - at[k]) * f) as Point;
  camera.zoom = next;
  draw({ volume: true });
}

export function resetView(): void {
  if (!loaded) return;
  camera.zoom = 1;
  camera.centre = loaded.low.map((x, k) => (x + loaded!.high[k]) / 2) as Point;
  draw({ volume: true });
}

export function setRange(low: number, high: number): void {
  const width = Math.max(high - low, 1e-6 * Math.max(1, Math.abs(low)));
  range = [low, low + width];
  draw({ window: true });
}

export function setSmooth(smooth: boolean): void {
  nv.setInterpolation(!smooth);
  draw({ volume: true });
}

// ---- the mouse

function at(event: MouseEvent): [number, number] {
  const r = overlay().getBoundingClientRect();
  return [event.clientX - r.left, event.clientY - r.top];
}
function viewAt(x: number, y: number): SliceView | undefined { return views.find((view) => view.contains(x, y)); }
function markAt(view: SliceView, x: number, y: number): Mark | undefined {
  const near = marks(view).filter((m) => Math.hypot(m.x - x, m.y - y) <= MARK_RADIUS + 3);
  const mine = near.filter((m) => m.object === page.view.active);
  return (mine.length ? mine : near).sort((a, b) => a.slices - b.slices || Math.hypot(a.x - x, a.y - y) - Math.hypot(b.x - x, b.y - y))[0];
}

function down(event: PointerEvent): void {
  const [x, y] = at(event), view = viewAt(x, y);
  if (!view || drag || isBlind()) return;
  event.preventDefault();
  byId(`pane-${view.name}`).focus({ preventScroll: true });
  overlay().setPointerCapture(event.pointerId);
  if (event.button === 1) drag = { kind: 'pan', x, y, view, centre: [...camera.centre] as Point };
  else if (event.button === 2) drag = { kind: 'window', x, y, low: range[0], high: range[1] };
  else if (event.button === 0) {
    const mark = markAt(view, x, y);
    if (mark && !event.ctrlKey) {
      drag = { kind: 'click', object: mark.object, index: mark.index, view, x, y, moved: false,
        at: loaded!.fraction(mark.click.point), was: mark.click.point };
      setView({ click: { object: mark.object, index: mark.index }, active: mark.object });
    } else
      drag = { kind: 'press', x, y, view, shift: event.shiftKey, look: event.ctrlKey || event.metaKey, moved: false };
  }
}

function move(event: PointerEvent): void {
  const [x, y] = at(event);
  if (!loaded) return;
  if (!drag) { hover(x, y); return; }
  const far = 'moved' in drag && (drag.moved || Math.hypot(x - drag.x, y - drag.y) > 3);
  if (drag.kind === 'press' && far) {
    drag.moved = true;
    const fraction = drag.view.fraction(x, y, crosshair);
    setCrosshair(fraction.map((f) => Math.max(0, Math.min(1, f))) as Point);
  } else if (drag.kind === 'click' && far) {
    drag.moved = true;
    const fraction = drag.view.fraction(x, y, drag.at);
    if (loaded.isInside(fraction)) drag.at = fraction;
    draw({});
  } else if (drag.kind === 'pan') {
    const from = drag.view.ortho(drag.x, drag.y, crosshair), to = drag.view.ortho(x, y, crosshair);
    camera.centre = camera.centre.map((_, k) => (drag as { centre: Point }).centre[k]) as Point;
    for (const k of [drag.view.h, drag.view.v]) camera.centre[k] += from[k] - to[k];
    draw({ volume: true });
  } else if (drag.kind === 'window') {
    const about = loaded.about, width = drag.high - drag.low;
    // A right drag across a pane doubles or halves the width; up and down move the level by it.
    const next = Math.max(width * 2 ** ((x - drag.x) / 200), (about.maximum - about.minimum) / 4096);
    const level = (drag.low + drag.high) / 2 + (drag.y - y) / 300 * Math.max(width, next);
    setRange(level - next / 2, level + next / 2);
    listener.window(range[0], range[1]);
  }
  tell(x, y);
}

function up(event: PointerEvent): void {
  const done = drag;
  drag = null;
  if (!done || !loaded) return;
  const [x, y] = at(event);
  if (done.kind === 'press' && !done.moved) {
    const fraction = done.view.fraction(x, y, crosshair);
    if (!loaded.isInside(fraction)) { setView({ click: null }); return; }
    const world = loaded.world(fraction);
    setCrosshair(fraction);
    if (!done.look && page.view.tool !== 'crosshair')
      // Shift turns the tool round, so that one hand on the keyboard is enough with either.
      listener.click(world, (page.view.tool === 'inside') === done.shift ? 'outside' : 'inside');
    else setView({ click: null });
  } else if (done.kind === 'click' && done.moved) listener.moveClick(done.object, done.index, loaded.world(done.at), done.was);
  draw({});
}

/** Esc during a drag: all stays as it was. */
export function cancelDrag(): boolean {
  const was = drag;
  drag = null;
  if (was?.kind === 'window') { setRange(was.low, was.high); listener.window(range[0], range[1]); }
  if (was?.kind === 'pan') camera.centre = was.centre;
  if (was) draw({ volume: true });
  return was !== null;
}

function hover(x: number, y: number): void {
  const view = viewAt(x, y);
  const mark = view && markAt(view, x, y);
  const next = mark ? { object: mark.object, index: mark.index } : null;
  if (next?.object !== hovered?.object || next?.index !== hovered?.index) { hovered = next; draw({}); }
  overlay().style.cursor = !view ? 'default' : mark ? 'grab' : 'crosshair';
  tell(x, y);
}

function tell(x: number, y: number): void {
  const view = viewAt(x, y), fraction = view?.fraction(x, y, crosshair);
  if (!loaded || !fraction || !loaded.isInside(fraction)) { listener.hover(null, null); return; }
  listener.hover(loaded.world(fraction), loaded.value(fraction));
}

function wheel(event: WheelEvent): void {
  const [x, y] = at(event), view = viewAt(x, y);
  if (!view || !loaded) return;
  event.preventDefault();
  const lines = event.deltaMode === 1 ? event.deltaY * 33 : event.deltaMode === 2 ? event.deltaY * 400 : event.deltaY;
  if (event.ctrlKey || event.metaKey) { zoom(Math.exp(-lines / 400), view.ortho(x, y, crosshair)); return; }
  // Touchpads send many small steps.
  if (wheelRest * lines < 0) wheelRest = 0;
  wheelRest += lines;
  const unit = Math.abs(lines) >= 50 ? Math.abs(lines) : 40;
  const steps = Math.trunc(wheelRest / unit);
  if (!steps) return;
  wheelRest -= steps * unit;
  step(view.name, -steps);
  tell(x, y);
}

// ---- for thumbnails and tests

export function viewOf(name: SliceName): SliceView | undefined {
  makeViews();
  return views.find((view) => view.name === name);
}
