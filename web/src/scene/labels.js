/** Symbols and names, drawn flat over the picture. A name that finds no free place beside its symbol is left out. */

export const FONT = '-apple-system, "Segoe UI", Roboto, Ubuntu, Cantarell, "Liberation Sans", Arial, sans-serif';

/**
 * @typedef {{x: number, y: number, text: string, symbol: string, colour: string, weight: number, strong?: boolean, small?: boolean}} Mark
 */

/** Boxes taken so far, found by squares of the screen. */
export class Room {
  constructor(cell = 64) {
    this.cell = cell;
    this.cells = new Map();
  }
  #over([x0, y0, x1, y1]) {
    const keys = [];
    for (let i = Math.floor(x0 / this.cell); i <= Math.floor(x1 / this.cell); i++)
      for (let j = Math.floor(y0 / this.cell); j <= Math.floor(y1 / this.cell); j++) keys.push(`${i},${j}`);
    return keys;
  }
  /** @param {number[]} box */
  free(box) {
    for (const key of this.#over(box))
      for (const b of this.cells.get(key) ?? [])
        if (box[0] < b[2] && b[0] < box[2] && box[1] < b[3] && b[1] < box[3]) return false;
    return true;
  }
  /** @param {number[]} box */
  take(box) {
    for (const key of this.#over(box)) {
      if (!this.cells.has(key)) this.cells.set(key, []);
      this.cells.get(key).push(box);
    }
  }
}

/**
 * Where the names go: heavy ones first; right, left, above, below.
 * @param {Mark[]} marks @param {(text: string, strong: boolean) => number} width @param {number} tall
 * @returns {{mark: Mark, x: number, y: number}[]} the left end and the middle height of each name that has room
 */
export function arranged(marks, width, tall) {
  const room = new Room();
  const order = [...marks].sort((a, b) => b.weight - a.weight);
  for (const mark of order) room.take([mark.x - 5, mark.y - 5, mark.x + 5, mark.y + 5]);
  const out = [];
  for (const mark of order) {
    if (!mark.text) continue;
    const w = width(mark.text, Boolean(mark.strong));
    const places = [
      [mark.x + 9, mark.y],
      [mark.x - 9 - w, mark.y],
      [mark.x - w / 2, mark.y - tall - 3],
      [mark.x - w / 2, mark.y + tall + 3],
    ];
    for (const [x, y] of places) {
      const box = [x - 2, y - tall / 2 - 1, x + w + 2, y + tall / 2 + 1];
      if (!room.free(box)) continue;
      room.take(box);
      out.push({ mark, x, y });
      break;
    }
  }
  return out;
}

