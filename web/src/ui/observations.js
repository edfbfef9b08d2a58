import { useEffect, useLayoutEffect, useRef, useState } from 'preact/hooks';
import { computed, effect, signal } from '@preact/signals';
import uPlot from 'uplot';
import * as s from '../state.js';
import { count, plain, smallWords, spaced } from '../core/format.js';
import { histogram } from '../core/statistics.js';
import { NO_FILTER, filtered, inWindow, laidOut, size, sorted } from '../core/rows.js';
import * as api from '../api.js';
import { FONT } from '../scene/labels.js';
import { html } from './html.js';

/** Whether there is no pointer that can rest anywhere. */
const FINGERS = window.matchMedia?.('(hover: none)').matches ?? false;

/** Pixels of the first line of a row, and of every further one. */
const ROW = 26;
const LINE = 18;

/** What would happen without the row that the pointer rests on. */
export const whatIf = signal(null);

export const rows = computed(() => {
  const o = s.observations.value;
  if (!o.id.length) return new Int32Array(0);
  return sorted(o, filtered(o, s.filter.value), s.sort.value.by, s.sort.value.down);
});

const COLUMNS = [
  ['state', '', 30],
  ['from', 'From → to', 104],
  ['kind', 'Kind', 126],
  ['w', 'w', 60],
  ['residual', 'v', 104],
  ['sigma', 'σ', 86],
  ['redundancy', 'r', 46],
  ['value', 'Value', 124],
  ['mdb', 'MDB', 100],
  ['external', 'Effect', 128],
  ['source', 'Source', 210],
];
const TITLE = Object.fromEntries(COLUMNS.map(([name, title]) => [name, title]));
/** Names may take what is left of the first line, the source what is left of its own. */
const lay = (width) => laidOut(COLUMNS, width, 'from', 'source');

const HINTS = {
  state: 'active, check or off', sigma: 'standard deviation of the value', residual: 'residual',
  redundancy: 'redundancy number: 0 is unchecked, 1 wholly checked', w: 'normalised residual',
  mdb: 'minimal detectable bias', external: 'largest effect of an error of that size that stays undetected, and where',
};

const STATES = { active: ['●', 'on'], check: ['◇', 'check'], off: ['○', 'off'] };

/** The minus of the program's words as it is set in print. @param {string | undefined} text */
const signed = (text) => text?.replace(/^-/, '\u2212');

export function cell(o, i, name, angle) {
  const words = o.words?.[name];
  switch (name) {
    case 'from':
      return label(o, i);
    case 'kind':
      return kindOf(o, i);
    case 'value':
      return signed(words?.[i]) ?? String(o.value[i]);
    case 'sigma':
    case 'residual':
    case 'mdb':
      return signed(words?.[i]) || smallWords(o[name][i], o.unit[i], angle);
    case 'external':
      return o.external[i] === null || o.external[i] === undefined ? '–' : `${words?.[i] || smallWords(o.external[i], 'm', angle)}${o.external_at[i] ? ` @ ${o.external_at[i]}` : ''}`;
    case 'redundancy':
    case 'w':
      return plain(o[name][i], 2);
    case 'source':
      return o.reason?.[i] ? `${o.reason[i]} · ${o.source[i]}` : o.source[i];
    default:
      return String(o[name][i] ?? '');
  }
}

export const label = (o, i) => `${o.from[i]}${o.to[i] ? ` → ${o.to[i]}` : ''}`;
export const kindOf = (o, i) => o.title?.[i] ?? `${spaced(o.kind[i])}${o.component?.[i] ? ` ${o.component[i]}` : ''}`;

