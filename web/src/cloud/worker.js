/** Fetches and decompresses nodes beside the page. One message a node, answered by one. */
import createLazPerf from 'laz-perf/lib/worker/laz-perf.js';
import { decoded } from './decode.js';
import { Source } from './source.js';

/** @type {Promise<any> | null} */
let ready = null;
const sources = new Map();

function decoder() {
  ready ??= (async () => {
    // as bytes: no server has to know the type of a .wasm
    const answer = await fetch(new URL('laz-perf.wasm', self.location.href));
    if (!answer.ok) throw new Error(`laz-perf.wasm: the server answers ${answer.status}`);
    return createLazPerf({ wasmBinary: new Uint8Array(await answer.arrayBuffer()) });
  })();
  return ready;
}

/** @param {any} laz @param {any} layout @param {Uint8Array} bytes @param {number} count */
function records(laz, layout, bytes, count) {
  const out = new Uint8Array(count * layout.recordLength);
  const from = laz._malloc(bytes.byteLength);
  const to = laz._malloc(layout.recordLength);
  const chunk = new laz.ChunkDecoder();
  try {
    laz.HEAPU8.set(bytes, from);
    chunk.open(layout.format, layout.recordLength, from);
    for (let i = 0; i < count; i++) {
      chunk.getPoint(to);
      // the memory may have grown, so its view is asked for again
      out.set(laz.HEAPU8.subarray(to, to + layout.recordLength), i * layout.recordLength);
    }
  } finally {
    laz._free(from);
    laz._free(to);
    chunk.delete();
  }
  return out;
}

self.onmessage = async (/** @type {MessageEvent} */ event) => {
  const { task, url, blob, layout, offset, length, centre, count } = event.data;
  try {
    let bytes;
    if (blob) bytes = new Uint8Array(await blob.arrayBuffer());
    else {
      let source = sources.get(url);
      if (!source) sources.set(url, (source = new Source(url)));
      bytes = await source.get(offset, offset + length);
    }
    const laz = await decoder();
    const columns = decoded(layout, records(laz, layout, bytes, count), centre, count);
    const buffers = Object.values(columns).filter(Boolean).map((column) => column.buffer);
    self.postMessage({ task, columns }, { transfer: buffers });
  } catch (error) {
    self.postMessage({ task, error: String(error?.message ?? error), silent: Boolean(error?.silent) });
  }
};
