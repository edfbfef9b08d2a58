/** The page: fetches the scene, makes the picture and the panels, and carries news between them. */
import { batch, effect } from '@preact/signals';
import { render } from 'preact';
import * as s from './state.js';
import * as api from './api.js';
import { length, ofDifference } from './core/matrix.js';
import { metres, millimetres } from './core/format.js';
import { ROLES, look } from './scene/network.js';
import { VIEWS } from './scene/camera.js';
import { Viewer } from './scene/viewer.js';
import { Banners, TopBar } from './ui/topbar.js';
import { Left } from './ui/left.js';
import { Hud, Legend } from './ui/legend.js';
import { Observations, askWhatIf, kindOf, label, rows } from './ui/observations.js';
import { Changes, Notes, Points, Selection, Targets } from './ui/panels.js';
import { Dialogs } from './ui/dialogs.js';
import { Icon, html } from './ui/html.js';
import { useEffect, useRef } from 'preact/hooks';

/** @type {Viewer | null} */
let viewer = null;
let tip = null;

const TABS = [
  ['observations', 'Observations'],
  ['points', 'Points'],
  ['targets', 'Targets'],
  ['changes', 'Changes'],
  ['notes', 'Notes'],
  ['selection', 'Selection'],
];

// -- what the buttons do --------------------------------------------------------------------------------------------------

function placeOf(name) {
  return s.points.value.find((p) => p.name === name)?.xyz ?? s.displaced.value.find((p) => p.name === name)?.from ?? s.stations.value.find((p) => p.name === name)?.xyz ?? null;
}

async function details(point) {
  const station = s.stations.value.find((p) => p.name === point.station);
  const from = station?.posed?.slice(0, 3).map((row) => row[3]) ?? station?.xyz;
  if (from) point.range = length(point.xyz.map((x, k) => x - from[k]));
  else point.range = null;
  const set = (change) => {
    if (s.selection.value?.point === point || s.selection.value?.point?.key === point.key) {
      s.selection.value = { type: 'cloud', point: { ...s.selection.value.point, ...change } };
    }
  };
  point.key = `${point.cloud}:${point.node}:${point.index}`;
  try {
    const more = await api.get('api/point', { cloud: point.cloud, x: point.xyz[0], y: point.xyz[1], z: point.xyz[2], node: point.node, index: point.index });
    set({ more, asking: false });
  } catch (error) {
    set({ asking: false, without: error.status === 404 ? 'The full covariance and the error budget need the program: tribrach view.' : error.message });
  }
}

function select(it, how = {}) {
  // a name in a list is an end of a distance as well as one in the picture
  if (s.tool.value === 'measure' && (it?.type === 'point' || it?.type === 'station')) {
    measureTo({ name: it.name });
    return;
  }
  batch(() => {
    if (it?.type === 'row') {
      const row = it.row ?? s.observations.value.id.indexOf(it.id);
      s.selection.value = { type: 'row', id: it.id, row };
      s.chosenRows.value = new Set([it.id]);
      if (!rows.value.includes(row)) s.filter.value = { text: '', station: '', kind: '', state: '', low: null, high: null };
    } else s.selection.value = it;
    if (how.tab) s.tab.value = how.tab;
    else if (it && !how.stay) s.tab.value = it.type === 'row' ? 'observations' : 'selection';
    if (it && !how.stay) s.rightOpen.value = true;
  });
}

async function measureTo(end) {
  const first = s.measure.value[0];
  if (first && first.name !== undefined && first.name === end.name) {
    say(`${end.name} is the first end: choose another point.`);
    return;
  }
  const ends = [...s.measure.value, end].slice(-2);
  s.measure.value = ends;
  s.measured.value = null;
  if (ends.length < 2) return;
  const name = (e) => e.name ?? `point of ${e.point.cloud}`;
  const xyz = (e) => (e.name ? placeOf(e.name) : e.point.xyz);
  const difference = xyz(ends[1]).map((x, k) => x - xyz(ends[0])[k]);
  const distance = length(difference);
  const base = { from: name(ends[0]), to: name(ends[1]), distance, sigma: null };
  s.measured.value = base;
  s.tab.value = 'selection';
  s.tool.value = 'select';
  const key = (e) => e.name ?? `${e.point.cloud}:${e.point.xyz.join(',')}`;
  try {
    const answer = await api.get('api/relative', { a: key(ends[0]), b: key(ends[1]) });
    s.measured.value = { ...base, distance: answer.distance, sigma: answer.sigma, covariance: answer.covariance, words: typeof answer.words === 'object' ? [answer.words.distance, answer.words.sigma && `σ ${answer.words.sigma}`].filter(Boolean).join(', ') : answer.words, note: answer.words?.note };
  } catch (error) {
    const known = error.status === 404 ? await relativeOf(ends, difference, distance) : null;
    const here = s.scene.value.joint ? 'Here sigmas are known of distances between points and stations; for those of single points of a cloud open the results with tribrach view.' : 'Its sigma needs the joint covariance: tribrach view.';
    s.measured.value = known ? { ...base, ...known } : { ...base, note: error.status === 404 ? here : error.message };
  }
}

