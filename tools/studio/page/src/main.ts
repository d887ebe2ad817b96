// The page of surfseg studio: starts the parts, and brings them up to date when something changes.
import { click, moveClick } from './actions';
import { drawCandidates } from './candidates';
import { byId, h, refill } from './dom';
import { drawFiles, startFiles } from './files';
import { startExport } from './export';
import { drawHint, startHelp } from './help';
import { startKeys } from './keys';
import { showError } from './messages';
import { drawObjects, startObjects } from './objects';
import { drawOptions } from './options';
import { arrange, drawPanes, startPanes } from './panes';
import { getOptions, listen } from './server';
import { changed, object, onChange, page, volume } from './state';
import { crosshairFraction, crosshairWorld, draw, dropVolume, loaded, lookAt, showVolume, startSlices, viewOf } from './slices';
import { drawSolid, resetSolid, solidRotation, startSolid } from './solid';
import { drawPosition, drawStatus, startSpinners, jobWords, tellPosition } from './status';
import { followJob, followState, forgetSurfaces, onNewSurface, surfaces } from './surfaces';
import { startTheme } from './theme';
import { drawTools, startTools } from './tools';
import { fetchVolume } from './volume';
import { drawWindowChoices, startWindow, windowChanged } from './window_level';
import type { SliceName } from './geometry';
import type { Point } from './protocol';

let wantedVolume = -1;
let hasFailed = false, wasLost = false;  // the wanted volume; the connection
let errorSeen = Number(sessionStorage.getItem('error-seen') ?? -1);

/** Fetches the volume when another one has been opened; a newer one wins. One that failed is fetched again after a lost connection, not before. */
async function followVolume(): Promise<void> {
  const v = volume();
  if (wasLost && page.connected && hasFailed) wantedVolume = -2;
  wasLost = !page.connected;
  if (!v) {
    if (wantedVolume !== -1) { wantedVolume = -1; dropVolume(); forgetSurfaces(); draw({ volume: true }); }
    return;
  }
  if (v.revision === wantedVolume) return;
  wantedVolume = v.revision;
  hasFailed = false;
  dropVolume();
  forgetSurfaces();
  resetSolid();
  const mine = () => volume()?.revision === v.revision && wantedVolume === v.revision;
  const progress = (words: string, share: number) => {
    byId('loading-words').textContent = words;
    byId<HTMLProgressElement>('loading-bar').value = share;
  };
  byId('loading').hidden = false;
  progress(`Loading ${v.path}`, 0);
  try {
    const buffer = await fetchVolume(v.revision, (share) => { if (mine()) progress(`Loading ${v.path}, ${Math.round(100 * share)} %`, 0.9 * share); });
    if (!mine()) return;
    progress(`Showing ${v.path}`, 0.95);
    // Lets the bar be seen before the upload to the graphics blocks the page.
    await new Promise((resolve) => setTimeout(resolve, 30));
    if (!mine() || !(await showVolume(buffer, v, mine))) return;
    windowChanged(false);
    followState();
  } catch (error) {
    if (mine()) { hasFailed = true; showError(`The volume cannot be shown: ${(error as Error).message}`); }
  } finally {
    if (wantedVolume === v.revision || wantedVolume < 0) byId('loading').hidden = true;
    changed();
  }
}

function drawNotes(): void {
  const notes = volume()?.notes ?? [];
  const key = JSON.stringify(notes);
  const container = byId('volume-notes');
  if (container.dataset.shown === key) return;
  container.dataset.shown = key;
  container.hidden = !notes.length;
  refill(container, ...notes.map((n) => h('li', {}, n)));
}

function drawError(): void {
  const error = page.state?.error;
  if (!error || error.id === errorSeen) return;
  errorSeen = error.id;
  try { sessionStorage.setItem('error-seen', String(error.id)); } catch { /* without storage it may be told again */ }
  showError(error.text);
}

function drawOpening(): void {
  const opening = page.job?.what === 'open';
  byId('opening').hidden = !opening;
  if (opening) byId('opening-words').textContent = jobWords();
}

