// The panel of options, made from the program's own table: groups, units, a line of help; energies with their parameters; presets.
// Edits are a draft until they are applied, because every change lets the surface evolve anew.
import type { EnergyKind, Option, OptionValue, OptionValues, StudioObject } from './protocol';
import { byId, h, iconButton, refill } from './dom';
import { act } from './server';
import { activeObject, page } from './state';

/** Of options that are edited alone: what another page sets of the others meanwhile holds. Null: as where nothing is set. */
type Changes = Record<string, OptionValue | null>;

let draft: Changes | null = null;
let draftOf: number | null = null;
let shown = '';

export function drawOptions(): void {
  const o = activeObject(), table = page.options;
  if (draftOf !== (o?.id ?? null)) { draft = null; draftOf = o?.id ?? null; }
  const key = JSON.stringify([o?.id, o?.options, !!table, draft]);
  if (key === shown) return;
  shown = key;
  const container = byId('options-panel');
  if (!o || !table) { refill(container, h('p', { class: 'quiet' }, 'Options belong to an object: click into one, or add it.')); return; }
  const options = table.options.filter((x) => x.type !== 'energies');  // they have a panel of their own
  const groups = [...new Set(options.map((x) => x.group))];
  refill(container, presets(o),
    ...groups.map((group) => h('fieldset', {}, h('legend', {}, group),
      ...options.filter((x) => x.group === group).map((x) => field(o, x)))),
    energies(o), buttons(o));
}

function values(o: StudioObject): OptionValues {
  return Object.fromEntries(Object.entries({ ...o.options, ...draft }).filter(([, value]) => value !== null)) as OptionValues;
}

/** That make the object's options those that are wanted. */
function changesTo(o: StudioObject, wanted: OptionValues): Changes | null {
  const keys = [...new Set([...Object.keys(o.options), ...Object.keys(wanted)])]
    .filter((key) => JSON.stringify(wanted[key]) !== JSON.stringify(o.options[key]));
  return keys.length ? Object.fromEntries(keys.map((key) => [key, wanted[key] ?? null])) : null;
}

function edit(o: StudioObject, change: (values: OptionValues) => void, redraw: boolean): void {
  const had = draft !== null, wanted = structuredClone(values(o));
  change(wanted);
  draft = changesTo(o, wanted);
  if (redraw || had !== (draft !== null)) drawOptions();
  else { shown = JSON.stringify([o.id, o.options, true, draft]); }
}

function set(o: StudioObject, key: string, value: OptionValues[string] | null, redraw = false): void {
  edit(o, (v) => { if (value === null) delete v[key]; else v[key] = value; }, redraw);
}

function presets(o: StudioObject): Node | null {
  const list = page.options!.presets;
  if (!list.length) return null;
  const help = h('p', { class: 'help' }, 'Options that have proved themselves for a structure.');
  return h('div', { class: 'field' },
    h('div', { class: 'line' }, h('label', { for: 'preset' }, 'preset'),
      h('select', { id: 'preset', 'data-key': 'preset', onchange: (e: Event) => {
        const name = (e.target as HTMLSelectElement).value;
        if (!name) return;
        draft = null;
        void act({ action: 'preset', object: o.id, name });
      } }, h('option', { value: '' }, 'choose'), ...list.map((p) => h('option', { value: p.name, title: p.words }, p.name)))), help);
}

function field(o: StudioObject, x: Option): Node {
  const id = `option-${x.key}`, value = values(o)[x.key];
  const standard = x.standard === null || x.standard === undefined ? 'from the image' : String(x.standard);
  let control: HTMLElement;
  if (x.type === 'number' || x.type === 'integer')
    control = h('input', { id, type: 'number', step: x.type === 'integer' ? '1' : 'any', min: x.minimum,
      value: value === undefined ? '' : String(value), placeholder: standard, 'data-key': id,
      'aria-describedby': `${id}-help`,
      oninput: (e: Event) => {
        const f = e.target as HTMLInputElement;
        if (f.validity.badInput) return;
        set(o, x.key, f.value === '' ? null : Number(f.value));
      },
      onkeydown: (e: KeyboardEvent) => { if (e.key === 'Enter') void apply(o); } });
  else {
    const choices: [string, string][] = x.type === 'boolean' ? [['true', 'yes'], ['false', 'no']] : x.choices.map((c) => [c, c]);
    const words = x.type === 'boolean' && typeof x.standard === 'boolean' ? (x.standard ? 'yes' : 'no') : standard;
    control = h('select', { id, 'data-key': id, 'aria-describedby': `${id}-help`, onchange: (e: Event) => {
      const chosen = (e.target as HTMLSelectElement).value;
      set(o, x.key, chosen === '' ? null : x.type === 'boolean' ? chosen === 'true' : chosen);
    } }, h('option', { value: '' }, x.standard === null || x.standard === undefined ? words : `standard: ${words}`),
    ...choices.map(([v, w]) => h('option', { value: v, selected: value !== undefined && String(value) === v }, w)));
  }
  return h('div', { class: value === undefined ? 'field' : 'field set' },
    h('div', { class: 'line' }, h('label', { for: id }, x.label), control, h('span', { class: 'unit' }, x.unit)),
    h('p', { class: 'help', id: `${id}-help` }, x.help));
}

