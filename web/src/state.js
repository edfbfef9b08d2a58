/** What the page knows. Signals: whoever reads one is drawn again when it changes. */
import { batch, computed, signal } from '@preact/signals';
import { parsed, written } from './core/hash.js';
import { NO_FILTER, distinct } from './core/rows.js';
import { NetworkView } from './scene/network.js';
import { length, minus, times, transposed } from './core/matrix.js';
import { roundDown } from './core/statistics.js';
import * as api from './api.js';

export const scene = signal(null);
/** Null where there is none: then everything is for looking only. */
export const session = signal(null);
export const adjusted = signal(null);
export const tested = signal(null);
export const comparing = signal(null);
export const defect = signal(null);
export const progress = signal(null);
export const waiting = signal(false);
export const alive = signal(true);
/** The program has said that it ends: nothing can be asked of it any more. */
export const ended = signal(false);
export const notices = signal([]);
/** Whether what lacks was read. */
export const understood = signal(false);
export const stale = signal(false);
export const savedViews = signal({});
/** Whether views can be kept by name: not in a static folder. */
export const keeping = signal(true);

// the view, which is in the address too
export const theme = signal('light');
export const colour = signal('sigma_z');
/** Whether somebody chose the colour, or an address says it. */
export const colourSaid = signal(false);
export const ranges = signal({});
export const pointSize = signal(2);
export const fill = signal(true);
export const shading = signal(0.5);
export const budget = signal(2_000_000);
export const ellipsoidTimes = signal(0);
export const moveTimes = signal(0);
export const hidden = signal(new Set(['edges', 'planes', 'rejected', 'comparisons']));
export const slice = signal(null);
export const camera = signal(null);
export const ortho = signal(false);
export const tab = signal('observations');
export const filter = signal({ ...NO_FILTER });
export const sort = signal({ by: 'w', down: true });
export const selection = signal(null);
export const tool = signal('select');
export const measure = signal([]);
export const measured = signal(null);
export const shown = signal({ points: 0, total: 0, loading: 0 });
export const chosenRows = signal(new Set());
export const dialog = signal(null);
export const leftOpen = signal(true);
export const rightOpen = signal(true);

export const LAYERS = [
  ['points', 'Points'],
  ['stations', 'Stations'],
  ['names', 'Names'],
  ['ellipsoids', 'Ellipsoids'],
  ['rays', 'Observations'],
  ['edges', 'Registration'],
  ['planes', 'Planes'],
  ['moves', 'Moves'],
  ['epochs', 'Displacements'],
  ['rejected', 'Rejected targets'],
  ['comparisons', 'Comparisons'],
];

/** @param {string} layer */
export const on = (layer) => !hidden.value.has(layer);

/** @param {string} layer @param {boolean} show */
export function toggle(layer, show) {
  const next = new Set(hidden.value);
  if (show) next.delete(layer);
  else next.add(layer);
  hidden.value = next;
}

/** Numbers of the found targets that are rejected by hand. */
export const turnedDown = computed(() => [...(scene.value?.targets?.scan ?? []).keys()].filter((i) => scene.value.targets.accepted?.[i] === false));

/** Decisions that are in force. */
export const edits = computed(() => adjusted.value?.edits ?? session.value?.edits ?? scene.value?.edits ?? []);

// -- the network as it is now ---------------------------------------------------------------------------------------------

export const points = computed(() => {
  const s = scene.value;
  if (!s) return [];
  const now = new Map((adjusted.value?.points ?? []).map((p) => [p.name, p]));
  const roles = rolesNow.value;
  return s.points.name.map((name, i) => {
    const is = now.get(name);
    return {
      name,
      role: roles.get(name) ?? s.points.role[i],
      xyz: is?.xyz ?? s.points.xyz[i],
      covariance: is?.covariance ?? s.points.covariance[i],
      before: is?.before ?? (adjusted.value ? null : s.points.covariance[i]),
      moved: is?.moved ?? null,
      words: Object.entries(s.points.frames ?? {}).map(([frame, rows]) => [frame, rows[i]]),
    };
  });
});

const rolesNow = computed(() => {
  const out = new Map();
  for (const edit of edits.value) if (edit.role) out.set(edit.point, edit.role);
  for (const p of adjusted.value?.points ?? []) if (p.role) out.set(p.name, p.role);
  return out;
});

