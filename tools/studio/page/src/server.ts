// Requests to the program and its events.
import type { Action, ExportRequest, Job, OptionTable, State } from './protocol';
import { changed, page, setState } from './state';
import { showError } from './messages';

export class RequestError extends Error {
  constructor(readonly status: number, message: string, readonly exists = false) { super(message); }
}

async function answer(response: Response): Promise<Response> {
  if (response.ok) return response;
  let words = `the program answered ${response.status}`;
  let exists = false;
  try {
    const body = await response.json();
    if (typeof body.error === 'string') words = body.error;
    exists = body.exists === true;
  } catch { /* an answer without JSON keeps the words above */ }
  if (response.status === 401) words = 'This page is no longer signed in: open the address that the program printed.';
  throw new RequestError(response.status, words, exists);
}

export async function get(path: string): Promise<Response> {
  return answer(await fetch(path, { cache: 'no-store' }));
}

async function post<T>(path: string, body: unknown): Promise<T> {
  const response = await fetch(path, {
    method: 'POST', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify(body),
  });
  return (await answer(response)).json() as Promise<T>;
}

/** Asks for something to be done; what cannot be is told to the person, and null comes back. */
export async function act(action: Action): Promise<{ revision: number; object?: number } | null> {
  try {
    return await post<{ revision: number; object?: number }>('/api/do', action);
  } catch (error) {
    showError(error instanceof RequestError ? error.message : 'The program does not answer.');
    return null;
  }
}

export function exportFile(request: ExportRequest): Promise<{ file: string; bytes: number }> {
  return post('/api/export', request);
}

export async function getOptions(): Promise<OptionTable> { return (await get('/api/options')).json(); }
export async function getCommand(object: number): Promise<string> {
  return (await (await get(`/api/command?object=${object}`)).json()).text;
}

/**
 * Listens to the program's events while the page is seen: a browser has six connections to a program, so that a few tabs would take
 * them all. `EventSource` itself connects again.
 */
export function listen(onJob: (job: Job) => void): void {
  let source: EventSource | null = null;
  const follow = () => {
    if (document.hidden) { source?.close(); source = null; restarted = true; return; }
    if (!source || source.readyState === EventSource.CLOSED) source = listenNow(onJob, follow);
  };
  document.addEventListener('visibilitychange', follow);
  follow();
}

function listenNow(onJob: (job: Job) => void, tryAnew: () => void): EventSource {
  const source = new EventSource('/api/events');
  source.addEventListener('open', () => { page.connected = true; changed(); });
  source.addEventListener('state', (event) => {
    page.connected = true;
    const state = JSON.parse((event as MessageEvent<string>).data) as State;
    // A program that was started anew counts from the beginning.
    setState(state, restarted);
    restarted = false;
  });
  source.addEventListener('progress', (event) => {
    const job = JSON.parse((event as MessageEvent<string>).data) as Job;
    page.job = job;
    onJob(job);  // and not `changed()`: many a second, and only the job is another one
  });
  source.addEventListener('error', () => {
    page.connected = false;
    page.job = null;
    restarted = true;
    changed();
    // The browser gives up for good after an answer that is not a stream (the program's port taken by another one, a 401): try anew.
    if (source.readyState === EventSource.CLOSED) setTimeout(tryAnew, 2000);
  });
  return source;
}
let restarted = false;  // it may have been

/** The state once it is at least as new as an answer. */
export async function until(condition: () => boolean, seconds = 5): Promise<boolean> {
  const end = performance.now() + 1000 * seconds;
  while (!condition()) {
    if (performance.now() > end) return false;
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
  return true;
}
