// The dialog that writes files into the folder the studio was started with.
import type { ExportKind } from './protocol';
import { byId, h, refill } from './dom';
import { exportFile, RequestError } from './server';
import { activeObject, page, volume } from './state';

const KINDS: [ExportKind, string, string][] = [
  ['surface', 'Surface', 'The triangle mesh, with its space stated in the file.'],
  ['labels', 'Label map', 'Voxels on the grid of the scan: 0 outside, 1, 2, … the objects.'],
  ['measures', 'Measures', 'A table with volume, area and the verdict.'],
  ['picture', 'Picture', 'Slices with the outline.'],
  ['report', 'Report', 'A page for people, in one file that needs no network: verdict, slices, the surface to be turned, measures, how it was made.'],
  ['recipe', 'Recipe', 'Clicks and options: opened here or replayed on the command line, it repeats everything.'],
];
// Until the program has said what it can write.
const FORMATS: Record<ExportKind, string[]> = {
  surface: ['stl'], labels: ['nii.gz'], measures: ['csv'], picture: ['png'], report: ['html'], recipe: ['json'],
};

let kind: ExportKind = 'surface';
let format = 'stl';
let space: 'lps' | 'ras' = 'lps';
let target = 0;            // 0: all objects
let ownName: string | null = null;
let exists = false;
let result: { text: string; bad: boolean } | null = null;
let busy = false;

const dialog = () => byId<HTMLDialogElement>('export');

export function openExport(): void {
  if (!volume() || !page.state?.objects.length) return;
  target = activeObject()?.id ?? page.state.objects[0].id;
  ownName = null;
  exists = false;
  result = null;
  draw();
  dialog().showModal();
  dialog().querySelector<HTMLElement>('[data-key="kind-' + kind + '"]')?.focus();
}

function formats(): string[] { return page.options?.export[kind] ?? FORMATS[kind]; }

function proposedName(): string {
  // A recipe has no choice: it repeats all objects.
  const o = kind === 'recipe' ? undefined : page.state?.objects.find((x) => x.id === target);
  // With the scan's name: objects of several scans meet in one folder.
  const scan = (volume()?.path.split('/').pop() ?? 'objects').replace(/\.(nii|nrrd|nhdr|mha|mhd|vti|dcm|gz)(?=\.|$)/g, '');
  const stem = (o ? `${scan}-${o.name}` : scan).trim().replace(/[^\p{L}\p{N}._-]+/gu, '-').replace(/^[-.]+/, '') || 'object';
  const suffix = kind === 'labels' ? '-labels' : kind === 'recipe' ? '-recipe' : kind === 'measures' ? '-measures' : kind === 'report' ? '-report' : '';
  return `${stem}${suffix}.${format}`;
}

function draw(): void {
  if (!formats().includes(format)) format = formats()[0];
  const objects = page.state?.objects ?? [];
  const mayAll = kind !== 'surface' && kind !== 'picture';
  if (target === 0 && !mayAll) target = activeObject()?.id ?? objects[0]?.id ?? 0;
  const changed = (action: () => void) => () => { action(); exists = false; result = null; draw(); };
  const choice = (label: string, key: string, options: [string, string][], value: string, onpick: (v: string) => void) =>
    h('div', { class: 'line' }, h('label', { for: `export-${key}` }, label),
      h('select', { id: `export-${key}`, 'data-key': `export-${key}`,
        onchange: (e: Event) => changed(() => onpick((e.target as HTMLSelectElement).value))() },
      ...options.map(([v, words]) => h('option', { value: v, selected: v === value }, words))));
  const name = h('input', { id: 'export-name', type: 'text', value: ownName ?? proposedName(), spellcheck: 'false', 'data-key': 'export-name',
    oninput: (e: Event) => { ownName = (e.target as HTMLInputElement).value; if (exists) { exists = false; result = null; draw(); } } });
  refill(byId('export-body'),
    h('div', { class: 'kinds', role: 'radiogroup', 'aria-label': 'What to export' },
      ...KINDS.map(([value, words]) => h('button', { type: 'button', role: 'radio', 'aria-checked': String(value === kind), 'data-key': `kind-${value}`,
        class: value === kind ? 'chosen' : '', onclick: changed(() => {
          kind = value;
          if (kind !== 'surface' && kind !== 'picture') target = objects.length > 1 ? 0 : target;
          format = formats()[0];
        }) }, words))),
    h('p', { class: 'help' }, KINDS.find(([value]) => value === kind)![2]),
    kind !== 'recipe' && choice('Object', 'object', [...(mayAll && objects.length > 1 ? [['0', 'all objects'] as [string, string]] : []),
      ...objects.map((o) => [String(o.id), o.name] as [string, string])], String(target), (v) => { target = Number(v); }),
    formats().length > 1 && choice('Format', 'format', formats().map((f) => [f, f.toUpperCase()]), format, (v) => {
      // A name of one's own keeps its stem.
      if (ownName) ownName = ownName.replace(new RegExp(`\\.${format.replace('.', '\\.')}$`), `.${v}`);
      format = v;
    }),
    kind === 'surface' && choice('Space', 'space', [['lps', 'LPS (DICOM, ITK, Slicer)'], ['ras', 'RAS (NIfTI, FreeSurfer)']], space,
      (v) => { space = v as 'lps' | 'ras'; }),
    h('div', { class: 'line' }, h('label', { for: 'export-name' }, 'Name'), name),
    h('p', { class: 'help' }, page.state?.folder ? `Goes into the folder “${page.state.folder}”.` : 'Goes into the folder the studio was started with.'),
    result && h('p', { class: result.bad ? 'result bad' : 'result good', role: result.bad ? 'alert' : 'status' }, result.text));
  const go = byId<HTMLButtonElement>('export-go');
  go.textContent = exists ? 'Overwrite' : 'Export';
  go.className = exists ? 'danger' : 'primary';
  go.disabled = busy;
}

async function run(): Promise<void> {
  if (busy) return;
  const name = (ownName ?? proposedName()).trim();
  if (!name) { result = { text: 'The file needs a name.', bad: true }; draw(); return; }
  busy = true;
  draw();
  try {
    const done = await exportFile({ what: kind, object: kind === 'recipe' ? 0 : target, format, space, name, overwrite: exists });
    exists = false;
    result = { text: `Written: ${done.file}, ${bytes(done.bytes)}`, bad: false };
  } catch (error) {
    exists = error instanceof RequestError && error.exists;
    const words = error instanceof RequestError ? error.message : 'The program does not answer.';
    result = { text: exists && !words.endsWith('?') ? `${words.replace(/\.?$/, '.')} Overwrite it?` : words, bad: true };
  }
  busy = false;
  draw();
}

function bytes(n: number): string {
  return n < 1000 ? `${n} bytes` : n < 1e6 ? `${(n / 1000).toFixed(1)} kB` : `${(n / 1e6).toFixed(1)} MB`;
}

export function startExport(): void {
  byId('export-form').addEventListener('submit', (event) => { event.preventDefault(); void run(); });
  byId('export-close').addEventListener('click', () => dialog().close());
}