/** Bars of w; a stretch drawn over them is what the table shows. */
function Histogram() {
  const host = useRef(null);
  useEffect(() => {
    let plot = null;
    const dispose = effect(() => {
      const o = s.observations.value;
      const dark = s.theme.value === 'dark';
      const width = Math.max(200, host.current.clientWidth);
      const values = o.w ?? [];
      let reach = 4;
      for (const w of values) if (w !== null && Math.abs(w) < 100) reach = Math.max(reach, Math.ceil(Math.abs(w)));
      const bins = Math.min(80, 16 * Math.ceil(reach / 2));
      const counts = histogram(values, -reach, reach, bins);
      const x = counts.map((_, i) => -reach + ((i + 0.5) * 2 * reach) / bins);
      const n = values.filter((w, i) => w !== null && w !== undefined && o.state[i] === 'active').length;
      const normal = x.map((v) => ((n * 2 * reach) / bins) * (Math.exp((-v * v) / 2) / Math.sqrt(2 * Math.PI)));
      const ink = dark ? '#9aa7b4' : '#5b6875';
      const axis = {
        stroke: ink, font: `11px ${FONT}`, grid: { show: false },
        ticks: { stroke: dark ? '#39424d' : '#cfd6dd', width: 1, size: 4 },
      };
      plot?.destroy();
      plot = new uPlot(
        {
          width, height: 104, legend: { show: false }, padding: [6, 14, 0, 0],
          cursor: { drag: { x: true, y: false, setScale: false }, points: { show: false }, y: false },
          scales: { x: { time: false, range: [-reach, reach] }, y: { range: (_, __, high) => [0, Math.max(1, high * 1.08)] } },
          axes: [{ ...axis, size: 22, space: 40 }, { ...axis, size: 34, space: 24 }],
          series: [
            {},
            { stroke: '#4c8fbd', fill: dark ? '#2f5f80' : '#9cc3dd', width: 1, paths: uPlot.paths.bars({ size: [0.94, 40], align: 0 }), points: { show: false } },
            { stroke: '#d9822b', width: 1.5, paths: uPlot.paths.spline(), points: { show: false } },
          ],
          hooks: {
            setSelect: [
              (u) => {
                if (u.select.width < 3) return;
                const low = u.posToVal(u.select.left, 'x');
                const high = u.posToVal(u.select.left + u.select.width, 'x');
                s.filter.value = { ...s.filter.peek(), low: low < -0.98 * reach ? null : Number(low.toFixed(2)), high: high > 0.98 * reach ? null : Number(high.toFixed(2)) };
              },
            ],
          },
        },
        [x, counts, normal],
        host.current,
      );
      plot.over.addEventListener('dblclick', () => {
        s.filter.value = { ...s.filter.peek(), low: null, high: null };
        plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
      });
    });
    return () => {
      dispose();
      plot?.destroy();
    };
  }, []);
  return html`<div class="histogram" ref=${host} role="img" aria-label="Histogram of the normalised residuals w with the normal curve; draw a stretch to filter"></div>`;
}

function Filters() {
  const f = s.filter.value;
  const o = s.observations.value;
  const set = (change) => (s.filter.value = { ...f, ...change });
  const some = JSON.stringify(f) !== JSON.stringify(NO_FILTER);
  const choose = (name, title, list) => html`<select aria-label=${title} value=${f[name]} onChange=${(e) => set({ [name]: e.currentTarget.value })}>
    <option value="">${title}</option>${list.map(([value, words]) => html`<option key=${value} value=${value} selected=${f[name] === value}>${words}</option>`)}</select>`;
  return html`<div class="filters">
    <input type="search" placeholder="Find names, sources, reasons" aria-label="Find" value=${f.text} onInput=${(e) => set({ text: e.currentTarget.value })} />
    ${choose('station', 'All stations', s.stationNames.value.map((x) => [x, x]))}
    ${choose('kind', 'All kinds', s.kinds.value.map((x) => [x, spaced(x)]))}
    ${choose('state', 'All states', [['active', 'on'], ['check', 'check'], ['off', 'off'], ['suspicious', 'suspicious']])}
    <span class="found">${count(rows.value.length)} of ${count(size(o))}${f.low !== null || f.high !== null ? html` · w ${f.low ?? '−∞'} to ${f.high ?? '∞'}` : ''}</span>
    ${some && html`<button type="button" class="button plain" onClick=${() => (s.filter.value = { ...NO_FILTER })}>Show all</button>`}
    <span class="links"><a href="tables/observations.csv" download>CSV</a> <a href="tables/observations.json" target="_blank" rel="noopener">JSON</a></span>
  </div>`;
}

