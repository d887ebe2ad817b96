// The proposals of the last click as thumbnails: each one's outline on the slice through that click, or,
// where none of them is seen there, through the first click.
import type { Candidate, Click, StudioObject } from './protocol';
import { byId, h, millilitres, refill } from './dom';
import { act, get } from './server';
import { activeObject, page, setView } from './state';
import { readSurface, cut, type Surface } from './surface';
import { loaded, preview, range } from './slices';

const SIZE = 96, LEAST_VOXELS = 12;
let cache = new Map<string, Promise<Surface | null>>();
let shown = '';

export function drawCandidates(): void {
  const o = activeObject();
  const list = o?.candidates ?? [];
  const key = JSON.stringify([o?.id, o?.colour, page.view.radiological, list, o?.clicks.at(-1), range, page.state?.volume?.revision, !!loaded]);
  if (key === shown) return;
  shown = key;
  const section = byId('candidates');
  section.hidden = list.length === 0;
  if (!o || !list.length) { cache = new Map(); refill(byId('candidate-list')); setView({ candidate: null }); preview(null); return; }
  const source = identity(o);
  for (const k of [...cache.keys()]) if (!k.startsWith(source)) cache.delete(k);
  refill(byId('candidate-list'), ...list.map((c) => thumbnail(o, c, source)));
}

// Proposals are those of the clicks: other clicks, other proposals.
function identity(o: StudioObject): string { return `${o.id} ${JSON.stringify([o.clicks, o.candidates.map((c) => [c.number, c.words])])} `; }

function fetched(o: StudioObject, c: Candidate, source: string): Promise<Surface | null> {
  const key = source + c.number;
  let found = cache.get(key);
  if (!found) {
    found = get(`/api/candidate?object=${o.id}&number=${c.number}`).then((r) => r.arrayBuffer()).then(readSurface)
      .catch(() => { cache.delete(key); return null; });  // it is asked for again
    cache.set(key, found);
  }
  return found;
}

function thumbnail(o: StudioObject, c: Candidate, source: string): HTMLElement {
  const ratio = window.devicePixelRatio || 1;
  const canvas = h('canvas', { width: Math.round(SIZE * ratio), height: Math.round(SIZE * ratio), 'aria-hidden': 'true' });
  const words = `Proposal ${c.number}${c.volume_ml !== undefined ? `, ${millilitres(c.volume_ml)}` : ''}: ${c.words}`;
  const button = h('button', { type: 'button', class: c.chosen ? 'candidate chosen' : 'candidate', title: words, 'aria-label': words,
    'aria-pressed': String(!!c.chosen), 'data-key': `candidate${c.number}`,
    onclick: () => { preview(null); void act({ action: 'choose', object: o.id, number: c.number }); },
    onmouseenter: () => show(), onfocus: () => show(), onmouseleave: () => hide(), onblur: () => hide() },
    canvas, h('span', { class: 'caption' }, h('b', {}, String(c.number)), c.volume_ml !== undefined ? ` ${millilitres(c.volume_ml)}` : ''));
  const show = () => {
    page.view.candidate = { object: o.id, number: c.number };
    void fetched(o, c, source).then((f) => { if (page.view.candidate?.number === c.number) preview(f); });
  };
  const hide = () => { page.view.candidate = null; preview(null); };
  // All thumbnails show the same part of the slice, so that they can be compared.
  void Promise.all(o.candidates.map((other) => fetched(o, other, source))).then((all) => {
    const own = all[o.candidates.indexOf(c)];
    if (own && loaded) paint(canvas, o, own, all.filter((s): s is Surface => s !== null));
  });
  return button;
}

function paint(canvas: HTMLCanvasElement, o: StudioObject, own: Surface, all: Surface[]): void {
  const volume = loaded!;
  if (!o.clicks.length) return;
  const axis = 2, u = 0, v = 1;  // the axial slice
  // Not kept with the surface, which may be there before the volume is.
  const fractions = new Map(all.map((s) => [s, volume.fractions(s.points)]));
  const outlineAt = (s: Surface, z: number) => cut(fractions.get(s)!, s.triangles, axis, z, u, v);
  const outlinesAt = (z: number) => all.map((s) => outlineAt(s, z));
  const place = (click: Click) => volume.snapped(volume.fraction(click.point));
  let at = place(o.clicks.at(-1)!), outlines = outlinesAt(at[axis]);
  if (!outlines.some((ends) => ends.length)) {
    at = place(o.clicks.find((c) => c.side === 'inside') ?? o.clicks[0]);
    outlines = outlinesAt(at[axis]);
  }
  let low = [at[u], at[v]], high = [at[u], at[v]];
  for (const ends of outlines)
    for (let i = 0; i < ends.length; i += 2) {
      low = [Math.min(low[0], ends[i]), Math.min(low[1], ends[i + 1])];
      high = [Math.max(high[0], ends[i]), Math.max(high[1], ends[i + 1])];
    }
  // A square in mm round all outlines, with a margin.
  const length = [u, v].map((k) => volume.high[k] - volume.low[k]);
  const side = Math.max(1.3 * Math.max(...[0, 1].map((k) => (high[k] - low[k]) * length[k])), LEAST_VOXELS * Math.max(...volume.about.spacing_mm));
  const middle = [0, 1].map((k) => (low[k] + high[k]) / 2);
  const corner = middle.map((x, k) => x - side / length[k] / 2);
  const n = canvas.width, c = canvas.getContext('2d')!, image = c.createImageData(n, n);
  const mirror = page.view.radiological;
  for (let y = 0; y < n; y++)
    for (let x = 0; x < n; x++) {
      const f = [corner[0] + (mirror ? n - 1 - x : x) / n * side / length[0], corner[1] + (n - 1 - y) / n * side / length[1]];
      const within = f[0] >= 0 && f[0] < 1 && f[1] >= 0 && f[1] < 1;
      const grey = within ? 255 * (volume.value([f[0], f[1], at[axis]]) - range[0]) / (range[1] - range[0]) : 0;
      const to = 4 * (y * n + x);
      image.data[to] = image.data[to + 1] = image.data[to + 2] = grey;
      image.data[to + 3] = 255;
    }
  c.putImageData(image, 0, 0);
  const ends = outlineAt(own, at[axis]);
  const px = (f: number) => (mirror ? n - (f - corner[0]) * length[0] / side * n : (f - corner[0]) * length[0] / side * n);
  const py = (f: number) => n - (f - corner[1]) * length[1] / side * n;
  c.beginPath();
  for (let i = 0; i < ends.length; i += 4) { c.moveTo(px(ends[i]), py(ends[i + 1])); c.lineTo(px(ends[i + 2]), py(ends[i + 3])); }
  c.strokeStyle = o.colour;
  c.lineWidth = 1.75 * n / SIZE;
  c.stroke();
  c.beginPath();
  c.arc(px(at[u]), py(at[v]), 2.5 * n / SIZE, 0, 7);
  c.fillStyle = '#fff';
  c.fill();
}

