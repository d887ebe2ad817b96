// The list of what the folder holds, where no volume is open or another one is wanted.
import type { ListedFile, Series } from './protocol';
import { byId, h, refill } from './dom';
import { act } from './server';
import { page, setView, volume } from './state';

let filter = '';
let shown = '';

export function drawFiles(): void {
  const state = page.state;
  const opening = page.job?.what === 'open';
  const visible = !!state && !opening && (!state.volume || page.view.listFiles);
  byId('files').hidden = !visible;
  byId('files-close').hidden = !state?.volume;
  if (!visible) { shown = ''; return; }
  const key = JSON.stringify([state.files, state.folder, state.volume?.path, filter]);
  if (key === shown) return;
  shown = key;
  byId('files-folder').textContent = state.folder;
  const words = filter.trim().toLowerCase();
  const files = state.files.filter((f) => !words || `${f.path} ${f.words ?? ''}`.toLowerCase().includes(words));
  refill(byId('files-list'), ...(files.length ? files.map(entry)
    : [h('li', { class: 'quiet' }, state.files.length ? 'Nothing here has that in its name.'
      : 'This folder holds no volume, DICOM folder or recipe that surfseg reads. Start the studio in another one.')]));
}

function open(file: ListedFile, series?: Series['id']): void {
  setView({ listFiles: false });
  void act({ action: 'open', path: file.path, ...(series === undefined ? {} : { series }) });
}

function entry(file: ListedFile): HTMLElement {
  const several = Array.isArray(file.series) && file.series.length > 1 ? file.series : null;
  const only = file.series === null || file.series === undefined || Array.isArray(file.series)
    ? (Array.isArray(file.series) && file.series.length === 1 ? file.series[0].id : undefined) : file.series;
  const current = file.path === volume()?.path;
  const what = [h('span', { class: 'path' }, file.path), h('span', { class: 'kind' }, file.kind),
    h('span', { class: 'words' }, file.words ?? '')];
  if (several)
    return h('li', { class: 'several' }, h('div', { class: 'file' }, ...what),
      h('ul', {}, ...several.map((s) => h('li', {}, h('button', { type: 'button', class: 'file', 'data-key': `${file.path} ${s.id}`,
        onclick: () => open(file, s.id) }, h('span', { class: 'path' }, String(s.id)), h('span', { class: 'words' }, s.words))))));
  return h('li', {}, h('button', { type: 'button', class: current ? 'file current' : 'file', 'data-key': `${file.path} ${only ?? ''}`,
    onclick: () => open(file, only) }, ...what));
}

export function startFiles(): void {
  byId<HTMLInputElement>('files-filter').addEventListener('input', (e) => { filter = (e.target as HTMLInputElement).value; drawFiles(); });
  byId('files-close').addEventListener('click', () => setView({ listFiles: false }));
}