let title = '';
function drawAll(): void {
  drawTools();
  drawObjects();
  drawCandidates();
  drawOptions();
  drawFiles();
  drawWindowChoices();
  drawPanes();
  drawStatus();
  drawError();
  drawNotes();
  drawOpening();
  drawHint(!!loaded && !page.view.listFiles);
  const next = `${volume()?.path.split('/').pop() ?? page.state?.folder ?? ''} – surfseg studio`;
  if (next !== title) { title = next; document.title = next; }
  byId('no-server').hidden = page.state !== null;
  draw({});
  drawSolid();
}

async function start(): Promise<void> {
  startTheme();
  startHelp();
  startTools();
  startObjects();
  startFiles();
  startExport();
  startWindow();
  startKeys();
  startTabs();
  startPanes();
  startSpinners();
  await startSlices({
    click: (world, side) => { void click(world, side); },
    moveClick: (id, index, world, was) => { void moveClick(id, index, world, was); },
    hover: tellPosition,
    moved: () => { drawPanes(); drawPosition(); drawSolid(); },
    window: () => windowChanged(),
  });
  startSolid(lookAt, crosshairWorld);
  arrange();
  onNewSurface(() => { frames++; draw({}); drawSolid(); drawObjects(); });
  onChange(() => { void followVolume(); followState(); drawAll(); drawPosition(); });
  getOptions().then((options) => { page.options = options; changed(); }, (error: Error) => showError(error.message));
  listen(() => { followJob(); drawStatus(); drawOpening(); });
  changed();
}

function startTabs(): void {
  const tabs = ['objects', 'options'];
  const show = (name: string) => {
    for (const tab of tabs) {
      byId(`tab-${tab}`).setAttribute('aria-selected', String(tab === name));
      byId(`tab-${tab}`).tabIndex = tab === name ? 0 : -1;
      byId(`panel-${tab}`).hidden = tab !== name;
    }
  };
  for (const tab of tabs) {
    byId(`tab-${tab}`).addEventListener('click', () => show(tab));
    byId(`tab-${tab}`).addEventListener('keydown', (event) => {
      if (event.key !== 'ArrowLeft' && event.key !== 'ArrowRight') return;
      const other = tabs[(tabs.indexOf(tab) + 1) % tabs.length];
      show(other);
      byId(`tab-${other}`).focus();
      event.stopPropagation();
    });
  }
  show('objects');
}

// What the tests read; nothing here changes anything but what is looked at.
let frames = 0;
const readable = {
  get state() { return structuredClone(page.state); },
  get view() { return { ...page.view, hidden: [...page.view.hidden] }; },
  get connected() { return page.connected; },
  get ready() { return loaded !== null && loaded.about.revision === volume()?.revision; },
  get framesShown() { return frames; },
  get crosshair() { return crosshairWorld(); },
  get rotation() { return solidRotation(); },
  get surfaces() { return [...surfaces].map(([id, s]) => ({ id, frame: s.frame, triangles: s.triangles.length / 3, arrays: +!!s.deviation + +!!s.edge })); },
  /** The pane's place in the window. */
  pane(name: SliceName) {
    const stage = byId('views').getBoundingClientRect(), r = viewOf(name)?.rectangle;
    return r && { left: stage.left + r.left, top: stage.top + r.top, width: r.width, height: r.height };
  },
  /** The point of the slice that is seen at a position of the window, and the reverse. */
  world(name: SliceName, x: number, y: number): Point | null {
    const stage = byId('views').getBoundingClientRect(), view = viewOf(name);
    return view && loaded ? loaded.world(view.fraction(x - stage.left, y - stage.top, crosshairFraction())) : null;
  },
  position(name: SliceName, world: Point): [number, number] | null {
    const stage = byId('views').getBoundingClientRect(), view = viewOf(name);
    if (!view || !loaded) return null;
    const [x, y] = view.pixelOf(loaded.fraction(world));
    return [x + stage.left, y + stage.top];
  },
  valueAt(world: Point): number | null { return loaded ? loaded.value(loaded.fraction(world)) : null; },
  lookAt,
  clicksOf(id: number) { return object(id)?.clicks ?? null; },
};
Object.defineProperty(window, 'studio', { value: readable });

start().catch((error: Error) => {
  showError(/WebGL/i.test(error.message) ? `This browser offers no WebGL 2, which the views need (${error.message}).` : error.message);
});
