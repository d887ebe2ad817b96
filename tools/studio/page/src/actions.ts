// What buttons, keys and the mouse ask the program for.
import type { Point, Side, StudioObject } from './protocol';
import { showNotice } from './messages';
import { act, getCommand, until } from './server';
import { activeObject, object as find, page, setView, volume } from './state';
import { showError } from './messages';

/** The active object; made first where there is none. */
async function objectForClick(): Promise<number | null> {
  const active = activeObject();
  if (active) return active.id;
  return addObject();
}

export async function addObject(): Promise<number | null> {
  if (!volume()) return null;
  const known = new Set(page.state?.objects.map((o) => o.id));
  const done = await act({ action: 'add_object' });
  if (!done) return null;
  const added = () => page.state?.objects.find((o) => (done.object === undefined ? !known.has(o.id) : o.id === done.object));
  if (!(await until(() => added() !== undefined))) return null;
  const id = added()!.id;
  setView({ active: id, click: null });
  return id;
}

export async function click(point: Point, side: Side): Promise<void> {
  const object = await objectForClick();
  if (object === null) return;
  if (page.view.hidden.delete(object)) setView({});
  await act({ action: 'click', object, point, side });
}

/** @param was where it was when it was taken: the state of this moment may not be the program's, which then refuses. */
export async function moveClick(object: number, index: number, point: Point, was = placeOf(object, index)): Promise<void> {
  const done = await act({ action: 'move_click', object, index, point, was });
  if (!done || !(await until(() => page.state !== null && page.state.revision >= done.revision))) return;
  // It stands at the end now, as one that has just been made; so that it stays the selected one.
  const last = (find(object)?.clicks.length ?? 0) - 1;
  if (last >= 0 && !page.view.click) setView({ click: { object, index: last } });
}

export async function deleteClick(object: number, index: number): Promise<void> {
  const was = placeOf(object, index);
  setView({ click: null });
  await act({ action: 'delete_click', object, index, was });
}

function placeOf(object: number, index: number): Point | undefined { return find(object)?.clicks[index]?.point; }

export async function removeObject(o: StudioObject): Promise<void> {
  if (await act({ action: 'remove_object', object: o.id })) showNotice(`${o.name} was removed; undo brings it back`);
}

/** What undo would take back of the active object, or where there is none the last removal; null if there is nothing. */
export function undoWords(): string | null {
  const o = activeObject();
  if (o) return o.can_undo ? o.undo_words ?? '' : null;
  return page.state?.removed ? `removal of ${page.state.removed}` : null;
}

export async function undo(): Promise<void> {
  const words = undoWords();
  if (words === null) return;
  const known = new Set(page.state?.objects.map((o) => o.id));
  const done = await act({ action: 'undo', object: activeObject()?.id ?? 0 });
  if (!done) return;
  showNotice(`Undone${words && `: ${words}`}`);
  await until(() => page.state !== null && page.state.revision >= done.revision);
  const back = page.state?.objects.find((o) => !known.has(o.id));
  if (back) setView({ active: back.id, click: null });
}
export async function redo(): Promise<void> {
  const o = activeObject();
  if (!o?.can_redo) return;
  if (await act({ action: 'redo', object: o.id })) showNotice(`Redone${o.redo_words ? `: ${o.redo_words}` : ''}`);
}

export async function stop(): Promise<void> { await act({ action: 'stop' }); }
export async function evolve(): Promise<void> {
  const o = activeObject();
  if (o) await act({ action: 'evolve', object: o.id });
}

export function toggleHidden(id: number): void {
  const hidden = page.view.hidden;
  if (!hidden.delete(id)) hidden.add(id);
  setView({});
}

export async function copyCommand(): Promise<void> {
  const o = activeObject();
  if (!o) return;
  let text: string;
  try { text = await getCommand(o.id); } catch (error) { showError((error as Error).message); return; }
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    // Browsers that refuse the clipboard still copy a selection.
    const area = document.createElement('textarea');
    area.value = text;
    document.body.append(area);
    area.select();
    const copied = document.execCommand('copy');
    area.remove();
    if (!copied) { showError(`The browser refused to copy: ${text}`); return; }
  }
  showNotice(`Copied: ${text}`);
}
