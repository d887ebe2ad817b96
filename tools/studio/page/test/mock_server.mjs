// A stand-in for `surfseg studio` that speaks docs/studio-protocol.md, for work on the page: a bright ellipsoid in noise, and a surface that
// grows for a second round the inside clicks. No dependencies.
//
//   node test/mock_server.mjs [--port 0] [--affine plain|oblique|sheared|mirrored|anisotropic] [--size 64] [--closed] [--ct] [--fail] [--slow] [--broken]
//
// --closed: no volume is open at first; --fail: evolving ends with an error; --slow: the volume comes a second late; --broken: it does not come until /mock/mend.
import { createServer } from 'node:http';
import { readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

const argument = (name, standard) => { const k = process.argv.indexOf(`--${name}`); return k < 0 ? standard : process.argv[k + 1]; };
const has = (name) => process.argv.includes(`--${name}`);
const dist = join(process.env.SURFSEG_STUDIO_PAGE ?? join(dirname(fileURLToPath(import.meta.url)), '..'), 'dist');
const n = Number(argument('size', 64));
const isCt = has('ct');

// ---- the volume

const COS = Math.cos(0.5), SIN = Math.sin(0.5);
const AFFINES = {  // columns: steps of i, j, k in RAS mm; then the position of the first voxel
  plain: [[1.5, 0, 0], [0, 1.5, 0], [0, 0, 1.5]],
  oblique: [[1.5 * COS, 1.5 * SIN, 0], [-1.5 * SIN * COS, 1.5 * COS * COS, 1.5 * SIN], [1.8 * SIN * SIN, -1.8 * COS * SIN, 1.8 * COS]],
  sheared: [[1.4, 0, 0], [0.3, 1.6, 0], [0.5, 0.2, 1.8]],
  mirrored: [[-1.5, 0, 0], [0, -1.2, 0], [0, 0, 1.7]],
  anisotropic: [[0, 0, 0.8], [0.7, 0, 0], [0, 3.0, 0]],  // and its axes permuted
};
const columns = AFFINES[argument('affine', 'plain')];
const size = argument('affine', 'plain') === 'anisotropic' ? [n, n, Math.round(n / 3)] : [n, Math.round(n * 0.9), Math.round(n * 0.8)];
const first = [0, 1, 2].map((r) => -columns.reduce((sum, c, k) => sum + c[r] * (size[k] - 1) / 2, 0) + [12, -20, 31][r]);
const affine = [0, 1, 2].map((r) => [...columns.map((c) => c[r]), first[r]]).concat([[0, 0, 0, 1]]);
const world = (i, j, k) => [0, 1, 2].map((r) => affine[r][0] * i + affine[r][1] * j + affine[r][2] * k + affine[r][3]);
const spacing = columns.map((c) => Math.hypot(...c));

function inverse(m) {
  const [a, b, c] = m[0], [d, e, f] = m[1], [g, h, i] = m[2];
  const A = e * i - f * h, B = f * g - d * i, C = d * h - e * g, D = a * A + b * B + c * C;
  return [[A / D, (c * h - b * i) / D, (b * f - c * e) / D], [B / D, (a * i - c * g) / D, (c * d - a * f) / D], [C / D, (b * g - a * h) / D, (a * e - b * d) / D]];
}
const inv = inverse(affine);
const index = (p) => inv.map((row) => row.reduce((sum, x, k) => sum + x * (p[k] - affine[k][3]), 0));

let seed = 1;
const random = () => { seed = (seed * 1103515245 + 12345) & 0x7fffffff; return seed / 0x7fffffff; };
const centre = [12, -20, 31];
const extent = Math.min(...size.map((s, k) => s * spacing[k]));
function makeVolume() {
  const data = new Int16Array(size[0] * size[1] * size[2]);
  let at = 0;
  for (let k = 0; k < size[2]; k++)
    for (let j = 0; j < size[1]; j++)
      for (let i = 0; i < size[0]; i++) {
        const p = world(i, j, k), q = p.map((x, a) => (x - centre[a]) / (extent * [0.30, 0.24, 0.26][a]));
        const body = Math.hypot(...p.map((x, a) => (x - centre[a]) / (extent * 0.47)));
        const base = Math.hypot(...q) < 1 ? 180 : body < 1 ? 60 : isCt ? -1000 : 0;
        data[at++] = base + 40 * (random() + random() - 1);
      }
  return data;
}
const data = makeVolume();

function nifti() {
  const head = Buffer.alloc(352);
  head.writeInt32LE(348, 0);
  [3, ...size, 1, 1, 1, 1].forEach((x, k) => head.writeInt16LE(x, 40 + 2 * k));
  head.writeInt16LE(4, 70);
  head.writeInt16LE(16, 72);
  [1, ...spacing].forEach((x, k) => head.writeFloatLE(x, 76 + 4 * k));
  head.writeFloatLE(352, 108);
  head.writeFloatLE(1, 112);
  head.writeUInt8(2, 123);
  head.writeInt16LE(1, 254);
  affine.slice(0, 3).forEach((row, r) => row.forEach((x, k) => head.writeFloatLE(x, 280 + 16 * r + 4 * k)));
  head.write('n+1\0', 344, 'latin1');
  return gzipSync(Buffer.concat([head, Buffer.from(data.buffer)]));
}

// ---- surfaces

function sphere(middle, radius, bumps = 0) {
  const rings = 24, around = 48, points = [[0, 0, 1]], triangles = [];
  for (let r = 1; r < rings; r++)
    for (let a = 0; a < around; a++) {
      const t = Math.PI * r / rings, f = 2 * Math.PI * a / around;
      points.push([Math.sin(t) * Math.cos(f), Math.sin(t) * Math.sin(f), Math.cos(t)]);
    }
  points.push([0, 0, -1]);
  const id = (r, a) => 1 + (r - 1) * around + (a % around);
  for (let a = 0; a < around; a++) {
    triangles.push([0, id(1, a), id(1, a + 1)], [points.length - 1, id(rings - 1, a + 1), id(rings - 1, a)]);
    for (let r = 1; r < rings - 1; r++) triangles.push([id(r, a), id(r + 1, a), id(r + 1, a + 1)], [id(r, a), id(r + 1, a + 1), id(r, a + 1)]);
  }
  const scale = points.map((p) => radius * (1 + bumps * Math.sin(5 * p[0]) * Math.cos(4 * p[1] + 1)));
  return { points: points.map((p, k) => p.map((x, c) => middle[c] + scale[k] * x * [1.15, 0.92, 1][c])), triangles, unit: points };
}

function encode({ points, triangles, unit }, frame, arrays) {
  const buffer = Buffer.alloc(16 + 12 * points.length + 12 * triangles.length + 4 * arrays * points.length);
  [points.length, triangles.length, arrays, frame].forEach((x, k) => buffer.writeUInt32LE(x, 4 * k));
  let at = 16;
  for (const p of points) for (const x of p) at = buffer.writeFloatLE(x, at);
  for (const t of triangles) for (const x of t) at = buffer.writeUInt32LE(x, at);
  for (let a = 0; a < arrays; a++) for (const p of unit) at = buffer.writeFloatLE(a === 0 ? 0.2 + 0.9 * Math.max(0, p[0]) ** 3 : 0.9 - 0.7 * Math.max(0, p[0]) ** 2, at);
  return buffer;
}

// ---- the state

const clone = (x) => JSON.parse(JSON.stringify(x));
const volumeState = () => ({ revision: ++volumes, path: isCt ? 'abdomen/ct.nii.gz' : 'phantom.nii.gz', size, spacing_mm: spacing, index_to_world: affine,
  minimum: Math.min(...data.slice(0, 10000), -1040), maximum: 220, window: isCt ? [-160, 240] : [-20, 240], is_ct: isCt, coarser_by: [1, 1, 1], notes: [] });
let volumes = Date.now(), volumesAsked = 0, isBroken = has('broken');
const state = {
  revision: 1, program: { name: 'surfseg', version: '1.0.0' }, folder: 'scans',
  files: [
    { path: 'phantom.nii.gz', kind: 'volume', words: `${size.join(' x ')}, ${spacing.map((x) => x.toFixed(2)).join(' x ')} mm` },
    { path: 'abdomen/ct.nii.gz', kind: 'volume', words: '512 x 512 x 300, 0.7 x 0.7 x 1 mm' },
    { path: 'dicom/patient-07', kind: 'DICOM folder', words: '2 series', series: [{ id: '3', words: 'T1 axial, 180 slices' }, { id: '5', words: 'T2 coronal, 60 slices' }] },
    { path: 'phantom.surfseg.json', kind: 'recipe', words: '1 object, 3 clicks, of phantom.nii.gz' },
  ],
  volume: has('closed') ? null : volumeState(), job: null, objects: [], removed: null, error: null,
};
const COLOURS = ['#ffd400', '#3ec1f3', '#ff6fae', '#7ee081', '#ff9d4d'];
const history = new Map();  // object -> {past, future}
const shapes = new Map();
let nextObject = 1, jobs = 0, surfaces = 0, timer = null, errors = Date.now();
const received = [];  // for the tests
const removed = [];  // objects, the last one last

function tell() { state.revision++; send('state', state); }
function fail(text) { state.error = { id: ++errors, text }; tell(); }
const streams = new Set();
function send(name, body) { for (const s of streams) s.write(`event: ${name}\ndata: ${JSON.stringify(body)}\n\n`); }
setInterval(() => { for (const s of streams) s.write(': \n\n'); }, 1000).unref();

function remember(o, words) {
  const h = history.get(o.id);
  h.past.push({ words, clicks: clone(o.clicks), options: clone(o.options) });
  h.future = [];
}
function historyWords(o) {
  const h = history.get(o.id);
  const undone = removed.length ? `removal of ${removed.at(-1).name}` : h.past.at(-1)?.words;
  Object.assign(o, { can_undo: undone !== undefined, can_redo: h.future.length > 0, undo_words: undone ?? '', redo_words: h.future.at(-1)?.words ?? '' });
}

function radiusOf(o) {
  const inside = o.clicks.filter((c) => c.side === 'inside'), outside = o.clicks.filter((c) => c.side === 'outside');
  const middle = [0, 1, 2].map((k) => inside.reduce((s, c) => s + c.point[k], 0) / Math.max(1, inside.length));
  const spread = Math.max(0, ...inside.map((c) => Math.hypot(...c.point.map((x, k) => x - middle[k]))));
  const near = Math.min(Infinity, ...outside.map((c) => Math.hypot(...c.point.map((x, k) => x - middle[k]))));
  return { middle, radius: Math.min(Math.max(extent * 0.22, spread * 1.2), near * 0.9), none: inside.length === 0 };
}

function evolve(o) {
  halt('');
  const { middle, radius, none } = radiusOf(o);
  if (none) { o.has_surface = false; o.measures = o.verdict = null; o.candidates = []; o.outcome = null; o.message = null; shapes.delete(o.id); tell(); return; }
  const started = Date.now();
  state.job = { id: ++jobs, object: o.id, what: 'evolve', stage: 'search', step: 0, seconds: 0, frame: 0 };
  o.measures = o.verdict = null;
  o.notes = [];
  tell();
  const tick = () => {
    const seconds = (Date.now() - started) / 1000, share = Math.min(1, seconds / 1.0);
    shapes.set(o.id, { shape: sphere(middle, radius * (0.25 + 0.75 * share), 0.08 * share), arrays: 0 });
    const frame = state.job.frame + 1;
    o.has_surface = true;
    Object.assign(state.job, { stage: 'evolve', step: frame, seconds, frame });
    if (share < 1) { send('progress', state.job); return; }
    finish(o, middle, radius, 'converged', 'the shape derivative fell to 1.1e-05 of its largest value');
  };
  timer = setInterval(tick, 100);
}

function finish(o, middle, radius, outcome, message) {
  clearInterval(timer);
  timer = null;
  state.job = null;
  if (has('fail')) { fail('no object found round the click: its grey values (mean 180) are those of its surroundings; click where it differs'); return; }
  o.outcome = outcome;
  o.message = message;
  o.surface = ++surfaces;
  shapes.get(o.id).arrays = 2;
  const count = shapes.get(o.id).shape;
  const ml = 4 / 3 * Math.PI * radius ** 3 / 1000;
  o.measures = { volume_ml: ml, volume_deviation_ml: 0.014 * ml, area_cm2: 4 * Math.PI * radius ** 2 / 100, triangles: count.triangles.length, vertices: count.points.length,
    components: 1, passed: true, verification: 'closed, manifold, outward, free of self-intersections', share_without_edge: 0.03,
    next_click: [middle[0] + radius * 1.1, middle[1], middle[2]] };
  o.verdict = { trust: 'check', words: 'right in 31 of 46 such cases; edges are weak on the right', place: [middle[0] + radius, middle[1], middle[2]] };
  o.candidates = [1, 2, 3].map((k) => ({ number: k, words: ['the whole bright region', 'its core', 'with the rim'][k - 1], score: 0.9 - 0.1 * k,
    volume_ml: ml * [1, 0.6, 1.5][k - 1], chosen: k === (o.chosen ?? 1) }));
  tell();
}

function halt(message) {
  if (!timer) return;
  clearInterval(timer);
  timer = null;
  const o = state.objects.find((x) => x.id === state.job?.object);
  state.job = null;
  if (o && message) { o.outcome = 'stopped'; o.message = message; tell(); }
}

const POSITIVE = { text: '> 0', lowest: 0, highest: null, excludes_lowest: true };
const OPTIONS = {
  options: [
    { key: 'edge_length_mm', label: 'edge length', group: 'surface', unit: 'mm', type: 'number', minimum: 0, help: 'Of the finest triangles; half of it is about the finest detail.', standard: null, choices: [] },
    { key: 'coarseness', label: 'coarseness', group: 'surface', unit: '', type: 'number', minimum: 1, help: 'How much longer edges may be where the surface is flat.', standard: 4, choices: [] },
    { key: 'smoothing', label: 'smoothing', group: 'surface', unit: '', type: 'number', minimum: 0, help: 'Weight of the area: more is smoother.', standard: null, choices: [] },
    { key: 'max_steps', label: 'steps at most', group: 'surface', unit: '', type: 'integer', minimum: 1, help: 'The evolution ends here at the latest.', standard: 500, choices: [] },
    { key: 'topology', label: 'topology', group: 'topology', unit: '', type: 'choice', help: 'What may change: free joins and cuts, fixed holds sheets apart, genus0 allows no handles.', standard: 'free', choices: ['free', 'fixed', 'genus0'] },
    { key: 'fill_cavities', label: 'fill cavities', group: 'components', unit: '', type: 'boolean', help: 'Hollows inside become part of the object.', standard: false, choices: [] },
    { key: 'keep_largest', label: 'keep largest', group: 'components', unit: '', type: 'boolean', help: 'Only the largest component stays.', standard: false, choices: [] },
  ],
  energies: [
    { name: 'minimal-surface', formula: 'g(x) dA', help: 'Edges of the image hold the surface.', parameters: [{ key: 'lambda', unit: '', help: 'How sharp an edge must be.', range: POSITIVE, standard: 'from the image' }] },
    { name: 'window', formula: '(u-m)^2 - h^2 dx', help: 'Values round a mean are inside.', parameters: [
      { key: 'mean', unit: 'HU', help: 'The value in the middle.', range: { text: 'any number', lowest: null, highest: null, excludes_lowest: false }, standard: 'needed' }, { key: 'half-width', unit: 'HU', help: 'How far values may be off.', range: POSITIVE, standard: 'needed' }] },
    { name: 'area', formula: 'dA', help: 'Smooths.', parameters: [{ key: 'weight', unit: '1/mm', help: 'Against the other terms.', range: POSITIVE, standard: '1' }] },
  ],
  presets: [{ name: 'ct-bone', words: 'bone in CT' }, { name: 'kidney-ct', words: 'kidneys in CT' }],
  export: { surface: ['stl', 'obj', 'ply', 'vtp'], labels: ['nii.gz', 'nrrd', 'mha'], measures: ['csv'], picture: ['png'], report: ['html'], recipe: ['json'] },
};

class Refused extends Error { constructor(status, text, more = {}) { super(text); this.status = status; this.more = more; } }

const ACTIONS = {
  open({ path }) {
    if (!state.files.some((f) => f.path === path)) throw new Refused(400, `${path}: not a file of this folder`);
    state.job = { id: ++jobs, object: null, what: 'open', stage: `reading ${path}`, step: 0, seconds: 0, frame: 0 };
    tell();
    setTimeout(() => {
      state.job = null;
      if (path.endsWith('.json')) { fail(`${path}: the recipe is of another volume`); return; }
      state.volume = { ...volumeState(), path };
      state.objects = [];
      nextObject = 1;
      tell();
    }, 400);
  },
  close() { halt(''); state.volume = null; state.objects = []; },
  add_object() {
    const o = { id: nextObject++, name: `object ${nextObject - 1}`, colour: COLOURS[(nextObject - 2) % COLOURS.length], clicks: [], options: {}, outcome: null, message: null,
      has_surface: false, surface: 0, measures: null, verdict: null, candidates: [], notes: [], can_undo: false, can_redo: false, undo_words: '' };
    history.set(o.id, { past: [], future: [] });
    state.objects.push(o);
    return { object: o.id };
  },
  remove_object({ object }) {
    const o = find(object);
    if (state.job?.object === o.id) halt('');
    state.objects = state.objects.filter((x) => x !== o);
    removed.push(o);
  },
  rename({ object, name }) { if (state.objects.some((x) => x.name === name && x.id !== object)) throw new Refused(400, `there is another object named ${name}`); find(object).name = name; },
  recolour({ object, colour }) { find(object).colour = colour; },
  click({ object, point, side }) {
    const o = find(object), ijk = index(point).map(Math.round);
    if (ijk.some((x, k) => x < 0 || x >= size[k])) throw new Refused(400, 'the click lies outside of the volume');
    remember(o, `${side} click`);
    o.clicks.push({ point, side });
    evolve(o);
  },
  move_click({ object, index: k, point, was }) { const o = find(object); checkClick(o, k, was); remember(o, 'move of a click'); o.clicks.push({ ...o.clicks.splice(k, 1)[0], point }); evolve(o); },
  delete_click({ object, index: k, was }) { const o = find(object); checkClick(o, k, was); remember(o, 'deleted click'); o.clicks.splice(k, 1); evolve(o); },
  choose({ object, number }) { const o = find(object); o.chosen = number; evolve(o); },
  set_options({ object, options }) {
    if (typeof options.edge_length_mm === 'number' && options.edge_length_mm <= 0) throw new Refused(400, `edge length: expected more than 0 mm; got ${options.edge_length_mm}`);
    const o = find(object); remember(o, 'options');
    o.options = Object.fromEntries(Object.entries({ ...o.options, ...options }).filter(([, value]) => value !== null));
    evolve(o);
  },
  preset({ object, name }) { const o = find(object); remember(o, `preset ${name}`); o.options = { smoothing: 2, energies: ['area:weight=2'] }; evolve(o); },
  evolve({ object }) { evolve(find(object)); },
  stop() { halt('stopped by the user'); },
  undo({ object }) {
    if (!removed.length) { step(find(object), 'past', 'future'); return; }
    state.objects = [...state.objects, removed.pop()].sort((a, b) => a.id - b.id);
  },
  redo({ object }) { step(find(object), 'future', 'past'); },
  quit() { setTimeout(() => process.exit(0), 50); },
};
function step(o, from, to) {
  const h = history.get(o.id), last = h[from].pop();
  if (!last) throw new Refused(400, 'nothing to undo');
  h[to].push({ words: last.words, clicks: clone(o.clicks), options: clone(o.options) });
  o.clicks = last.clicks;
  o.options = last.options;
  evolve(o);
}
function checkClick(o, k, was) {
  if (was && JSON.stringify(o.clicks[k]?.point) !== JSON.stringify(was)) throw new Refused(409, 'the click is not where it was');
  if (!o.clicks[k]) throw new Refused(400, 'no such click');
}
function find(id) { const o = state.objects.find((x) => x.id === id); if (!o) throw new Refused(400, `there is no object ${id}`); return o; }

const written = new Set();
function exportFile(r) {
  received.push({ export: r });
  if (/[/\\]/.test(r.name)) throw new Refused(400, `${r.name}: a name without a folder is expected`);
  if (written.has(r.name) && !r.overwrite) throw new Refused(409, `${r.name} exists`, { exists: true });
  written.add(r.name);
  return { file: r.name, bytes: 82884 };
}

// ---- the server

const TYPES = { html: 'text/html; charset=utf-8', js: 'text/javascript; charset=utf-8', css: 'text/css; charset=utf-8', txt: 'text/plain; charset=utf-8' };
const CSP = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; connect-src 'self' data: blob:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";
let compressed = null;

const server = createServer(async (request, response) => {
  const url = new URL(request.url, 'http://localhost');
  const json = (body, status = 200) => { response.writeHead(status, { 'Content-Type': 'application/json' }); response.end(JSON.stringify(body)); };
  try {
    if (request.method === 'POST') {
      let text = '';
      for await (const chunk of request) text += chunk;
      const body = JSON.parse(text || '{}');
      if (url.pathname === '/api/export') { json(exportFile(body)); return; }
      received.push(body);
      if (!ACTIONS[body.action]) throw new Refused(400, `unknown action ${body.action}`);
      if (!state.volume && !['open', 'quit'].includes(body.action)) throw new Refused(409, 'no volume is open');
      const more = ACTIONS[body.action](body) ?? {};
      for (const o of state.objects) historyWords(o);
      state.removed = removed.at(-1)?.name ?? null;
      tell();
      json({ revision: state.revision, ...more });
      return;
    }
    const object = Number(url.searchParams.get('object'));
    switch (url.pathname) {
      case '/api/state': json(state); return;
      case '/api/options': json(OPTIONS); return;
      case '/api/command': json({ text: `surfseg replay ${find(object).name}.json -o '${find(object).name}.stl'` }); return;
      case '/mock/received': json(received); return;
      case '/mock/value': {
        const [i, j, k] = url.searchParams.get('voxel').split(',').map(Number);
        json(data[i + size[0] * (j + size[1] * k)]);
        return;
      }
      case '/mock/error': fail('phantom.nii.gz: cannot be written: no space left on device'); json({}); return;
      case '/mock/streams': json(streams.size); return;
      case '/mock/asked': json(volumesAsked); return;
      case '/mock/mend': isBroken = false; json({}); return;
      case '/mock/cut': for (const s of streams) s.destroy(); json({}); return;
      case '/api/events':
        response.writeHead(200, { 'Content-Type': 'text/event-stream', 'Cache-Control': 'no-store' });
        streams.add(response);
        response.on('close', () => streams.delete(response));
        response.write(`retry: 500\nevent: state\ndata: ${JSON.stringify(state)}\n\n`);
        return;
      case '/api/volume.nii.gz': {
        volumesAsked++;
        if (isBroken) throw new Refused(500, 'no memory is left');
        compressed ??= nifti();
        response.writeHead(200, { 'Content-Type': 'application/gzip', 'Content-Length': compressed.length });
        setTimeout(() => response.end(compressed), has('slow') ? 1000 : 0);
        return;
      }
      case '/api/surface': {
        const s = shapes.get(object), o = state.objects.find((x) => x.id === object);
        if (!s || !o) throw new Refused(404, 'there is no surface');
        response.end(encode(s.shape, state.job?.object === o.id ? state.job.frame : 0, s.arrays));
        return;
      }
      case '/api/candidate': {
        const { middle, radius } = radiusOf(find(object));
        response.end(encode(sphere(middle, radius * [1, 0.8, 1.2][Number(url.searchParams.get('number')) - 1], 0.08), 1, 0));
        return;
      }
      default: {
        const name = url.pathname === '/' ? 'index.html' : url.pathname.slice(1);
        if (!/^[a-z]+\.(html|js|css|txt)$/.test(name)) throw new Refused(404, 'not found');
        const body = readFileSync(join(dist, name));
        response.writeHead(200, { 'Content-Type': TYPES[name.split('.').pop()], 'Content-Security-Policy': CSP, 'Cache-Control': 'no-store' });
        response.end(body);
      }
    }
  } catch (error) {
    json({ error: error.message, ...(error.more ?? {}) }, error.status ?? (error.code === 'ENOENT' ? 404 : 500));
  }
});
server.listen(Number(argument('port', 0)), '127.0.0.1', () => console.log(`http://127.0.0.1:${server.address().port}/`));
