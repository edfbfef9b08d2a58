/**
 * A file that is read in parts. A server that answers ranges gives the parts; from one that does not, the file is
 * fetched whole, once, if it is not larger than WHOLE.
 */

/** Bytes up to which a file is fetched whole from a server without ranges. */
export const WHOLE = 200 * 2 ** 20;

export class Source {
  /** @param {string} url */
  constructor(url) {
    this.url = url;
    /** @type {Blob | null} */
    this.blob = null;
    /** @type {Promise<Blob> | null} */
    this.fetching = null;
  }

  /** @param {number} begin @param {number} end @returns {Promise<Uint8Array>} */
  async get(begin, end) {
    if (this.fetching) await this.fetching;
    if (this.blob) return new Uint8Array(await this.blob.slice(begin, end).arrayBuffer());
    const answer = await fetch(this.url, { headers: { Range: `bytes=${begin}-${end - 1}` } }).catch((error) => {
      throw Object.assign(error, { silent: true });
    });
    if (answer.status === 206) return new Uint8Array(await answer.arrayBuffer());
    if (!answer.ok) throw new Error(`${this.url}: the server answers ${answer.status}`);
    if (this.blob || this.fetching) {
      await answer.body?.cancel();
      return this.get(begin, end);
    }
    const size = Number(answer.headers.get('content-length') ?? 0);
    if (size > WHOLE) {
      await answer.body?.cancel();
      throw new Error(
        `${this.url}: this server sends no parts of files, and ${Math.round(size / 2 ** 20)} MiB are too many to fetch whole ` +
          `(limit ${WHOLE / 2 ** 20} MiB): use a server that answers range requests`,
      );
    }
    this.fetching = answer.blob();
    this.blob = await this.fetching;
    return this.get(begin, end);
  }
}