export const stations = computed(() => {
  const s = scene.value;
  if (!s) return [];
  const now = new Map((adjusted.value?.stations ?? []).map((p) => [p.name, p]));
  return s.stations.name.map((name, i) => {
    const is = now.get(name);
    const pose = is?.world_from_scanner ?? s.stations.pose[i];
    return {
      name,
      role: 'station',
      kind: s.stations.kind[i],
      pose,
      posed: s.stations.pose_of_clouds?.[i] ?? s.stations.pose[i],
      xyz: is?.world_from_scanner ? pose.slice(0, 3).map((row) => row[3]) : s.stations.xyz[i],
      full: is?.covariance ?? s.stations.covariance[i],
      covariance: block(is?.covariance ?? s.stations.covariance[i]),
      before: block(is?.before ?? (adjusted.value ? null : s.stations.covariance[i])),
      moved: is?.moved ?? null,
      turned: is?.turned ?? null,
      clouds: s.stations.clouds?.[i] ?? [],
    };
  });
});

const block = (m) => (m ? m.slice(0, 3).map((row) => row.slice(0, 3)) : null);

/** Columns of the table of observations, with what the last tests say. */
export const observations = computed(() => {
  const s = scene.value;
  if (!s) return { id: [] };
  const base = s.observations;
  const fresh = tested.value?.columns;
  const out = { ...base };
  if (fresh) {
    for (const [name, column] of Object.entries(fresh)) {
      if (Array.isArray(column) && column.length === base.id.length) out[name] = column;
    }
    const words = fresh.words && typeof fresh.words === 'object' ? fresh.words : {};
    out.words = { value: base.words?.value, sigma: base.words?.sigma, ...words };
  }
  // decisions are seen at once, the tests come a little later
  const uses = new Map(edits.value.filter((edit) => edit.observation).map((edit) => [edit.observation, edit]));
  if (stale.value && uses.size) {
    out.state = base.id.map((id, i) => uses.get(id)?.use ?? out.state[i]);
    out.reason = base.id.map((id, i) => uses.get(id)?.reason ?? out.reason?.[i] ?? '');
  }
  return out;
});

export const summary = computed(() => {
  const s = scene.value;
  if (!s) return null;
  return { ...s.summary, ...(adjusted.value?.sigma0 ?? {}), ...(adjusted.value?.sigma0 ? { verdict: adjusted.value.sigma0.verdict ?? null } : {}) };
});

export const warnings = computed(() => tested.value?.warnings ?? scene.value?.warnings ?? []);
export const kinds = computed(() => distinct(observations.value.kind ?? []));
export const stationNames = computed(() => distinct([...(observations.value.from ?? [])]));

/** Metres from which on something is said to have moved: below it nothing is seen in a table. */
export const MOVED = 5e-6;

/** What moves are counted from, as the end of a sentence. */
export const since = computed(() => (session.value?.ran === false ? 'since the project was opened' : 'against the last run'));

/** What moved against the run that the page shows, largest first. */
export const moves = computed(() => {
  if (!adjusted.value) return [];
  return [...points.value, ...stations.value.filter((s) => s.kind === 'scanner')]
    .filter((p) => p.moved && p.moved.every((x) => x !== null))
    .map((p) => ({ ...p, long: length(p.moved) }))
    .sort((a, b) => b.long - a.long);
});

/** What the picture draws: the moves between two states that are compared, else those against the run. */
export const drawnMoves = computed(() => {
  const both = comparing.value;
  if (!both) return moves.value;
  return [...both.points, ...both.stations]
    .filter((p) => p.moved && p.moved.every((x) => x !== null))
    .map((p) => ({ name: p.name, moved: p.moved, xyz: p.xyz ?? p.world_from_scanner.slice(0, 3).map((row) => row[3]), long: length(p.moved) }))
    .sort((p, q) => q.long - p.long);
});

/** What a state of the session is called. @param {string} state */
export function stateName(state) {
  const live = session.value;
  if (state === 'run') return live?.ran === false ? 'project as opened' : 'last run';
  const n = live?.decisions?.[state];
  const edits = n === undefined ? '' : n === 0 ? ', no edits' : n === 1 ? ', 1 edit' : `, ${n} edits`;
  return `state ${state}${edits}${state === String(live?.revision) ? ' (now)' : ''}`;
}

export const autoMove = computed(() => {
  const largest = drawnMoves.value[0]?.long ?? 0;
  const size = extent.value;
  return largest > MOVED ? Math.max(1, roundDown((0.24 * size) / largest)) : 1;
});

export const extent = signal(50);

/** Which comparison of epochs is drawn. */
export const epochAt = signal(0);

