/** Talking to the program. Everything goes to where the page came from. */

export class Refused extends Error {
  /** @param {number} status @param {any} body */
  constructor(status, body) {
    super(body?.sentence ?? body?.detail ?? (Array.isArray(body?.defect) ? body.defect.join(' ') : '') ?? `the program answers ${status}`);
    this.status = status;
    this.body = body;
  }
}

/** Nobody answers where the page came from. */
export class Gone extends Error {
  constructor() {
    super('The program that gave this page does not answer.');
  }
}

/** Told whether somebody answers, with every question. @type {(up: boolean) => void} */
let heard = () => {};
/** @param {(up: boolean) => void} does */
export function listening(does) {
  heard = does;
}

/** @param {URL} url @param {RequestInit} how */
async function asked(url, how) {
  try {
    const response = await fetch(url, how);
    heard(true);
    return response;
  } catch (error) {
    if (/** @type {any} */ (error)?.name === 'AbortError') throw error;
    heard(false);
    throw new Gone();
  }
}

async function answer(response) {
  let body = null;
  try {
    body = await response.json();
  } catch {
    // an answer without words
  }
  if (!response.ok) throw new Refused(response.status, body);
  return body;
}

/** @param {string} path @param {Record<string, string | number>} query @param {AbortSignal} [signal] */
export async function get(path, query = {}, signal = undefined) {
  const url = new URL(path, document.baseURI);
  for (const [key, value] of Object.entries(query)) url.searchParams.set(key, String(value));
  return answer(await asked(url, { headers: { Accept: 'application/json' }, signal }));
}

/** Numbers of eight bytes of a file beside the page. @param {string} path */
export async function numbers(path) {
  const response = await asked(new URL(path, document.baseURI), {});
  if (!response.ok) throw new Refused(response.status, null);
  return new Float64Array(await response.arrayBuffer());
}

/** @param {string} path @param {any} body */
export async function post(path, body) {
  return answer(
    await asked(new URL(path, document.baseURI), {
      method: 'POST',
      headers: { 'Content-Type': 'application/json', Accept: 'application/json' },
      body: JSON.stringify(body),
    }),
  );
}

/** @param {Record<string, (data: any) => void>} on by the name of the event @param {(alive: boolean) => void} alive */
export function events(on, alive) {
  const source = new EventSource(new URL('api/events', document.baseURI));
  for (const [name, does] of Object.entries(on)) {
    source.addEventListener(name, (event) => {
      let data = null;
      try {
        data = JSON.parse(/** @type {MessageEvent} */ (event).data);
      } catch {
        return;
      }
      does(data);
    });
  }
  source.onopen = () => alive(true);
  source.onerror = () => alive(false);
  return source;
}