/** The joint covariance that a static folder carries, fetched once. @type {Promise<Float64Array> | null} */
let jointOf = null;

/** Sigma of a distance between named places from the joint covariance of a static folder; null without. */
async function relativeOf(ends, difference, distance) {
  const joint = s.scene.value.joint;
  const at = ends.map((e) => (e.name === undefined ? -1 : joint?.names.indexOf(e.name) ?? -1));
  if (!joint || at.some((k) => k < 0)) return null;
  jointOf ??= api.numbers(joint.file);
  try {
    const covariance = ofDifference(await jointOf, at[0], at[1]);
    const u = difference.map((x) => x / distance);
    const variance = u.reduce((sum, x, i) => sum + x * u.reduce((row, y, k) => row + covariance[i][k] * y, 0), 0);
    return { sigma: Math.sqrt(Math.max(0, variance)), covariance, note: s.scene.value.sigmas_of };
  } catch (error) {
    jointOf = null;
    return { note: error.message };
  }
}

function say(words) {
  s.say(words);
}

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    say('The link is copied.');
  } catch {
    location.hash = new URL(text).hash;
    say('The link stands in the address bar.');
  }
}

function address() {
  const url = new URL(location.href);
  url.hash = s.viewNow();
  return url.href;
}

const does = {
  undo: () => s.act('api/undo'),
  redo: () => s.act('api/redo'),
  save: async () => (await s.act('api/save')) && say('The decisions are kept in edits.toml.'),
  run: async () => {
    s.progress.value = { what: 'Running the project', done: 0, total: 0 };
    if ((await s.act('api/run')) === null) s.progress.value = null;
  },
  cancel: () => s.act('api/cancel'),
  closeDefect: () => (s.defect.value = null),
  link: () => copy(address()),
  rowLink: () => {
    const url = new URL(address());
    const hash = new URLSearchParams(url.hash.slice(1));
    hash.set('tab', 'observations');
    url.hash = hash.toString();
    copy(url.href);
  },
  look: (name) => viewer?.look(name),
  home: () => viewer?.home(),
  fit: () => viewer?.fit(),
  project: () => viewer?.eye.project(!viewer.eye.ortho),
  open: (hash) => s.takeView(hash, { camera: (state) => viewer?.eye.restore(state) }),
  get canSave() {
    return s.keeping.value;
  },
  keep: async (name) => {
    try {
      await api.post('api/views', { name, hash: s.viewNow() });
      s.savedViews.value = { ...s.savedViews.value, [name]: s.viewNow() };
    } catch (error) {
      s.say(error.status === 404 ? 'Views are kept by tribrach view or workbench; copy the link instead.' : error.message, 'error');
    }
  },
  slice: (on) => {
    if (!on) {
      s.slice.value = null;
      return;
    }
    const box = viewer.slicingBox();
    s.slice.value = { on: true, turn: 0, ...box };
  },
  get upright() {
    const f = s.scene.value.frame;
    return !f || f.every((row, i) => row.every((x, k) => x === (i === k ? 1 : 0)));
  },
  use: (ids) => (s.dialog.value = { type: 'use', ids }),
  row: (i, at, event) => {
    const o = s.observations.value;
    const id = o.id[i];
    if (event.ctrlKey || event.metaKey) {
      const next = new Set(s.chosenRows.value);
      next.has(id) ? next.delete(id) : next.add(id);
      s.chosenRows.value = next;
      return;
    }
    if (event.shiftKey && s.selection.value?.type === 'row') {
      const list = rows.value;
      const first = list.findIndex((k) => o.id[k] === s.selection.value.id);
      const next = new Set();
      for (let k = Math.min(first, at); k <= Math.max(first, at); k++) if (k >= 0) next.add(o.id[list[k]]);
      s.chosenRows.value = next;
      return;
    }
    batch(() => {
      s.selection.value = { type: 'row', id, row: i };
      s.chosenRows.value = new Set([id]);
    });
  },
  hover: (i) => askWhatIf(i),
  visitRow: (i) => {
    const o = s.observations.value;
    const [a, b] = [placeOf(o.from[i]), placeOf(o.to[i])].map((xyz) => xyz && viewer.toDrawing(xyz));
    if (a && b) viewer.visit(a.map((x, k) => (x + b[k]) / 2), length(a.map((x, k) => x - b[k])) * 1.4 + 4);
    else if (a ?? b) viewer.visit(a ?? b);
  },
  select,
  visit: (name) => {
    const xyz = placeOf(name);
    if (xyz) viewer.visit(viewer.toDrawing(xyz));
  },
  measureFrom: (end) => {
    s.measure.value = [end];
    s.measured.value = null;
    s.tool.value = 'measure';
  },
  endMeasure: () => {
    s.tool.value = 'select';
    does.noMeasure();
  },
  noMeasure: () => {
    s.measure.value = [];
    s.measured.value = null;
  },
};