/** Displacements of the chosen comparison, largest first. */
export const displaced = computed(() => {
  const list = scene.value?.epochs ?? [];
  const e = list[Math.min(epochAt.value, list.length - 1)];
  if (!e) return [];
  return e.name.map((name, i) => ({
    name, from: e.xyz[i], moved: e.moved[i], covariance: e.covariance[i], verdict: e.verdict[i], test: e.test[i], limit: e.limit[i],
    reference: e.reference[i], detectable: e.detectable[i], long: length(e.moved[i]),
  })).sort((a, b) => b.long - a.long);
});

export const epochTimes = computed(() => {
  const largest = displaced.value[0]?.long ?? 0;
  return largest > 0 ? Math.max(1, roundDown((0.2 * extent.value) / largest)) : 1;
});

export const autoEllipsoid = computed(() => NetworkView.exaggeration(points.value, extent.value));

/** Rays with the test values of now. */
export const rays = computed(() => {
  const s = scene.value;
  if (!s?.rays) return [];
  const o = observations.value;
  const places = new Map([...stations.value, ...points.value].filter((p) => p.xyz).map((p) => [p.name, p.xyz]));
  const out = [];
  s.rays.rows.forEach((rows, k) => {
    const [from, to] = [places.get(s.rays.from[k]), places.get(s.rays.to[k])];
    if (!from || !to) return;
    let w = null;
    let suspicious = false;
    let off = true;
    for (const row of rows) {
      if (o.state[row] === 'off') continue;
      off = false;
      if (o.w[row] !== null && (w === null || Math.abs(o.w[row]) > Math.abs(w))) w = o.w[row];
      suspicious ||= Boolean(o.suspicious[row]);
    }
    out.push({ k, names: [s.rays.from[k], s.rays.to[k]], from, to, w, suspicious, off, rows });
  });
  return out;
});

/** What clouds can be coloured by, with the range of their data. */
export const attributes = computed(() => {
  const out = new Map();
  for (const cloud of scene.value?.clouds ?? []) {
    for (const [name, how] of Object.entries(cloud.attributes ?? {})) {
      if (name === 'rgb') {
        if (how) out.set('rgb', { title: 'RGB' });
        continue;
      }
      if (!how || typeof how !== 'object') continue;
      const known = out.get(name);
      const share = cloud.points ?? 1;
      if (known) {
        // small clouds do not widen the range of the large ones
        known.all.push([share, how.low, how.high]);
      } else out.set(name, { ...how, all: [[share, how.low, how.high]] });
    }
  }
  for (const how of out.values()) {
    if (!how.all) continue;
    const most = Math.max(...how.all.map(([n]) => n));
    const large = how.all.filter(([n]) => n > 0.05 * most);
    how.low = Math.min(...large.map(([, low]) => low));
    how.high = Math.max(...large.map(([, , high]) => high));
  }
  return out;
});

export const range = computed(() => {
  const own = ranges.value[colour.value];
  if (own) return own;
  const how = attributes.value.get(colour.value);
  return how?.low !== undefined ? [how.low, how.high > how.low ? how.high : how.low + 1e-9] : [0, 1];
});

// -- sentences that pass by -----------------------------------------------------------------------------------------------

let number = 0;
/** @param {string} words @param {'info' | 'error'} kind */
export function say(words, kind = 'info') {
  if (notices.value.some((notice) => notice.words === words)) return;
  const id = ++number;
  notices.value = [...notices.value.slice(-3), { id, words, kind }];
  if (kind === 'info') setTimeout(() => unsay(id), 6000);
}
export function unsay(id) {
  notices.value = notices.value.filter((notice) => notice.id !== id);
}

const FLAT = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

/** A place of the drawing in the frame of the scene: the origin of the drawing may differ from one day to the next. @param {number[]} p */
const toScene = (p) => times(transposed(scene.value.frame ?? FLAT), p).map((x, k) => x + scene.value.origin[k]);
/** @param {number[]} p */
const toDrawing = (p) => times(scene.value.frame ?? FLAT, minus(p, scene.value.origin));

// -- the address ----------------------------------------------------------------------------------------------------------

