// The panel of objects: the list, and of the active one its measures, verdict, clicks and notes.
import type { Point, StudioObject } from './protocol';
import { addObject, copyCommand, deleteClick, evolve, removeObject, toggleHidden } from './actions';
import { byId, h, icon, iconButton, millilitres, number, refill } from './dom';
import { cssGradient, rangeOf } from './colours';
import { act } from './server';
import { activeObject, type MeshColour, page, setView, volume } from './state';
import { surfaces } from './surfaces';
import { lookAt } from './slices';

const MOST_LISTED = 20;  // clicks, until all are asked for: each is a dozen nodes

let shownList = '', shownDetails = '', allClicksOf: number | null = null;

export function drawObjects(): void {
  const objects = page.state?.objects ?? [];
  const list = JSON.stringify([objects.map((o) => [o.id, o.name, o.colour, o.measures?.volume_ml, o.has_surface]),
    page.view.active, [...page.view.hidden], page.job?.object, !!volume()]);
  if (list !== shownList) { shownList = list; drawList(objects); }
  const o = activeObject();
  const surface = o && surfaces.get(o.id);
  const details = JSON.stringify([o && { ...o, candidates: 0, options: 0 }, page.view.click, page.view.meshColour,
    surface?.key, allClicksOf, !!volume(), page.job?.object === o?.id && !!page.job]);
  if (details !== shownDetails) { shownDetails = details; drawDetails(o); }
}

function drawList(objects: StudioObject[]): void {
  const rows = objects.map((o) => {
    const active = o.id === page.view.active, hidden = page.view.hidden.has(o.id);
    const select = () => setView({ active: o.id, click: null });
    return h('li', { class: active ? 'object active' : 'object', 'aria-current': active ? 'true' : undefined, onclick: select },
      iconButton(hidden ? 'eyeOff' : 'eye', `${hidden ? 'Show' : 'Hide'} ${o.name}`, (e) => { e.stopPropagation(); toggleHidden(o.id); },
        { 'data-key': `eye${o.id}`, 'aria-pressed': String(!hidden) }),
      h('input', { type: 'color', value: o.colour, 'aria-label': `Colour of ${o.name}`, title: 'Colour', 'data-key': `colour${o.id}`,
        onchange: (e: Event) => { void act({ action: 'recolour', object: o.id, colour: (e.target as HTMLInputElement).value }); } }),
      h('input', { type: 'text', class: 'name', value: o.name, 'aria-label': 'Name of the object', 'data-key': `name${o.id}`,
        spellcheck: 'false', maxlength: '60', onfocus: select,
        onkeydown: (e: KeyboardEvent) => {
          const field = e.target as HTMLInputElement;
          if (e.key === 'Enter') field.blur();
          if (e.key === 'Escape') { field.value = o.name; field.blur(); }
        },
        onchange: (e: Event) => {
          const field = e.target as HTMLInputElement, name = field.value.trim();
          if (!name || name === o.name) { field.value = o.name; return; }
          void act({ action: 'rename', object: o.id, name }).then((done) => { if (!done) field.value = o.name; });
        } }),
      page.job?.object === o.id ? h('span', { class: 'spinner', 'aria-label': 'evolving' })
        : h('span', { class: 'ml' }, o.measures?.volume_ml !== undefined ? millilitres(o.measures.volume_ml) : ''),
      iconButton('cross', `Remove ${o.name}`, (e) => {
        e.stopPropagation();
        void removeObject(o);
      }, { 'data-key': `remove${o.id}` }));
  });
  refill(byId('object-list'), ...rows);
  byId<HTMLButtonElement>('add-object').disabled = !volume();
}

export function startObjects(): void {
  byId('add-object').addEventListener('click', () => { void addObject(); });
}

function row(label: string, value: Node | string, title = ''): HTMLElement {
  return h('div', { class: 'row', title }, h('dt', {}, label), h('dd', {}, value));
}

function lookButton(words: string, point: Point, key: string, what: string): HTMLElement {
  return h('button', { type: 'button', class: 'small', 'data-key': key, onclick: () => lookAt(point),
    title: `${what}: crosshair to ${point.map((x) => x.toFixed(1)).join(', ')} mm` }, icon('look'), words);
}

function drawDetails(o: StudioObject | null): void {
  const container = byId('object-details');
  if (!o) {
    refill(container, h('p', { class: 'quiet' }, volume() ? 'Click into an object in a slice: its surface appears.' : ''));
    return;
  }
  const busy = page.job?.object === o.id;
  refill(container, verdict(o), measures(o), o.has_surface && meshColour(o), actions(o, busy), clicks(o), notes(o, busy));
}

function verdict(o: StudioObject): Node | null {
  const v = o.verdict;
  const next = o.measures?.next_click;
  if (!v && !next) return null;
  const tone = !v ? '' : /trusted|good|sure|high/.test(v.trust) ? 'good' : /doubt|poor|low|fail|wrong/.test(v.trust) ? 'bad' : 'check';
  return h('div', { class: `verdict ${tone}` },
    v && h('p', {}, h('strong', {}, v.trust), v.words ? ` – ${v.words}` : ''),
    h('div', { class: 'buttons' },
      v?.place && lookButton('Look where it is doubtful', v.place, 'place', 'Where the verdict is least sure (D)'),
      next && lookButton('Look where to click next', next, 'next', 'Amid the part that no edge holds; you see there whether inside or outside is right')));
}