// -- the page -------------------------------------------------------------------------------------------------------------

function Right() {
  const edits = s.edits.value.length;
  const warnings = s.warnings.value.length;
  const badge = { changes: edits, notes: warnings };
  const tab = TABS.some(([key]) => key === s.tab.value) ? s.tab.value : 'observations';
  const panel = {
    observations: () => html`<${Observations} does=${does} />`,
    points: () => html`<${Points} does=${does} />`,
    targets: () => html`<${Targets} />`,
    changes: () => html`<${Changes} does=${does} />`,
    notes: () => html`<${Notes} />`,
    selection: () => html`<${Selection} does=${does} />`,
  }[tab];
  const keys = (event) => {
    const at = TABS.findIndex(([key]) => key === tab);
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step) return;
    s.tab.value = TABS[(at + step + TABS.length) % TABS.length][0];
    event.preventDefault();
    requestAnimationFrame(() => document.getElementById(`tab-${s.tab.value}`)?.focus());
  };
  return html`<aside class=${`right ${s.rightOpen.value ? '' : 'shut'}`} aria-label="Tables">
    <div class="tabs" role="tablist" onKeyDown=${keys}>${TABS.map(([key, title]) => html`<button type="button" role="tab" key=${key} id=${`tab-${key}`} aria-selected=${tab === key} aria-controls="panel"
      tabindex=${tab === key ? 0 : -1} onClick=${() => (s.tab.value = key)}>${title}${badge[key] ? html`<span class="badge">${badge[key]}</span>` : ''}</button>`)}</div>
    <div id="panel" role="tabpanel" aria-labelledby=${`tab-${tab}`} class="panel-host">${panel()}</div>
  </aside>`;
}

function Stage() {
  const host = useRef(null);
  useEffect(() => start(host.current), []);
  const tools = [['select', 'arrow', 'Select'], ['pick', 'pick', 'Pick points of the cloud only'], ['measure', 'ruler', 'Measure a distance (M)']];
  return html`<section class="stage" aria-label="Picture">
    <div class="picture-host" ref=${host}></div>
    <div class="stage-tools card" role="toolbar" aria-label="Tools">
      ${tools.map(([key, icon, title]) => html`<button type="button" key=${key} class=${`tool ${s.tool.value === key ? 'active' : ''}`} aria-pressed=${s.tool.value === key} title=${title} onClick=${() => {
        s.tool.value = key;
        if (key === 'measure') does.noMeasure();
      }}><${Icon} name=${icon} /><span class="sr">${title}</span></button>`)}
      <span class="gap"></span>
      <button type="button" class="tool" title="First view (R)" onClick=${does.home}><${Icon} name="home" /><span class="sr">First view</span></button>
      <button type="button" class="tool" title="Everything in the picture (F)" onClick=${does.fit}><${Icon} name="fit" /><span class="sr">Fit all</span></button>
      <button type="button" class="tool" title="Keys and pointer (?)" onClick=${() => (s.dialog.value = { type: 'keys' })}>?</button>
    </div>
    <${Hud} />
    <${Legend} colours=${viewer?.clouds.stationColours ?? new Map()} ready=${s.shown.value.total} />
    <div class="tooltip card" id="tooltip" hidden></div>
    <${Banners} does=${does} />
  </section>`;
}

function App() {
  document.documentElement.dataset.theme = s.theme.value;
  return html`<${TopBar} does=${does} />
    <main class="body"><${Left} does=${does} colours=${viewer?.clouds.stationColours} ready=${s.shown.value.total} />
      <${Stage} /><${Splitter} /><${Right} /></main><${Dialogs} />`;
}