/** @param {CanvasRenderingContext2D} ink @param {Mark} mark @param {string} halo */
function symbol(ink, mark, halo) {
  const r = mark.strong ? 6.5 : mark.small ? 3.6 : 4.5;
  ink.beginPath();
  if (mark.symbol === 'triangle') {
    ink.moveTo(mark.x, mark.y - r * 1.15);
    ink.lineTo(mark.x + r, mark.y + r * 0.7);
    ink.lineTo(mark.x - r, mark.y + r * 0.7);
    ink.closePath();
  } else if (mark.symbol === 'diamond') {
    ink.moveTo(mark.x, mark.y - r);
    ink.lineTo(mark.x + r, mark.y);
    ink.lineTo(mark.x, mark.y + r);
    ink.lineTo(mark.x - r, mark.y);
    ink.closePath();
  } else if (mark.symbol === 'square') {
    ink.rect(mark.x - r * 0.8, mark.y - r * 0.8, r * 1.6, r * 1.6);
  } else if (mark.symbol === 'cross') {
    ink.moveTo(mark.x - r * 0.8, mark.y - r * 0.8);
    ink.lineTo(mark.x + r * 0.8, mark.y + r * 0.8);
    ink.moveTo(mark.x + r * 0.8, mark.y - r * 0.8);
    ink.lineTo(mark.x - r * 0.8, mark.y + r * 0.8);
    ink.strokeStyle = halo;
    ink.lineWidth = 4;
    ink.stroke();
    ink.strokeStyle = mark.colour;
    ink.lineWidth = 1.75;
    ink.stroke();
    return;
  } else if (mark.symbol === 'ring') {
    ink.arc(mark.x, mark.y, r + 4, 0, 2 * Math.PI);
    ink.strokeStyle = halo;
    ink.lineWidth = 4;
    ink.stroke();
    ink.strokeStyle = mark.colour;
    ink.lineWidth = 2;
    ink.stroke();
    return;
  } else if (mark.symbol === 'dot') {
    ink.arc(mark.x, mark.y, 2.5, 0, 2 * Math.PI);
  } else if (mark.symbol === 'end') {
    ink.arc(mark.x, mark.y, 5.5, 0, 2 * Math.PI);
    ink.fillStyle = halo;
    ink.fill();
    ink.strokeStyle = mark.colour;
    ink.lineWidth = 3;
    ink.stroke();
    return;
  } else if (mark.symbol === 'plate') {
    return;
  } else {
    ink.arc(mark.x, mark.y, r * 0.8, 0, 2 * Math.PI);
  }
  ink.fillStyle = mark.colour;
  ink.strokeStyle = halo;
  ink.lineWidth = 1.75;
  ink.fill();
  ink.stroke();
}

/**
 * @param {CanvasRenderingContext2D} ink @param {Mark[]} marks
 * @param {{text: string, halo: string, ratio: number, names: boolean}} look
 */
export function drawMarks(ink, marks, look) {
  const font = (/** @type {boolean} */ strong) =>
    `${strong ? 700 : 600} 12px ${FONT}`;
  const width = (/** @type {string} */ text, /** @type {boolean} */ strong) => {
    ink.font = font(strong);
    return ink.measureText(text).width;
  };
  const plates = marks.filter((mark) => mark.symbol === 'plate');
  const places = look.names ? arranged(marks.filter((mark) => mark.symbol !== 'plate'), width, 12) : [];
  for (const mark of [...marks].sort((a, b) => a.weight - b.weight)) symbol(ink, mark, look.halo);
  ink.textBaseline = 'middle';
  ink.lineJoin = 'round';
  for (const { mark, x, y } of places) {
    ink.font = font(Boolean(mark.strong));
    ink.strokeStyle = look.halo;
    ink.lineWidth = 3.5;
    ink.strokeText(mark.text, x, y);
    ink.fillStyle = look.text;
    ink.fillText(mark.text, x, y);
  }
  for (const mark of plates) plate(ink, mark, width(mark.text, true), look);
}

/** A number that must be read whatever is behind it: on a plate of its own. */
function plate(ink, mark, wide, look) {
  ink.beginPath();
  ink.roundRect(mark.x - wide / 2 - 8, mark.y - 11, wide + 16, 22, 6);
  ink.fillStyle = look.halo;
  ink.fill();
  ink.strokeStyle = mark.colour;
  ink.lineWidth = 1.5;
  ink.stroke();
  ink.font = `700 12px ${FONT}`;
  ink.fillStyle = look.text;
  ink.fillText(mark.text, mark.x - wide / 2, mark.y + 0.5);
}

/** A line that is seen on any ground. @param {CanvasRenderingContext2D} ink @param {number[]} a @param {number[]} b @param {string} halo */
export function drawLine(ink, a, b, halo) {
  ink.lineCap = 'round';
  for (const [width, style] of [[7, halo], [3, '#0b7fab']]) {
    ink.beginPath();
    ink.moveTo(a[0], a[1]);
    ink.lineTo(b[0], b[1]);
    ink.strokeStyle = style;
    ink.lineWidth = Number(width);
    ink.stroke();
  }
  ink.lineCap = 'butt';
}