function measures(o: StudioObject): Node | null {
  const m = o.measures;
  if (!m) return o.message ? h('p', { class: 'quiet' }, o.message) : null;
  const share = m.share_without_edge;
  return h('dl', { class: 'measures' },
    m.volume_ml !== undefined && row('Volume', millilitres(m.volume_ml, m.volume_deviation_ml, 4)),
    m.area_cm2 !== undefined && row('Area', `${number(m.area_cm2, 4)} cm²`),
    m.triangles !== undefined && row('Triangles', m.triangles.toLocaleString('en-US')
      + (m.components && m.components > 1 ? ` in ${m.components} components` : '')),
    share !== undefined && share !== null && row('Without an edge', `${number(100 * share, 2)} % of the area`,
      'Share of the surface that no edge of the image holds'),
    m.verification !== undefined && row('Verification',
      h('span', { class: m.passed === false ? 'bad' : 'good' }, `${m.passed === false ? '✗' : '✓'} ${m.verification}`)),
    o.outcome ? row('Outcome', o.message ? `${o.outcome}: ${o.message.replace(new RegExp(`^${o.outcome}[: ]*`), '')}` : o.outcome) : null);
}

function meshColour(o: StudioObject): Node {
  const s = surfaces.get(o.id), choice = page.view.meshColour;
  const values = choice === 'deviation' ? s?.deviation : choice === 'edge' ? s?.edge : null;
  const choices: [MeshColour, string][] = [['object', 'object'], ['deviation', 'deviation'], ['edge', 'edge strength']];
  const select = h('select', { 'aria-label': 'Colour of the mesh', 'data-key': 'mesh-colour',
    onchange: (e: Event) => setView({ meshColour: (e.target as HTMLSelectElement).value as MeshColour }) },
    ...choices.map(([value, words]) => h('option', { value, selected: value === choice,
      disabled: value !== 'object' && !s?.deviation }, words)));
  const legend = values && choice !== 'object' ? rangeOf(values) : null;
  return h('div', { class: 'mesh-colour' }, h('label', {}, 'Mesh by ', select),
    legend && h('div', { class: 'legend' }, h('span', {}, number(legend[0], 2)),
      h('span', { class: 'bar', style: `background:${cssGradient(choice as 'deviation' | 'edge')}` }),
      h('span', {}, number(legend[1], 2) + (choice === 'deviation' ? ' mm' : ''))));
}

function actions(o: StudioObject, busy: boolean): Node {
  return h('div', { class: 'buttons' },
    o.clicks.length > 0 && !busy && (o.outcome !== 'converged' || o.outdated) && h('button', { type: 'button', class: 'small', 'data-key': 'evolve',
      onclick: () => { void evolve(); } }, icon('play'), 'Go on'),
    h('button', { type: 'button', class: 'small', 'data-key': 'copy', disabled: !o.clicks.length,
      title: 'Copies the command line that repeats this object', onclick: () => { void copyCommand(); } }, icon('copy'), 'Copy command line'));
}

function clicks(o: StudioObject): Node {
  const chosen = page.view.click?.object === o.id ? page.view.click.index : -1;
  const indices = o.clicks.map((_, index) => index).reverse()
    .filter((index) => allClicksOf === o.id || index === chosen || index >= o.clicks.length - MOST_LISTED);
  return h('section', { class: 'clicks' }, h('h3', {}, `Clicks`, h('span', { class: 'count' }, String(o.clicks.length))),
    o.clicks.length === 0 ? h('p', { class: 'quiet' }, 'None yet: click inside the object.')
      : h('ol', {}, ...indices.map((index) => clickRow(o, index, index === chosen))),
    indices.length < o.clicks.length && h('button', { type: 'button', class: 'small', 'data-key': 'all-clicks',
      onclick: () => { allClicksOf = o.id; drawObjects(); } }, `Show all ${o.clicks.length}`));
}

function clickRow(o: StudioObject, index: number, chosen: boolean): Node {
  const c = o.clicks[index];
  return h('li', { class: chosen ? 'click chosen' : 'click', value: index + 1 },
    h('button', { type: 'button', class: 'click-words', 'data-key': `click${index}`, 'aria-pressed': String(chosen),
      title: 'Select, and look there',
      onclick: () => { setView({ click: { object: o.id, index } }); lookAt(c.point); } },
      h('span', { class: `mark ${c.side}`, 'aria-hidden': 'true' }, c.side === 'inside' ? '+' : '−'),
      h('span', { class: 'side' }, c.side), h('span', { class: 'point' }, c.point.map((x) => x.toFixed(1)).join(', '))),
    iconButton('cross', `Delete click ${index + 1}, ${c.side}`, () => { void deleteClick(o.id, index); },
      { 'data-key': `delete${index}` }));
}

function notes(o: StudioObject, busy: boolean): Node | null {
  const all = o.outdated && !busy ? ['The surface does not heed what was done last.', ...o.notes] : o.notes;
  if (!all.length) return null;
  return h('ul', { class: 'notes' }, ...all.map((n) => h('li', {}, n)));
}