/** Drag, or arrow keys, to share the room between picture and tables. */
function Splitter() {
  const set = (width) => document.documentElement.style.setProperty('--right', `${Math.min(window.innerWidth * 0.75, Math.max(300, width))}px`);
  const down = (event) => {
    const bar = event.currentTarget;
    bar.setPointerCapture(event.pointerId);
    const move = (e) => set(window.innerWidth - e.clientX);
    const end = () => bar.removeEventListener('pointermove', move);
    bar.addEventListener('pointermove', move);
    bar.addEventListener('pointerup', end, { once: true });
    bar.addEventListener('pointercancel', end, { once: true });
  };
  const key = (event) => {
    const now = document.querySelector('.right')?.getBoundingClientRect().width ?? 600;
    if (event.key === 'ArrowLeft') set(now + 40);
    else if (event.key === 'ArrowRight') set(now - 40);
    else return;
    event.preventDefault();
  };
  return html`<div class="splitter" role="separator" aria-orientation="vertical" aria-label="Width of the tables" tabindex="0" onPointerDown=${down} onKeyDown=${key}></div>`;
}

// -- the picture ----------------------------------------------------------------------------------------------------------

function start(host) {
  try {
    viewer = new Viewer(host, s.scene.value, {
      click: clicked,
      hover: hovered,
      camera: () => {
        s.ortho.value = viewer?.eye.ortho ?? false;
        rememberCamera();
      },
      drawn: () => count(),
      loaded: () => count(),
      failed: (words) => s.say(words, 'error'),
      gone: () => (s.alive.value = false),
      sliced: (slice) => (s.slice.value = slice),
    });
  } catch (error) {
    s.say(`The picture cannot be drawn: ${error?.message ?? error}. The tables work without it.`, 'error');
    return;
  }
  tip = document.getElementById('tooltip');
  s.extent.value = viewer.eye.ball.radius;
  const budget = Number(new URLSearchParams(location.search).get('budget'));
  if (Number.isFinite(budget) && budget >= 1000) s.budget.value = Math.min(2e7, budget);
  s.takeView(location.hash, { camera: (state) => viewer.eye.restore(state) });
  bestColour();
  follow();
  s.shown.value = { points: 0, total: viewer.clouds.total, loading: 1 };
  window.tribrach = exposed();
}

/** What clouds are coloured by as long as nobody has said: the first of what they have, once they are there. */
function bestColour() {
  const has = s.attributes.value;
  if (s.colourSaid.value && (s.colour.value === 'station' || has.has(s.colour.value) || !has.size)) return;
  // who gives a cloud of distances wants to see them
  const distances = (s.scene.value.clouds ?? []).some((cloud) => cloud.further && cloud.attributes.distance);
  s.colour.value = [...(distances ? ['distance'] : []), 'sigma_z', 'sigma', 'intensity', 'rgb'].find((name) => has.has(name)) ?? 'station';
}