export function viewNow() {
  const s = selection.value;
  return written({
    camera: camera.value ? { ...camera.value, eye: toScene(camera.value.eye) } : undefined,
    colour: colourSaid.value || attributes.value.size ? colour.value : undefined,
    range: ranges.value[colour.value] ?? null,
    hidden: [...hidden.value].sort(),
    size: pointSize.value,
    edl: shading.value,
    ellipsoids: ellipsoidTimes.value || undefined,
    moves: moveTimes.value || undefined,
    slice: slice.value ? { ...slice.value, centre: toScene(slice.value.centre) } : null,
    tab: tab.value,
    sort: sort.value.by,
    down: sort.value.down,
    text: filter.value.text,
    station: filter.value.station,
    kind: filter.value.kind,
    state: filter.value.state,
    theme: theme.value,
    select: s?.type === 'row' ? `row:${s.id}` : s?.name ? `${s.type}:${s.name}` : '',
  });
}

/** @param {string} hash @param {{camera: (state: any) => void}} does */
export function takeView(hash, does) {
  const view = parsed(hash);
  batch(() => {
    if (view.colour) {
      colour.value = view.colour;
      colourSaid.value = true;
    }
    if (view.range && view.colour) ranges.value = { ...ranges.value, [view.colour]: view.range };
    if (view.hidden) hidden.value = new Set(view.hidden);
    else if (hash.length > 1 && view.camera) hidden.value = new Set();
    if (view.size) pointSize.value = Math.min(12, Math.max(1, view.size));
    if (view.edl !== undefined) shading.value = Math.min(2, view.edl);
    ellipsoidTimes.value = view.ellipsoids ?? 0;
    moveTimes.value = view.moves ?? 0;
    slice.value = view.slice ? { ...view.slice, centre: toDrawing(view.slice.centre) } : null;
    if (view.tab) tab.value = view.tab;
    if (view.sort) sort.value = { by: view.sort, down: view.down ?? true };
    filter.value = { ...filter.value, text: view.text ?? '', station: view.station ?? '', kind: view.kind ?? '', state: view.state ?? '' };
    if (view.theme === 'dark' || view.theme === 'light') theme.value = view.theme;
    if (view.select) {
      const at = view.select.indexOf(':');
      const [type, name] = [view.select.slice(0, at), view.select.slice(at + 1)];
      if (type === 'row') selectObservation(name);
      else if (['point', 'station', 'target'].includes(type)) selection.value = { type, name };
    }
  });
  if (view.camera) does.camera({ ...view.camera, eye: toDrawing(view.camera.eye) });
}

/** @param {string} id of an observation */
export function selectObservation(id) {
  const row = observations.value.id.indexOf(id);
  if (row < 0) return;
  selection.value = { type: 'row', id, row };
  chosenRows.value = new Set([id]);
}

// -- changes --------------------------------------------------------------------------------------------------------------

/** Points and decisions about targets that the scene was fetched with. */
let known = { names: null, decided: null };

export async function askScene() {
  const fresh = await api.get('scene.json');
  scene.value = fresh;
}

/** @param {any} body an Adjusted */
export function took(body) {
  if (!body || (adjusted.value && body.revision < adjusted.value.revision)) return;
  batch(() => {
    adjusted.value = body;
    defect.value = null;
    stale.value = !tested.value || tested.value.revision !== body.revision;
  });
  const names = body.points.map((p) => p.name).join('\n');
  const decided = JSON.stringify((body.edits ?? []).filter((edit) => edit.do === 'target'));
  if (scene.value && (names !== known.names || decided !== known.decided)) {
    // another network: points, targets and rows are asked for again
    if (known.names !== null) askScene();
    known = { names, decided };
  }
}

export async function refresh() {
  try {
    session.value = await api.get('api/session');
  } catch (error) {
    if (error instanceof api.Refused && error.status === 404) session.value = null;
    else throw error;
  }
}

/** @param {string} path @param {any} body */
export async function act(path, body = {}) {
  // the banner says it already
  if (ended.value) return null;
  waiting.value = true;
  const began = performance.now();
  try {
    const answer = await api.post(path, { revision: session.value?.revision ?? 0, ...body });
    if (answer?.points) took(answer);
    else if (answer?.adjusted?.points) took(answer.adjusted);
    await refresh();
    lastTrip.value = performance.now() - began;
    return answer;
  } catch (error) {
    if (error instanceof api.Refused) {
      if (error.status === 409) {
        await refresh();
        say('The network was changed elsewhere meanwhile. It is shown as it is now; please say your change again.', 'error');
      } else if (Array.isArray(error.body?.defect)) {
        defect.value = error.body.defect;
        await refresh();
      } else say(error.message, 'error');
    } else if (!(error instanceof api.Gone)) say(String(error?.message ?? error), 'error');
    return null;
  } finally {
    waiting.value = false;
  }
}
export const lastTrip = signal(0);