interface Energy { name: string; parameters: [string, string][] }

/** "window:mean=112,half-width=16", as on the command line. */
export function readEnergy(text: string): Energy {
  const colon = text.indexOf(':');
  if (colon < 0) return { name: text, parameters: [] };
  return { name: text.slice(0, colon), parameters: text.slice(colon + 1).split(',').filter(Boolean).map((p) => {
    const equals = p.indexOf('=');
    return equals < 0 ? [p, ''] : [p.slice(0, equals), p.slice(equals + 1)];
  }) };
}
export function writeEnergy(e: Energy): string {
  const set = e.parameters.filter(([, value]) => value !== '');
  return e.name + (set.length ? `:${set.map(([k, v]) => `${k}=${v}`).join(',')}` : '');
}

function energies(o: StudioObject): Node {
  const table = page.options!.energies;
  const texts = (values(o).energies as string[] | undefined) ?? [];
  const change = (index: number, next: Energy | null, redraw: boolean) => edit(o, (v) => {
    const list = [...((v.energies as string[] | undefined) ?? [])];
    if (next) list[index] = writeEnergy(next); else list.splice(index, 1);
    if (list.length) v.energies = list; else delete v.energies;
  }, redraw);
  return h('fieldset', {}, h('legend', {}, 'energy'),
    !texts.length && h('p', { class: 'help' }, 'Fitted to what was found round the clicks.'),
    ...texts.map((text, index) => energy(table, readEnergy(text), index, change)),
    table.length > 0 && h('button', { type: 'button', class: 'small', 'data-key': 'add-energy',
      onclick: () => change(texts.length, { name: table[0].name, parameters: [] }, true) }, texts.length ? 'Add a term' : 'Choose own energy'));
}

function energy(table: EnergyKind[], e: Energy, index: number,
                change: (index: number, next: Energy | null, redraw: boolean) => void): Node {
  const kind = table.find((k) => k.name === e.name);
  const current = new Map(e.parameters);
  return h('div', { class: 'energy' },
    h('div', { class: 'line' },
      h('select', { 'aria-label': `Kind of energy term ${index + 1}`, 'data-key': `energy${index}`,
        onchange: (event: Event) => change(index, { name: (event.target as HTMLSelectElement).value, parameters: [] }, true) },
      ...table.map((k) => h('option', { value: k.name, selected: k.name === e.name }, k.name))),
      iconButton('cross', `Remove energy term ${index + 1}`, () => change(index, null, true), { 'data-key': `energy-remove${index}` })),
    kind && h('p', { class: 'help' }, kind.formula ? h('code', {}, kind.formula) : null, kind.formula ? ' ' : '', kind.help),
    ...(kind?.parameters ?? []).map((p) => {
      const id = `energy${index}-${p.key}`;
      return h('div', { class: 'field' },
        h('div', { class: 'line' }, h('label', { for: id }, p.key),
          h('input', { id, type: 'text', inputmode: 'decimal', value: current.get(p.key) ?? '', 'data-key': id,
            placeholder: p.standard, 'aria-describedby': `${id}-help`,
            oninput: (event: Event) => {
              current.set(p.key, (event.target as HTMLInputElement).value.trim());
              change(index, { name: e.name, parameters: [...current] }, false);
            },
            onkeydown: (event: KeyboardEvent) => { if (event.key === 'Enter') byId('apply-options').click(); } }),
          h('span', { class: 'unit' }, p.unit)),
        h('p', { class: 'help', id: `${id}-help` }, p.help));
    }));
}

async function apply(o: StudioObject): Promise<void> {
  const sent = draft;
  if (!sent) return;
  const done = await act({ action: 'set_options', object: o.id, options: sent });
  // What was typed meanwhile is another draft.
  if (done && draft === sent) { draft = null; shown = ''; drawOptions(); }
}

function buttons(o: StudioObject): Node {
  return h('div', { class: 'buttons sticky' },
    h('button', { type: 'button', class: 'primary', id: 'apply-options', 'data-key': 'apply', disabled: !draft,
      onclick: () => { void apply(o); } }, 'Apply'),
    h('button', { type: 'button', disabled: !draft, 'data-key': 'revert', onclick: () => { draft = null; drawOptions(); } }, 'Discard'),
    h('button', { type: 'button', disabled: !Object.keys(values(o)).length, 'data-key': 'standard',
      onclick: () => { draft = changesTo(o, {}); drawOptions(); } }, 'All standard'));
}