function follow() {
  const clouds = viewer.clouds;
  effect(() => clouds.colour(s.colour.value, s.range.value));
  effect(() => {
    clouds.shared.uSize.value = s.pointSize.value * (window.devicePixelRatio > 1 ? 1.5 : 1);
    clouds.shared.uFill.value = s.fill.value;
    clouds.shared.uRound.value = s.fill.value || s.pointSize.value >= 4;
    viewer.composite.uniforms.uStrength.value = s.shading.value;
    viewer.draw();
  });
  effect(() => {
    clouds.budget = s.budget.value;
    clouds.soon();
  });
  effect(() => {
    for (const cloud of clouds.clouds) cloud.visible = s.on(`scan:${cloud.name}`);
    clouds.soon();
    viewer.draw();
  });
  effect(() => {
    const poses = new Map(s.stations.value.map((p) => [p.name, { before: p.posed, now: p.pose }]));
    if (s.adjusted.value || s.stations.value.some((p) => p.posed !== p.pose)) clouds.carry(poses);
  });
  effect(() => {
    const cut = inSlice(s.slice.value);
    const items = [...s.points.value, ...s.stations.value.filter((p) => p.kind === 'scanner')].filter((p) => p.xyz && cut(p.xyz));
    viewer.network.setEllipsoids(items, s.ellipsoidTimes.value || s.autoEllipsoid.value);
    viewer.draw();
  });
  effect(() => {
    const cut = inSlice(s.slice.value);
    viewer.network.setRays(s.rays.value.filter((ray) => cut(ray.from) && cut(ray.to)), s.theme.value === 'dark');
    viewer.network.show(s.on);
    viewer.draw();
  });
  effect(() => {
    const places = new Map(s.stations.value.filter((p) => p.xyz).map((p) => [p.name, p.xyz]));
    for (const p of s.points.value) if (!places.has(p.name)) places.set(p.name, p.xyz);
    viewer.network.setEdges(
      (s.scene.value.edges ?? []).filter((e) => places.has(e.first) && places.has(e.second))
        .map((edge) => ({ edge, from: places.get(edge.first), to: places.get(edge.second), outlying: Boolean(edge.outlying) })),
    );
    const p = s.scene.value.planes;
    viewer.network.setPlanes((p?.name ?? []).map((name, i) => ({ name, normal: p.normal[i], centre: p.centre[i], extent: p.extent[i], axes: p.axes?.[i], half: p.half?.[i] })).filter((plane) => plane.centre));
    viewer.network.show(s.on);
    viewer.draw();
  });
  effect(() => {
    viewer.network.setMoves(s.drawnMoves.value.map((p) => ({ from: p.xyz.map((x, k) => x - p.moved[k]), moved: p.moved })), s.moveTimes.value || s.autoMove.value, s.MOVED);
    viewer.network.show(s.on);
    viewer.draw();
  });
  effect(() => {
    viewer.network.setEpochs(s.displaced.value, s.epochTimes.value);
    viewer.network.show(s.on);
    viewer.draw();
  });
  effect(() => {
    viewer.network.show(s.on);
    viewer.names = s.on('names');
    viewer.marks = marks();
    viewer.draw();
  });
  effect(() => {
    const it = s.selection.value;
    let ends = null;
    if (it?.type === 'ray' || it?.type === 'edge') ends = [[viewer.toDrawing(it.item.from), viewer.toDrawing(it.item.to)]];
    if (it?.type === 'row') {
      const o = s.observations.value;
      const [a, b] = [placeOf(o.from[it.row]), placeOf(o.to[it.row])];
      if (a && b) ends = [[viewer.toDrawing(a), viewer.toDrawing(b)]];
    }
    viewer.network.mark(ends);
    const notes = [];
    if (it?.type === 'cloud') notes.push({ at: it.point.draw, text: '', symbol: 'ring', colour: '#e81f8c', weight: 99, always: true });
    const named = it?.type === 'row' ? [s.observations.value.from[it.row], s.observations.value.to[it.row]] : it?.name ? [it.name] : [];
    for (const name of named) {
      const xyz = name && placeOf(name);
      if (xyz) notes.push({ at: viewer.toDrawing(xyz), text: '', symbol: 'ring', colour: '#e0a100', weight: 99, always: true });
    }
    const places = s.measure.value.map((e) => (e.name ? viewer.toDrawing(placeOf(e.name)) : e.point.draw));
    viewer.measured = places.length === 2 ? [places[0], places[1]] : null;
    for (const at of places) notes.push({ at, text: '', symbol: 'end', colour: '#0b7fab', weight: 100, always: true });
    const m = s.measured.value;
    if (places.length === 2 && m) {
      const words = `${metres(m.distance)} m${m.sigma ? ` ± ${millimetres(m.sigma)} mm` : ''}`;
      notes.push({ at: places[0].map((x, k) => (x + places[1][k]) / 2), text: words, symbol: 'plate', colour: '#0b7fab', weight: 101, strong: true, always: true });
    }
    viewer.notes = notes;
    viewer.draw();
  });
  effect(() => viewer.setSlice(s.slice.value));
  effect(() => viewer.theme(s.theme.value));
  effect(() => {
    viewer.only = s.tool.value;
    viewer.canvas.classList.toggle('aiming', s.tool.value !== 'select');
  });
  // the address follows, a little later
  let timer = 0;
  effect(() => {
    const hash = s.viewNow();
    clearTimeout(timer);
    timer = setTimeout(() => history.replaceState(null, '', `#${hash}`), 400);
  });
}

/** Whether a place of the work frame is left by the slice. */
function inSlice(slice) {
  if (!slice?.on) return () => true;
  const [c, n] = [Math.cos(slice.turn), Math.sin(slice.turn)];
  return (xyz) => {
    const [x, y, z] = viewer.toDrawing(xyz).map((v, k) => v - slice.centre[k]);
    return Math.abs(c * x + n * y) <= slice.half[0] && Math.abs(c * y - n * x) <= slice.half[1] && Math.abs(z) <= slice.half[2];
  };
}