/** Lines of a head or a row, of cells that `each` makes. */
const Lines = (lines, each) => lines.map((line, k) => html`<div key=${k} role="presentation" class=${k ? 'line-of further' : 'line-of'} style=${{ height: `${k ? LINE : ROW}px` }}>${line.map(({ name, width }) => each(name, { width: `${width}px` }))}</div>`);

function Head({ lines, width }) {
  const { by, down } = s.sort.value;
  return html`<div class="row head" role="row" style=${{ width: `${width}px` }}>
    ${Lines(lines, (name, style) => html`<button type="button" key=${name} role="columnheader" class=${`cell c-${name} ${by === name ? 'sorted' : ''}`} style=${style}
      title=${HINTS[name] ?? ''} aria-sort=${by === name ? (down ? 'descending' : 'ascending') : 'none'}
      onClick=${() => (s.sort.value = { by: name, down: by === name ? !down : ['w', 'mdb', 'external', 'residual', 'sigma'].includes(name) })}>
      ${name === 'state' ? html`<span class="sr">use</span>` : TITLE[name]}${by === name ? (down ? ' ↓' : ' ↑') : ''}</button>`)}
  </div>`;
}

function Row({ i, at, o, angle, does, live, lines, width, height }) {
  const id = o.id[i];
  const state = o.state[i];
  const picked = s.selection.value?.type === 'row' && s.selection.value.id === id;
  const chosen = s.chosenRows.value.has(id);
  const [sign, word] = STATES[state] ?? ['?', state];
  return html`<div role="row" aria-rowindex=${at + 2} aria-selected=${picked || chosen} class=${`row is-${state} ${o.suspicious[i] ? 'suspicious' : ''} ${picked || chosen ? 'picked' : ''}`}
    style=${{ transform: `translateY(${at * height}px)`, width: `${width}px`, height: `${height}px` }}
    onClick=${(e) => does.row(i, at, e)} onMouseEnter=${() => does.hover(i)} onDblClick=${() => does.visitRow(i)}>
    ${Lines(lines, (name, style) => {
      if (name === 'state') {
        return html`<span role="gridcell" key=${name} class="cell c-state" style=${style}>
          ${live
            ? html`<button type="button" class=${`use ${state}`} tabindex="-1" title=${`${word}: change`} aria-label=${`${label(o, i)} is ${word}: change`} onClick=${(e) => {
                e.stopPropagation();
                does.use([id]);
              }}>${sign}</button>`
            : html`<span class=${`use ${state}`} title=${word}>${sign}</span>`}</span>`;
      }
      const text = cell(o, i, name, angle);
      return html`<span role="gridcell" key=${name} class=${`cell c-${name}`} style=${style} title=${text}>${text}</span>`;
    })}
  </div>`;
}

function WhatIf() {
  const w = whatIf.value;
  if (s.defect.value) return null;
  if (!s.session.value) return null;
  if (!w || w.revision !== s.session.value.revision) return html`<div class="what-if muted">${FINGERS ? 'Tap' : 'Rest on'} a red row: what would happen without it?</div>`;
  if (w.words === undefined) return html`<div class="what-if muted">Without ${w.label} …</div>`;
  return html`<div class="what-if"><b>${w.label}:</b> ${w.words.replace('->', '→')}</div>`;
}


let asking = null;
let askTimer = 0;
const answers = new Map();
/** @param {number} i row @param {boolean} any of all rows, not of suspicious ones only */
export function askWhatIf(i, any = false) {
  const o = s.observations.value;
  const live = s.session.value;
  clearTimeout(askTimer);
  if (!live || (!o.suspicious[i] && !any) || o.state[i] !== 'active') return;
  const id = o.id[i];
  const key = `${live.revision}:${id}`;
  const name = `${label(o, i)} (${kindOf(o, i)})`;
  if (answers.has(key)) {
    whatIf.value = answers.get(key);
    return;
  }
  askTimer = setTimeout(async () => {
    asking?.abort();
    asking = new AbortController();
    whatIf.value = { id, label: name, revision: live.revision };
    try {
      const answer = await api.get('api/what-if', { observation: id }, asking.signal);
      const words = answer.words ?? `σ₀ ${plain(answer.sigma0, 3)}, dof ${answer.dof}, largest move ${answer.largest ? `${answer.largest.name} ${smallWords(answer.largest.moved, 'm', '')}` : 'none'}`;
      const out = { id, label: name, revision: live.revision, ...answer, words };
      answers.set(key, out);
      if (answers.size > 500) answers.clear();
      whatIf.value = out;
    } catch (error) {
      if (error.name !== 'AbortError') whatIf.value = { id, label: name, revision: live.revision, words: error.message };
    }
  }, 140);
}

