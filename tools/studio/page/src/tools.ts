// The bar at the top: tools, undo and redo, stop, sides, export.
import { redo, stop, undo, undoWords } from './actions';
import { byId } from './dom';
import { openExport } from './export';
import { activeObject, page, remember, setView, type Tool, volume } from './state';
import { draw, setSmooth } from './slices';

const TOOLS: Tool[] = ['inside', 'outside', 'crosshair'];

export function setTool(tool: Tool): void { setView({ tool }); }

export function setRadiological(radiological: boolean): void {
  remember('radiological', radiological ? 'yes' : 'no');
  setView({ radiological });
  draw({ volume: true });
}

export function startTools(): void {
  for (const tool of TOOLS) byId(`tool-${tool}`).addEventListener('click', () => setTool(tool));
  byId('undo').addEventListener('click', () => { void undo(); });
  byId('redo').addEventListener('click', () => { void redo(); });
  byId('stop').addEventListener('click', () => { void stop(); });
  byId('side').addEventListener('click', () => setRadiological(!page.view.radiological));
  byId('smooth').addEventListener('change', (event) => {
    const smooth = (event.target as HTMLInputElement).checked;
    remember('smooth', smooth ? 'yes' : 'no');
    setView({ smooth });
    setSmooth(smooth);
  });
  byId<HTMLInputElement>('smooth').checked = page.view.smooth;
  byId('open-export').addEventListener('click', openExport);
  byId('open-files').addEventListener('click', () => setView({ listFiles: !page.view.listFiles }));
}

export function drawTools(): void {
  const o = activeObject(), open = !!volume();
  for (const tool of TOOLS) byId(`tool-${tool}`).setAttribute('aria-pressed', String(tool === page.view.tool));
  const undoButton = byId<HTMLButtonElement>('undo'), redoButton = byId<HTMLButtonElement>('redo');
  const undone = undoWords();
  undoButton.disabled = undone === null;
  redoButton.disabled = !o?.can_redo;
  const undoTitle = `Undo${undone ? ` ${undone}` : ''} (Ctrl+Z)`;
  const redoTitle = `Redo${o?.can_redo && o.redo_words ? ` ${o.redo_words}` : ''} (Ctrl+Shift+Z)`;
  for (const [button, words] of [[undoButton, undoTitle], [redoButton, redoTitle]] as const) {
    button.title = words;
    button.setAttribute('aria-label', words);
  }
  byId<HTMLButtonElement>('stop').disabled = !page.job;
  byId<HTMLButtonElement>('open-export').disabled = !open || !page.state?.objects.some((x) => x.has_surface || x.clicks.length);
  byId('side').textContent = page.view.radiological ? 'R | L' : 'L | R';
  byId('side').title = page.view.radiological ? 'Radiological: the patient\'s right is on the left (R)'
    : 'Neurological: the patient\'s left is on the left (R)';
  byId('side').setAttribute('aria-label', byId('side').title);
  byId('side-words').textContent = page.view.radiological ? 'radiological' : 'neurological';
  byId('file-name').textContent = volume()?.path ?? 'no volume';
  const v = volume();
  byId('open-files').title = v ? `${v.path}: ${v.size.join(' x ')} voxels of ${v.spacing_mm.map((x) => Number(x.toFixed(3))).join(' x ')} mm${v.kept_in ? `; what is done is kept in ${v.kept_in}` : ''}. Opens the list of files (L)`
    : 'The list of files (L)';
}