function marks() {
  const out = [];
  const it = s.selection.value;
  const strong = (name) => it?.name === name;
  if (s.on('stations')) {
    const named = new Set(s.points.value.map((p) => p.name));
    for (const p of s.stations.value) {
      if (!p.xyz || (p.kind !== 'scanner' && named.has(p.name))) continue;
      out.push({ at: viewer.toDrawing(p.xyz), text: p.name, symbol: 'square', colour: ROLES.station.colour, weight: 60, strong: strong(p.name), what: { type: 'station', name: p.name } });
    }
  }
  if (s.on('points')) {
    for (const p of s.points.value) {
      if (!p.xyz) continue;
      const how = look(p.role);
      out.push({ at: viewer.toDrawing(p.xyz), text: p.name, symbol: how.symbol, colour: how.colour, weight: (p.role === 'control' ? 80 : p.role === 'check' ? 50 : 40) + (strong(p.name) ? 100 : 0), strong: strong(p.name), small: s.on('ellipsoids'), what: { type: 'point', name: p.name } });
    }
  }
  const r = s.scene.value.rejected;
  if (s.on('rejected') && r) {
    r.xyz.forEach((xyz, at) => {
      if (xyz) out.push({ at: viewer.toDrawing(xyz), text: '', symbol: 'cross', colour: '#8a4b12', weight: 10, what: { type: 'rejected', at } });
    });
  }
  if (s.on('rejected')) {
    const t = s.scene.value.targets;
    for (const i of s.turnedDown.value) {
      if (t.xyz[i]) out.push({ at: viewer.toDrawing(t.xyz[i]), text: t.name[i], symbol: 'cross', colour: '#8a4b12', weight: 10, what: { type: 'turnedDown', at: i, name: t.name[i] } });
    }
  }
  if (s.on('comparisons')) {
    for (const c of s.scene.value.comparisons ?? []) for (const site of c.sites ?? []) {
      if (site.xyz) out.push({ at: viewer.toDrawing(site.xyz), text: `site ${site.name}`, symbol: 'circle', small: true, colour: '#0b7fab', weight: 20, what: { type: 'site', name: site.name } });
    }
  }
  return out;
}

let counting = 0;
function count() {
  // at most four times a second: the numbers are for reading
  if (counting) return;
  counting = setTimeout(() => {
    counting = 0;
    const c = viewer.clouds;
    const next = { points: c.shownPoints, total: c.total, loading: c.loading };
    const now = s.shown.value;
    if (next.points !== now.points || next.total !== now.total || next.loading !== now.loading) s.shown.value = next;
  }, 120);
}

let cameraTimer = 0;
function rememberCamera() {
  clearTimeout(cameraTimer);
  cameraTimer = setTimeout(() => (s.camera.value = viewer.eye.state()), 300);
}

function clicked(hit) {
  if (s.tool.value === 'measure') {
    if (hit?.type === 'point' || hit?.type === 'station') measureTo({ name: hit.name });
    else if (hit?.type === 'cloud') measureTo({ point: hit.point });
    return;
  }
  if (!hit) {
    s.selection.value = null;
    s.chosenRows.value = new Set();
    return;
  }
  if (hit.type === 'cloud') {
    // of a cloud that was given besides, the program knows no more than the file says
    const point = { ...hit.point, asking: !hit.point.further };
    select({ type: 'cloud', point });
    if (point.asking) details(point);
  } else if (hit.type === 'ray') {
    // the table goes to the worst of its rows
    const o = s.observations.value;
    const worst = [...hit.item.rows].sort((a, b) => Math.abs(o.w[b] ?? -1) - Math.abs(o.w[a] ?? -1))[0];
    if (worst !== undefined) select({ type: 'row', id: o.id[worst], row: worst }, { tab: 'observations' });
  } else select(hit.type === 'edge' ? { type: 'edge', item: hit.item } : { type: hit.type, name: hit.name, at: hit.at });
}

