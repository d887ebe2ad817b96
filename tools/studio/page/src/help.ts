// The help on "?", and the hint of the first time.
import { byId, h } from './dom';
import { page, remember, remembered } from './state';

const MOUSE: [string, string][] = [
  ['Left click', 'a click with the chosen tool: inside or outside of the object'],
  ['Shift + left click', 'the other side'],
  ['Ctrl + left click', 'only looks: moves the crosshair'],
  ['Left drag', 'moves the crosshair; on a click: moves the click'],
  ['Wheel', 'through the slices'],
  ['Ctrl + wheel', 'zooms'],
  ['Middle drag', 'moves the picture'],
  ['Right drag', 'window: sideways its width, up and down its level'],
  ['3-D', 'left drag turns, Shift or middle drag moves, wheel zooms, a click on the surface brings the crosshair there'],
];
const KEYS: [string, string][] = [
  ['I, O, C', 'tool: inside click, outside click, crosshair'],
  ['Arrows', 'crosshair by one voxel (in 3-D: turn)'],
  ['Page Up, Page Down', 'through the slices of the pane that has the focus'],
  ['Enter', 'click at the crosshair; with Shift on the other side'],
  ['[, ]', 'previous, next click of the object'],
  ['Delete, M', 'deletes the selected click, moves it to the crosshair'],
  ['Ctrl+Z, Ctrl+Shift+Z', 'undo, redo'],
  ['Esc', 'stops the evolution where it is'],
  ['G', 'goes on after a stop'],
  ['P', 'takes the next proposal'],
  ['A, N', 'adds an object, next object'],
  ['H, X', 'shows or hides the object, the crosshair'],
  ['D', 'looks where the surface is doubtful'],
  ['W', 'next window'],
  ['R', 'radiological or neurological side'],
  ['+, −, 0', 'zoom in, out, fit'],
  ['1, 2, 3, 4', 'enlarges a pane, and back'],
  ['E', 'export'],
  ['L', 'list of files'],
  ['T', 'dark or light'],
  ['?', 'this help'],
];

const table = (rows: [string, string][]) => h('table', {}, h('tbody', {}, ...rows.map(([key, words]) =>
  h('tr', {}, h('th', { scope: 'row' }, key), h('td', {}, words)))));

export function startHelp(): void {
  byId('help-body').append(
    h('p', {}, 'Click inside the structure that you want. Where the surface goes too far, click outside; where something is missing, click inside. '
      + 'Every click is kept, can be dragged, deleted and undone, and the whole can be repeated on the command line.'),
    h('div', { class: 'columns' }, h('section', {}, h('h3', {}, 'Keyboard'), table(KEYS)),
      h('section', {}, h('h3', {}, 'Mouse'), table(MOUSE), h('h3', {}, 'Colours of the mesh'),
        h('p', {}, 'Deviation: how far the surface may be off, in mm. Edge strength: how well the image holds it. Dark red is doubtful in both.'))),
    h('p', { class: 'quiet' }, 'Not a medical device. ', h('a', { href: 'licences.txt', target: '_blank', rel: 'noopener' }, 'Licences')));
  byId('help-button').addEventListener('click', openHelp);
  byId('help-close').addEventListener('click', () => byId<HTMLDialogElement>('help').close());
  byId('hint-close').addEventListener('click', () => { remember('hint', 'seen'); byId('hint').hidden = true; });
}

export function openHelp(): void { byId<HTMLDialogElement>('help').showModal(); }

/** Three lines, until they are dismissed once; a surface is not hidden by them. */
export function drawHint(volumeShown: boolean): void {
  byId('hint').hidden = !volumeShown || remembered('hint') === 'seen' || !!page.state?.objects.some((o) => o.clicks.length);
}