export function Observations({ does }) {
  const host = useRef(null);
  const [view, setView] = useState({ top: 0, height: 400, width: 0 });
  const o = s.observations.value;
  const list = rows.value;
  const angle = s.scene.value?.angle ?? 'gon';
  const live = Boolean(s.session.value);
  useLayoutEffect(() => {
    const element = host.current;
    const measure = () => setView({ top: element.scrollTop, height: element.clientHeight, width: element.clientWidth });
    measure();
    element.addEventListener('scroll', measure, { passive: true });
    const watch = new ResizeObserver(measure);
    watch.observe(element);
    return () => {
      element.removeEventListener('scroll', measure);
      watch.disconnect();
    };
  }, []);
  const { lines, width } = lay(view.width);
  const high = ROW + (lines.length - 1) * LINE + (lines.length > 1 ? 3 : 0);
  // a row that was chosen elsewhere comes into sight
  const selected = s.selection.value?.type === 'row' ? s.selection.value.id : null;
  useEffect(() => {
    if (!selected) return;
    const at = list.findIndex((i) => o.id[i] === selected);
    if (at < 0) return;
    const element = host.current;
    const y = at * high;
    if (y < element.scrollTop || y > element.scrollTop + element.clientHeight - 2 * high) element.scrollTop = Math.max(0, y - element.clientHeight / 3);
  }, [selected]);
  const { first, last } = inWindow(view.top, view.height, high, list.length);
  const drawn = [];
  for (let at = first; at < last; at++) {
    drawn.push(html`<${Row} key=${list[at]} i=${list[at]} at=${at} o=${o} angle=${angle} does=${does} live=${live} lines=${lines} width=${width} height=${high} />`);
  }
  const key = (event) => {
    const at = selected === null ? -1 : list.findIndex((i) => o.id[i] === selected && (s.selection.value.row === undefined || i === s.selection.value.row));
    const go = (to) => {
      const next = Math.min(list.length - 1, Math.max(0, to));
      if (list.length) does.row(list[next], next, {});
      event.preventDefault();
    };
    if (event.key === 'ArrowDown') go(at + 1);
    else if (event.key === 'ArrowUp') go(at - 1);
    else if (event.key === 'PageDown') go(at + Math.floor(view.height / high));
    else if (event.key === 'PageUp') go(at - Math.floor(view.height / high));
    else if (event.key === 'Home') go(0);
    else if (event.key === 'End') go(list.length - 1);
    else if ((event.key === 'Enter' || event.key === 'x') && live && s.chosenRows.value.size) {
      does.use([...s.chosenRows.value]);
      event.preventDefault();
    }
  };
  const chosen = s.chosenRows.value.size;
  return html`<div class="panel observations">
    <${Histogram} />
    <${Filters} />
    <div class=${`grid ${s.stale.value ? 'stale' : ''}`} ref=${host} role="grid" aria-rowcount=${list.length + 1} aria-label="Observations" tabindex="0" onKeyDown=${key}>
      <${Head} lines=${lines} width=${width} />
      <div class="rows" role="rowgroup" style=${{ height: `${list.length * high}px`, width: `${width}px` }}>${drawn}</div>
      ${!list.length && html`<p class="empty">No observation passes these filters.</p>`}
    </div>
    <div class="foot" hidden=${!live && !chosen}>
      ${s.stale.value && live ? html`<span class="muted">Values are adjusted; tests are on their way …</span>` : html`<${WhatIf} />`}
      ${chosen > 0 && html`<span class="foot-tools">
        ${live && html`<button type="button" class="button" onClick=${() => does.use([...s.chosenRows.value])}>Off, check or on …</button>`}
        <button type="button" class="button plain" onClick=${does.rowLink}>Link</button></span>`}
    </div>
  </div>`;
}