function hovered(hit) {
  if (!tip) return;
  if (!hit) {
    tip.hidden = true;
    return;
  }
  let words = hit.name ?? '';
  if (hit.type === 'ray') {
    const o = s.observations.value;
    const worst = [...hit.item.rows].sort((a, b) => Math.abs(o.w[b] ?? -1) - Math.abs(o.w[a] ?? -1))[0];
    words = `${hit.item.names[0]} → ${hit.item.names[1]}: ${hit.item.rows.length} values, largest w ${hit.item.w === null ? '–' : hit.item.w.toFixed(2)} (${kindOf(o, worst)})`;
  } else if (hit.type === 'edge') words = `${hit.item.edge.first} with ${hit.item.edge.second}: ${hit.item.edge.count} ${hit.item.edge.kind.replaceAll('_', ' ')}`;
  else if (hit.type === 'turnedDown') words = `${hit.name || 'target'} of ${s.scene.value.targets.scan[hit.at]}, rejected: ${s.scene.value.targets.remark[hit.at]}`;
  else if (hit.type === 'rejected') words = `rejected: ${s.scene.value.rejected.reason[hit.at]}`;
  else {
    const p = (hit.type === 'station' ? s.stations : s.points).value.find((x) => x.name === hit.name);
    if (p?.covariance) words = `${p.name}: σ ${[0, 1, 2].map((k) => (Math.sqrt(Math.max(0, p.covariance[k][k])) * 1000).toFixed(2)).join(', ')} mm`;
  }
  tip.textContent = words;
  tip.hidden = false;
  tip.style.left = `${Math.min(hit.x + 14, viewer.eye.width - tip.offsetWidth - 8)}px`;
  tip.style.top = `${Math.min(hit.y + 14, viewer.eye.height - tip.offsetHeight - 8)}px`;
}

// -- keys -----------------------------------------------------------------------------------------------------------------

document.addEventListener('keydown', (event) => {
  const at = /** @type {HTMLElement} */ (event.target);
  if (at.closest?.('input, textarea, select, dialog')) return;
  const live = s.session.value;
  if ((event.ctrlKey || event.metaKey) && live) {
    const key = event.key.toLowerCase();
    if (key === 'z' && !event.shiftKey && live.undo) does.undo();
    else if ((key === 'z' && event.shiftKey) || key === 'y') live.redo && does.redo();
    else if (key === 's' && !live.saved) does.save();
    else if (key !== 's') return;
    event.preventDefault();
    return;
  }
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const views = Object.keys(VIEWS);
  if (event.key === 'Escape') {
    s.tool.value = 'select';
    does.noMeasure();
    s.selection.value = null;
    s.chosenRows.value = new Set();
  } else if (event.key === 'r') does.home();
  else if (event.key === 'f') does.fit();
  else if (event.key === 'p') does.project();
  else if (event.key === 'm') {
    does.noMeasure();
    s.tool.value = 'measure';
  } else if (event.key === '?') s.dialog.value = { type: 'keys' };
  else if (/^[1-5]$/.test(event.key)) does.look(views[Number(event.key) - 1]);
});

window.addEventListener('hashchange', () => s.takeView(location.hash, { camera: (state) => viewer?.eye.restore(state) }));

/** What tests read, and who likes the console. Numbers and names only; nothing here changes the project. */
function exposed() {
  return {
    get ready() {
      return Boolean(viewer && s.scene.value);
    },
    get counts() {
      return {
        pending: (s.scene.value.pending ?? []).length, points: viewer.clouds.shownPoints, total: viewer.clouds.total, loading: viewer.clouds.loading, frames: viewer.frames,
        clouds: viewer.clouds.clouds.filter((c) => c.state === 'open').length, failed: viewer.clouds.clouds.filter((c) => c.state === 'failed').length,
        ellipsoids: viewer.network.ellipsoidCount, rays: viewer.network.rayCount, moves: viewer.network.moveCount, displacements: viewer.network.epochCount, rows: rows.value.length,
        marks: viewer.marks.length, labels: viewer.placed?.length ?? 0, first: viewer.clouds.firstAt, held: viewer.clouds.held,
      };
    },
    get summary() {
      return JSON.parse(JSON.stringify(s.summary.value));
    },
    get session() {
      return JSON.parse(JSON.stringify(s.session.value));
    },
    get selection() {
      const it = s.selection.value;
      return it ? JSON.parse(JSON.stringify({ ...it, item: undefined })) : null;
    },
    get measured() {
      return JSON.parse(JSON.stringify(s.measured.value));
    },
    get slice() {
      return JSON.parse(JSON.stringify(s.slice.value));
    },
    get handles() {
      return viewer.handles();
    },
    get measuredOnScreen() {
      return viewer.measured?.map((at) => viewer.onScreen(at)) ?? null;
    },
    get points() {
      return s.points.value.map((p) => ({ name: p.name, role: p.role, xyz: p.xyz, covariance: p.covariance, moved: p.moved }));
    },
    get rowsShown() {
      const o = s.observations.value;
      return [...rows.value].map((i) => ({ id: o.id[i], component: o.component[i], w: o.w[i], residual: o.residual[i], state: o.state[i], words: label(o, i) }));
    },
    get stale() {
      return s.stale.value;
    },
    get trip() {
      return s.lastTrip.value;
    },
    share: () => viewer.drawnShare(),
    pick: (x, y) => viewer.clouds.pick(x, y, viewer.eye.width, viewer.eye.height),
    onScreen: (xyz) => viewer.onScreen(viewer.toDrawing(xyz)),
    colourOf: () => ({ by: s.colour.value, range: s.range.value }),
    camera: () => viewer.eye.state(),
    look: (name) => viewer.look(name),
    view: (from) => viewer.eye.between(viewer.toDrawing(from.eye), viewer.toDrawing(from.at)),
  };
}

// -- start ----------------------------------------------------------------------------------------------------------------

async function begin() {
  api.listening((up) => (s.alive.value = up));
  const dark = window.matchMedia?.('(prefers-color-scheme: dark)').matches;
  if (dark) s.theme.value = 'dark';
  if (window.innerWidth < 800) {
    s.leftOpen.value = false;
  }
  const app = document.getElementById('app');
  try {
    await s.askScene();
    if (s.scene.value?.schema !== 1) throw new Error(`scene.json is of version ${s.scene.value?.schema}; this page reads version 1`);
  } catch (error) {
    app.textContent = `The scene cannot be read: ${error?.message ?? error}`;
    return;
  }
  document.title = `${s.scene.value.title} · Tribrach`;
  await s.refresh().catch(() => null);
  const live = s.session.value;
  if (live?.adjusted) s.took(live.adjusted);
  if (live?.tested) s.tested.value = live.tested;
  // the scene comes with the tests of the state that it shows
  s.stale.value = false;
  app.textContent = '';
  render(html`<${App} />`, app);
  const said = sessionStorage.getItem(SAID);
  if (said) s.say(said, 'error');
  sessionStorage.removeItem(SAID);
  const program = await api.get('api/views').then((views) => {
    s.savedViews.value = views ?? {};
    return true;
  }).catch(() => (s.keeping.value = false));
  const news = {
    adjusted: (body) => {
      s.took(body);
      if (s.session.value && body.revision > s.session.value.revision) s.refresh();
    },
    tested: (body) => {
      if (s.adjusted.value && body.revision < s.adjusted.value.revision) return;
      batch(() => {
        s.tested.value = body;
        s.stale.value = false;
      });
    },
    defect: (body) => (s.defect.value = body.sentences ?? body),
    progress: (body) => (s.progress.value = body),
    failed: (body) => {
      s.progress.value = null;
      if (body.reload) {
        // clouds that are drawn are not those in the folder any more; the sentence is said when they are
        sessionStorage.setItem(SAID, body.sentence);
        location.reload();
        return;
      }
      s.refresh();
      s.say(body.sentence ?? 'It failed.', 'error');
    },
    ran: () => location.reload(),
    clouds: () => replaceClouds(),
  };
  // a static folder tells no news
  if (!program) return;
  const source = api.events(news, (up) => {
    s.alive.value = up;
    // what was told before anybody listened
    if (up) {
      viewer?.clouds.again();
      caughtUp();
    }
    if (up && ((s.scene.value.pending ?? []).length || !s.scene.value.clouds.length)) replaceClouds();
  });
  source.addEventListener('stopped', () => {
    source.close();
    s.ended.value = true;
  });
}

/** What the session says now: news that came while nobody listened are not told again. */
async function caughtUp() {
  const before = s.session.value;
  if (!before) return;
  await s.refresh().catch(() => null);
  const live = s.session.value;
  if (before.running && !live.running) location.reload();
  if (live.adjusted && live.revision > before.revision) s.took(live.adjusted);
  if (live.tested?.revision === live.revision) {
    batch(() => {
      s.tested.value = live.tested;
      s.stale.value = false;
    });
  }
}

/** What a page has to say once it has been loaded again. */
const SAID = 'tribrach said';

/** Clouds that became ready are added; what is drawn stays. */
async function replaceClouds() {
  const fresh = await api.get('scene.json');
  s.scene.value = { ...s.scene.value, clouds: fresh.clouds, pending: fresh.pending };
  viewer?.clouds.add(fresh.clouds);
  bestColour();
  if (!(fresh.pending ?? []).length) s.progress.value = null;
}

begin();
