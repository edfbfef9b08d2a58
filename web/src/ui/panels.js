import { useState } from 'preact/hooks';
import * as s from '../state.js';
import { count, degrees, metres, millimetres, plain, smallWords, spaced } from '../core/format.js';
import { eigen, length } from '../core/matrix.js';
import { ROLES, VERDICTS } from '../scene/network.js';
import * as api from '../api.js';
import { html } from './html.js';
import { cell, kindOf, label } from './observations.js';

const sigmas = (m) => (m ? [0, 1, 2].map((k) => Math.sqrt(Math.max(0, m[k][k]))) : [null, null, null]);
const axes = () => (s.scene.value.axes ?? ['E', 'N', 'U']).map((x) => String(x).toUpperCase());

function Links({ table }) {
  return html`<p class="links"><a href=${`tables/${table}.csv`} download>CSV</a> <a href=${`tables/${table}.json`} target="_blank" rel="noopener">JSON</a></p>`;
}

function Mark({ role }) {
  return html`<i class="dot" style=${{ background: (ROLES[role] ?? ROLES.free).colour }}></i>`;
}

// -- points and stations --------------------------------------------------------------------------------------------------

export function Points({ does }) {
  const [find, setFind] = useState('');
  const live = s.session.value;
  const wanted = find.toLowerCase();
  const list = s.points.value.filter((p) => p.name.toLowerCase().includes(wanted));
  const stations = s.stations.value.filter((p) => p.name.toLowerCase().includes(wanted) && p.kind === 'scanner');
  const [a, b, c] = axes();
  const row = (p, type) => html`<tr key=${`${type}${p.name}`} class=${s.selection.value?.name === p.name ? 'picked' : ''} onClick=${() => does.select({ type, name: p.name }, { stay: true })} onDblClick=${() => does.visit(p.name)}>
    <td><button type="button" class="name"><${Mark} role=${p.role} />${p.name}</button></td>
    <td>${type === 'station' ? p.kind : live && p.role !== undefined ? html`<button type="button" class="button plain tiny" title="Change the role" onClick=${(e) => {
      e.stopPropagation();
      s.dialog.value = { type: 'role', name: p.name };
    }}>${p.role}</button>` : p.role}</td>
    ${(p.xyz ?? [null, null, null]).map((x, k) => html`<td class="number" key=${k}>${metres(x)}</td>`)}
    ${sigmas(p.covariance).map((x, k) => html`<td class="number" key=${k}>${millimetres(x)}</td>`)}</tr>`;
  return html`<div class="panel scroll">
    <div class="filters"><input type="search" placeholder="Find a point" aria-label="Find a point" value=${find} onInput=${(e) => setFind(e.currentTarget.value)} />
      <span class="found">${count(list.length)} points, ${count(stations.length)} scanner stations</span><${Links} table="points" /></div>
    <table class="plain-table"><thead><tr><th>Name</th><th>Role</th><th class="number">${a} [m]</th><th class="number">${b} [m]</th><th class="number">${c} [m]</th>
      <th class="number">σ${a} [mm]</th><th class="number">σ${b} [mm]</th><th class="number">σ${c} [mm]</th></tr></thead>
      <tbody>${list.slice(0, 1500).map((p) => row(p, 'point'))}${stations.slice(0, 500).map((p) => row(p, 'station'))}</tbody></table>
    ${list.length > 1500 && html`<p class="muted small">1 500 of ${count(list.length)} points are listed; find the others by name, or take the CSV.</p>`}
  </div>`;
}

// -- targets --------------------------------------------------------------------------------------------------------------

function TargetCard({ at }) {
  const t = s.scene.value.targets;
  const live = s.session.value;
  const words = t.words?.[at] ?? {};
  const off = t.accepted && !t.accepted[at];
  const decide = (reject) => () => (s.dialog.value = { type: 'target', at, reject });
  return html`<article class=${`target ${off ? 'off' : ''}`}>
    ${t.picture?.[at] ? html`<img src=${t.picture[at]} alt=${`Scan around ${t.name[at] || 'the target'}, seen from ${t.scan[at]}`} loading="lazy" width="120" height="120" />` : html`<div class="no-picture">no picture</div>`}
    <div class="grow"><header><b>${t.name[at] || `number ${t.number[at]}`}</b> <span class="muted">${spaced(t.kind[at])} in ${t.scan[at]}</span>${off && html` <span class="tag bad">rejected</span>`}</header>
      <dl class="facts"><dt>σ along the scanner's axes</dt><dd>${words.sigma ?? t.sigma[at].map((x) => millimetres(x)).join(', ')}</dd>
        <dt>rms of the fit</dt><dd>${words.rms ?? smallWords(t.rms[at], 'm', '')}</dd><dt>points</dt><dd>${count(t.points[at])}</dd>
        <dt>range</dt><dd>${words.range ?? `${metres(t.range[at])} m`}</dd><dt>incidence</dt><dd>${words.incidence ?? degrees(t.incidence[at])}</dd>
        <dt>coverage</dt><dd>${words.coverage ?? plain(t.coverage[at])}</dd></dl>
      ${t.remark[at] && html`<p class="small warn-text">${t.remark[at]}</p>`}
      ${live && html`<p class="card-tools">${off
        ? html`<button type="button" class="button plain tiny" onClick=${decide(false)}>Take back</button>`
        : html`<button type="button" class="button plain tiny" onClick=${decide(false)}>Rename, confirm</button>
        <button type="button" class="button plain tiny" onClick=${decide(true)}>Reject</button>`}</p>`}
    </div></article>`;
}

function RejectedCard({ at }) {
  const t = s.scene.value.rejected;
  return html`<article class="target off">${t.picture?.[at] ? html`<img src=${t.picture[at]} alt=${`Scan around a rejected candidate, seen from ${t.scan[at]}`} loading="lazy" width="120" height="120" />` : html`<div class="no-picture">no picture</div>`}
    <div class="grow"><header><b>${spaced(t.kind[at])}</b> <span class="muted">candidate in ${t.scan[at]}</span></header><p>${t.reason[at]}</p></div></article>`;
}

export function Targets() {
  const [find, setFind] = useState('');
  const t = s.scene.value.targets;
  const r = s.scene.value.rejected;
  const n = t?.scan?.length ?? 0;
  const wanted = find.toLowerCase();
  const list = [...Array(n).keys()].filter((i) => `${t.name[i]} ${t.scan[i]} ${t.kind[i]} ${t.remark[i]}`.toLowerCase().includes(wanted));
  const by = list.filter((i) => t.accepted && !t.accepted[i]).length;
  const gone = [...Array(r?.scan?.length ?? 0).keys()].filter((i) => `${r.scan[i]} ${r.kind[i]} ${r.reason[i]}`.toLowerCase().includes(wanted));
  return html`<div class="panel scroll">
    <div class="filters"><input type="search" placeholder="Find a target, a scan" aria-label="Find a target" value=${find} onInput=${(e) => setFind(e.currentTarget.value)} />
      <span class="found">${count(list.length)} found targets${by ? `, ${count(by)} of them rejected` : ''}; ${count(gone.length)} rejected candidates</span><${Links} table="targets" /></div>
    ${list.slice(0, 200).map((i) => html`<${TargetCard} key=${i} at=${i} />`)}
    ${list.length > 200 && html`<p class="muted small">200 of ${count(list.length)} are shown; find the others by name.</p>`}
    ${gone.length > 0 && html`<h3>Rejected candidates</h3>${gone.slice(0, 200).map((i) => html`<${RejectedCard} key=${i} at=${i} />`)}`}
    ${!n && !gone.length && html`<p class="empty">No targets were looked for in scans.</p>`}
  </div>`;
}

// -- changes --------------------------------------------------------------------------------------------------------------

/** The name of the target that a decision is about, as the list of targets has it. */
function nameAt(edit) {
  const t = s.scene.value.targets;
  const at = (t?.scan ?? []).findIndex((scan, i) => scan === edit.scan && length(t.center[i].map((x, k) => x - (edit.center?.[k] ?? NaN))) < 0.001);
  return at >= 0 && t.name[at] ? `${t.name[at]} ` : '';
}

const what = (edit) => {
  if (edit.observation) {
    const o = s.observations.value;
    const i = o.id.indexOf(edit.observation);
    return `${i < 0 ? edit.observation : `${label(o, i)}, ${spaced(o.kind[i])}`}: ${edit.use === 'active' ? 'on' : edit.use}`;
  }
  if (edit.point) return `point ${edit.point}: ${edit.role}`;
  if (edit.scan) return `target ${nameAt(edit)}at ${(edit.center ?? []).map((x) => metres(x, 2)).join(', ')} of ${edit.scan}: ${edit.accept === false ? 'rejected' : edit.name ? `is ${edit.name}` : 'confirmed'}`;
  return JSON.stringify(edit);
};

/** What became of points between two epochs. */
function Epochs({ does }) {
  const list = s.scene.value.epochs ?? [];
  if (!list.length) return null;
  const at = Math.min(s.epochAt.value, list.length - 1);
  const e = list[at];
  return html`<h3>Displacements ${list.length === 1 ? `from ${e.first} to ${e.second}` : ''}</h3>
    ${list.length > 1 && html`<div class="filters"><select aria-label="Epochs" value=${at} onChange=${(event) => (s.epochAt.value = Number(event.currentTarget.value))}>${list.map((one, i) => html`<option key=${i} value=${i} selected=${i === at}>${one.first} to ${one.second}</option>`)}</select></div>`}
    ${e.sentences.slice(0, 3).map((words, i) => html`<p class="small" key=${i}>${words}</p>`)}
    <table class="plain-table"><thead><tr><th>Name</th>${axes().map((x) => html`<th class="number" key=${x}>Δ${x} [mm]</th>`)}<th class="number">moved [mm]</th><th class="number">σ [mm]</th><th class="number">test (limit)</th><th class="number" title="found in the hardest direction">detectable [mm]</th><th>verdict</th></tr></thead>
      <tbody>${s.displaced.value.slice(0, 500).map((p) => html`<tr key=${p.name} onClick=${() => does.visit(p.name)}><td><button type="button" class="name"><i class="dot" style=${{ background: VERDICTS[p.verdict]?.colour }}></i>${p.name}${p.reference ? html` <span class="muted">reference</span>` : ''}</button></td>
        ${p.moved.map((x, k) => html`<td class="number" key=${k}>${millimetres(x)}</td>`)}<td class="number"><b>${millimetres(p.long)}</b></td><td class="number">${millimetres(total(p.covariance))}</td>
        <td class="number">${plain(p.test)} (${plain(p.limit)})</td><td class="number">${millimetres(p.detectable)}</td><td>${p.verdict}</td></tr>`)}</tbody></table>`;
}

/** Two states side by side: what the network says of itself, what moves, what the tests say. */
function Compare({ does }) {
  const live = s.session.value;
  const states = ['run', ...(live.states ?? []).filter((x) => x !== 'run').map(String)];
  const [a, setA] = useState('run');
  const [b, setB] = useState('');
  const now = String(live.revision);
  const both = s.comparing.value;
  const go = async () => {
    const pair = { a, b: b || now };
    try {
      s.comparing.value = { ...(await api.get('api/compare', pair)), ...pair };
      s.toggle('moves', true);
    } catch (error) {
      s.say(error.message, 'error');
    }
  };
  const pick = (value, set, title) => html`<select class="state" aria-label=${title} value=${value} onChange=${(e) => set(e.currentTarget.value)}>${states.map((x) => html`<option key=${x} value=${x} selected=${value === x}>${s.stateName(x)}</option>`)}</select>`;
  return html`<h3>Compare two states</h3>
    <div class="filters">${pick(a, setA, 'First state')} with ${pick(b || now, setB, 'Second state')}<button type="button" class="button" onClick=${go}>Compare</button>
      ${both && html`<button type="button" class="button plain" onClick=${() => (s.comparing.value = null)}>End</button>`}</div>
    ${both && html`<${Compared} both=${both} does=${does} />`}`;
}

function Compared({ both, does }) {
  const names = [s.stateName(both.a), s.stateName(both.b)];
  const sides = [both.sigma0?.a ?? {}, both.sigma0?.b ?? {}];
  const limits = (side) => {
    const test = side.global_test;
    return test?.accepted === null || test?.accepted === undefined ? 'no redundancy' : `${test.accepted ? 'accepted' : 'rejected'}: ${plain(test.statistic, 1)} in ${plain(test.lower, 1)} to ${plain(test.upper, 1)}`;
  };
  const moved = [...(both.points ?? []), ...(both.stations ?? [])].filter((p) => p.moved).sort((p, q) => (q.moved_length ?? 0) - (p.moved_length ?? 0));
  const alone = [...(both.points ?? []), ...(both.stations ?? [])].filter((p) => !p.moved).map((p) => p.name);
  return html`<table class="plain-table sides"><thead><tr><th></th>${names.map((name, k) => html`<th key=${k}>${name}</th>`)}</tr></thead><tbody>
      <tr><td>σ₀ a posteriori</td>${sides.map((side, k) => html`<td key=${k}>${plain(side.posterior, 4)}</td>`)}</tr>
      <tr><td>degrees of freedom</td>${sides.map((side, k) => html`<td key=${k}>${side.dof ?? '–'}</td>`)}</tr>
      <tr><td>global test</td>${sides.map((side, k) => html`<td key=${k}>${limits(side)}</td>`)}</tr></tbody></table>
    <p class="small">${both.largest?.moved > s.MOVED ? html`Largest move: <b>${both.largest.name}</b>, ${millimetres(both.largest.moved)} mm. The picture draws the moves from the first state to the second.` : 'No point and no station moves by more than 0.005 mm.'}${alone.length ? ` Only in the second state: ${alone.join(', ')}.` : ''}</p>
    <table class="plain-table"><thead><tr><th>Name</th>${axes().map((x) => html`<th class="number" key=${x}>Δ${x} [mm]</th>`)}<th class="number">moved [mm]</th><th class="number" title="root of the trace of the covariance">σ first [mm]</th><th class="number">σ second [mm]</th></tr></thead>
      <tbody>${moved.slice(0, 300).map((p) => html`<tr key=${p.name} onDblClick=${() => does.visit(p.name)}><td>${p.name}</td>${p.moved.map((x, k) => html`<td class="number" key=${k}>${millimetres(x)}</td>`)}<td class="number"><b>${millimetres(p.moved_length)}</b></td>
        <td class="number">${millimetres(total(p.before))}</td><td class="number">${millimetres(total(p.covariance))}</td></tr>`)}</tbody></table>
    <${Tests} columns=${both.observations} tested=${both.tested} />`;
}

/** Observations whose use or test value differs most between two states. */
function Tests({ columns, tested }) {
  if (!columns?.id?.length || !tested?.a || !tested?.b) return html`<p class="muted small">The tests of ${!tested?.a && !tested?.b ? 'these states' : tested?.a ? 'the second state' : 'the first state'} were not computed, because another change came first; test values are not compared.</p>`;
  const o = s.observations.value;
  const rows = new Map(o.id.map((id, i) => [`${id} ${o.component[i]}`, i]));
  const named = (i) => {
    const row = rows.get(`${columns.id[i]} ${columns.component[i]}`);
    return row === undefined ? `${columns.id[i]} ${columns.component[i]}` : `${label(o, row)}, ${kindOf(o, row)}`;
  };
  const gap = (i) => (columns.state_a[i] !== columns.state_b[i] ? 1e6 : 0) + Math.abs((columns.w_b[i] ?? 0) - (columns.w_a[i] ?? 0));
  const list = [...columns.id.keys()].filter((i) => gap(i) > 0.005).sort((i, j) => gap(j) - gap(i)).slice(0, 20);
  if (!list.length) return html`<p class="muted small">No test value differs by more than 0.005.</p>`;
  return html`<p class="small">Test values that differ most:</p><table class="plain-table"><thead><tr><th>Observation</th><th>use</th><th class="number">w first</th><th class="number">w second</th></tr></thead><tbody>${list.map((i) => html`<tr key=${i}><td title=${columns.id[i]}>${named(i)}</td><td>${columns.state_a[i] === columns.state_b[i] ? columns.state_b[i] : `${columns.state_a[i] ?? 'not there'} → ${columns.state_b[i] ?? 'not there'}`}</td><td class="number">${plain(columns.w_a[i])}</td><td class="number">${plain(columns.w_b[i])}</td></tr>`)}</tbody></table>`;
}

const total = (m) => (Array.isArray(m) ? Math.sqrt(Math.max(0, m[0][0] + m[1][1] + m[2][2])) : typeof m === 'number' ? m : null);

export function Changes({ does }) {
  const live = s.session.value;
  const list = s.edits.value;
  const moves = s.moves.value.filter((move) => move.long > s.MOVED);
  return html`<div class="panel scroll">
    <h3>${list.length === 0 ? 'No edits' : list.length === 1 ? 'One edit' : `${list.length} edits`}</h3>
    ${!list.length && html`<p class="muted">${live ? 'Switch an observation off in the table, change a role or a target: every decision is listed here with its reason.' : 'This result was made without edits. To switch observations off, change roles or reject targets, open the project: '}${live ? '' : html`<code>tribrach workbench PROJECT.toml</code>`}</p>`}
    <ol class="edits">${list.map((edit, i) => html`<li key=${i}><div><b>${what(edit)}</b><br />${edit.reason}<br /><span class="muted small" title=${edit.observation ?? ''}>${[edit.by, edit.at?.replace?.('T', ' ')].filter(Boolean).join(', ')}</span></div>
      ${edit.observation && html`<button type="button" class="button plain tiny" onClick=${() => does.select({ type: 'row', id: edit.observation }, { tab: 'observations' })}>Show</button>`}</li>`)}</ol>
    <${Epochs} does=${does} />
    ${live && html`<h3>What moves ${s.since.value}</h3>
      ${!moves.length ? html`<p class="muted">Nothing has moved.</p>` : html`<p class="small">Largest: <b>${moves[0].name}</b>, ${millimetres(moves[0].long)} mm. <a href="tables/moves.csv" download>CSV</a> <a href="tables/moves.json" target="_blank" rel="noopener">JSON</a></p>
      <table class="plain-table"><thead><tr><th>Name</th>${axes().map((x) => html`<th class="number" key=${x}>Δ${x} [mm]</th>`)}<th class="number">moved [mm]</th><th class="number" title="root of the trace of the covariance">σ before [mm]</th><th class="number">σ now [mm]</th></tr></thead>
        <tbody>${moves.slice(0, 500).map((p) => html`<tr key=${p.name} onClick=${() => does.select({ type: p.role === 'station' ? 'station' : 'point', name: p.name }, { stay: true })} onDblClick=${() => does.visit(p.name)}>
          <td><button type="button" class="name"><${Mark} role=${p.role} />${p.name}</button></td>${p.moved.map((x, k) => html`<td class="number" key=${k}>${millimetres(x)}</td>`)}<td class="number"><b>${millimetres(p.long)}</b></td>
          <td class="number">${millimetres(total(p.before))}</td><td class="number">${millimetres(total(p.covariance))}</td></tr>`)}</tbody></table>`}
      <${Compare} does=${does} />`}
  </div>`;
}

// -- notes ----------------------------------------------------------------------------------------------------------------

export function Notes() {
  const scene = s.scene.value;
  const summary = s.summary.value;
  const test = summary.global_test;
  return html`<div class="panel scroll">
    <h3>The network</h3>
    <dl class="facts wide"><dt>Datum</dt><dd>${scene.datum}</dd><dt>σ₀ a priori, a posteriori</dt><dd>${plain(summary.prior, 3)}, ${plain(summary.posterior, 4)}</dd>
      <dt>Degrees of freedom</dt><dd>${summary.dof}</dd>
      ${test && html`<dt>Global test</dt><dd>${test.accepted ? 'accepted' : 'rejected'}: ${plain(test.statistic, 1)}, limits ${plain(test.lower, 1)} to ${plain(test.upper, 1)}</dd>`}
      <dt>Sigmas</dt><dd>${scene.covariances === 'posterior' ? 'scaled a posteriori' : 'a priori'}${scene.sigmas_of ? `; ${scene.sigmas_of}` : ''}</dd>
      <dt>Coordinates</dt><dd>${scene.crs ? 'in the CRS of the project' : 'local'}; drawn about ${scene.origin.join(', ')}</dd><dt>Program</dt><dd>Tribrach ${scene.tribrach}</dd></dl>
    <h3>${s.warnings.value.length} ${s.warnings.value.length === 1 ? 'warning' : 'warnings'}</h3>
    <ul class="warnings">${s.warnings.value.map((words, i) => html`<li key=${i}>${words}</li>`)}</ul>
    ${(scene.comparisons ?? []).length > 0 && html`<h3>Comparisons</h3>${scene.comparisons.map((c, i) => html`<${Comparison} key=${i} c=${c} />`)}`}
  </div>`;
}

function Comparison({ c }) {
  return html`<p><b>${c.a}</b> with <b>${c.b}</b></p><ul class="warnings plainer">${(c.sentences ?? []).map((words, i) => html`<li key=${i}>${words}</li>`)}</ul>
    <table class="plain-table"><thead><tr><th>Site</th><th class="number">points</th><th class="number">range [m]</th><th class="number">M3C2 mean [mm]</th><th class="number">observed σ [mm]</th><th class="number">predicted σ [mm]</th></tr></thead>
    <tbody>${(c.sites ?? []).map((site) => html`<tr key=${site.name}><td>${site.name}</td><td class="number">${count(site.n)}</td><td class="number">${metres(site.range, 2)}</td>
      <td class="number">${millimetres(site.m3c2?.mean)}</td><td class="number">${millimetres(site.prediction?.observed)}</td><td class="number">${millimetres(site.predicted_sigma)}</td></tr>`)}</tbody></table>`;
}

// -- what is selected -----------------------------------------------------------------------------------------------------

function Matrix({ m, title = '3 × 3 [mm²]' }) {
  if (!m) return null;
  return html`<table class="matrix"><caption>${title}</caption><tbody>${m.map((row, i) => html`<tr key=${i}>${row.map((x, k) => html`<td key=${k}>${plain(x * 1e6, 3)}</td>`)}</tr>`)}</tbody></table>`;
}

function SigmaRows({ covariance, names = axes() }) {
  if (!covariance) return html`<p class="muted">It has no covariance: fixed or not estimated.</p>`;
  const { values } = eigen(covariance);
  return html`<dl class="facts">${sigmas(covariance).map((x, k) => html`<dt key=${k}>σ ${names[k]}</dt><dd>${millimetres(x)} mm</dd>`)}<dt>σ of position</dt><dd>${millimetres(total(covariance))} mm</dd>
    <dt>principal σ</dt><dd>${values.map((v) => millimetres(Math.sqrt(Math.max(0, v)))).join(', ')} mm</dd></dl><${Matrix} m=${covariance} />`;
}

function NamedPoint({ name, type, does }) {
  const p = (type === 'station' ? s.stations.value : s.points.value).find((x) => x.name === name) ?? s.stations.value.find((x) => x.name === name);
  if (!p) return html`<p class="muted">There is no point of this name.</p>`;
  const o = s.observations.value;
  const its = [];
  for (let i = 0; i < o.id.length && its.length < 200; i++) if (o.from[i] === name || o.to[i] === name) its.push(i);
  its.sort((a, b) => Math.abs(o.w[b] ?? 0) - Math.abs(o.w[a] ?? 0));
  const t = s.scene.value.targets;
  const found = [...Array(t?.scan?.length ?? 0).keys()].filter((i) => t.name[i] === name);
  return html`<h2><${Mark} role=${p.role} />${name} <span class="muted">${p.role === 'station' ? p.kind : `${p.role} point`}</span></h2>
    <p class="card-tools"><button type="button" class="button" onClick=${() => does.visit(name)}>Go there</button>
      <button type="button" class="button" onClick=${() => does.measureFrom({ name })}>Measure from here</button>
      <button type="button" class="button" onClick=${() => (s.filter.value = { ...s.filter.value, station: name, text: '', kind: '', state: '' }, s.tab.value = 'observations')}>Its observations</button>
      ${s.session.value && type === 'point' && html`<button type="button" class="button" onClick=${() => (s.dialog.value = { type: 'role', name })}>Role …</button>`}</p>
    <h3>Coordinates</h3>
    ${(p.words ?? []).some(([, words]) => words) ? html`<dl class="facts wide">${p.words.filter(([, words]) => words).map(([frame, words]) => html`<dt key=${frame}>${frame}</dt><dd>${[words].flat().join(', ')}</dd>`)}</dl>` : html`<p>${(p.xyz ?? []).map((x) => metres(x)).join(', ')} m</p>`}
    ${p.moved && length(p.moved) > s.MOVED && html`<p class="small">Now ${p.xyz.map((x) => metres(x)).join(', ')} m: moved ${millimetres(length(p.moved))} mm ${s.since.value}.</p>`}
    <h3>Uncertainty</h3><${SigmaRows} covariance=${p.covariance} />
    ${p.full && html`<p class="small muted">σ of the rotations: ${[3, 4, 5].map((k) => smallWords(Math.sqrt(Math.max(0, p.full[k][k])), 'rad', s.scene.value.angle)).join(', ')}</p>`}
    ${found.length > 0 && html`<h3>Seen in ${found.length} ${found.length === 1 ? 'scan' : 'scans'}</h3>${found.map((i) => html`<${TargetCard} key=${i} at=${i} />`)}`}
    <h3>Observations</h3><${Few} list=${its} does=${does} />`;
}

/** A site of a comparison of stations, in all comparisons that have one of this name. */
function Site({ name }) {
  const found = (s.scene.value.comparisons ?? []).flatMap((c) => (c.sites ?? []).filter((site) => site.name === name).map((site) => [c, site]));
  return html`<h2>Site ${name}</h2>${found.map(([c, site], i) => {
    const p = site.prediction;
    return html`<h3 key=${i}>${c.a} with ${c.b}</h3><dl class="facts wide"><dt>points</dt><dd>${count(site.n)}</dd><dt>range</dt><dd>${metres(site.range, 2)} m</dd>
      <dt>incidence</dt><dd>${degrees(site.incidence)}</dd><dt>mean distance along normals</dt><dd>${millimetres(site.m3c2?.mean)} mm</dd>
      ${p && html`<dt>σ observed, predicted</dt><dd>${millimetres(p.observed)}, ${millimetres(p.sigma)} mm</dd><dt>offset</dt><dd>${millimetres(p.offset)} mm, σ ${millimetres(p.offset_sigma)} mm</dd>`}</dl>
      ${p?.verdict && html`<p>${p.verdict}</p>`}`;
  })}`;
}

/** Everything that is known of one observed value. */
function RowFacts({ o, i }) {
  const words = (name) => cell(o, i, name, s.scene.value.angle);
  const use = { active: 'on', check: 'check', off: 'off' }[o.state[i]] ?? o.state[i];
  return html`<dl class="facts wide"><dt>Source</dt><dd>${o.source[i]}</dd><dt>Use</dt><dd>${use}${o.reason?.[i] ? `: ${o.reason[i]}` : ''}</dd>
    <dt>Value</dt><dd>${words('value')}</dd><dt>σ</dt><dd>${words('sigma')}</dd><dt>Residual v</dt><dd>${words('residual')}</dd>
    <dt>Normalised residual w</dt><dd>${words('w')}</dd><dt>Redundancy number r</dt><dd>${words('redundancy')}</dd>
    <dt>Minimal detectable bias</dt><dd>${words('mdb')}</dd><dt>Its largest effect</dt><dd>${words('external')}</dd></dl>`;
}

/** A few rows, worst first. */
function Few({ list, does }) {
  const o = s.observations.value;
  if (!list.length) return html`<p class="muted">None.</p>`;
  return html`<table class="plain-table"><tbody>${list.slice(0, 12).map((i) => html`<tr key=${i} class=${`${o.suspicious[i] ? 'suspicious' : ''} is-${o.state[i]}`} onClick=${() => does.select({ type: 'row', id: o.id[i], row: i }, { tab: 'observations' })}>
    <td><button type="button" class="name">${label(o, i)}</button></td><td>${kindOf(o, i)}</td><td class="number">${smallWords(o.residual[i], o.unit[i], s.scene.value.angle)}</td><td class="number">w ${plain(o.w[i])}</td></tr>`)}</tbody></table>
    ${list.length > 12 && html`<p class="muted small">and ${list.length - 12} more</p>`}`;
}

function Ray({ item, does }) {
  const rows = [...item.rows].sort((a, b) => Math.abs(s.observations.value.w[b] ?? 0) - Math.abs(s.observations.value.w[a] ?? 0));
  return html`<h2>${item.names[0]} → ${item.names[1]}</h2><p class="muted">${rows.length} observed ${rows.length === 1 ? 'value' : 'values'}, ${metres(length(item.from.map((x, k) => x - item.to[k])), 3)} m apart</p><${Few} list=${rows} does=${does} />`;
}

function Edge({ item }) {
  const e = item.edge;
  return html`<h2>${e.first} with ${e.second}</h2><dl class="facts"><dt>by</dt><dd>${spaced(e.kind)}, ${e.count}</dd><dt>rms</dt><dd>${smallWords(e.rms, 'm', '')}</dd>
    <dt>off by</dt><dd>${smallWords(e.shift, 'm', '')} (σ ${smallWords(e.shift_sigma, 'm', '')})</dd><dt>turned by</dt><dd>${smallWords(e.turn, 'rad', s.scene.value.angle)} (σ ${smallWords(e.turn_sigma, 'rad', s.scene.value.angle)})</dd>
    <dt>statistic</dt><dd>${plain(e.statistic, 2)}, limit ${plain(e.limit, 1)}</dd></dl><p>${e.outlying ? 'This link is beyond its limit.' : 'This link is within its limit.'}</p>`;
}

function Budget({ parts }) {
  const largest = Math.max(...parts.map((p) => p.sigma ?? 0), 1e-12);
  return html`<div class="budget">${parts.map((p) => html`<div key=${p.part} class="budget-row"><span>${spaced(p.part)}</span><span class="bar"><i style=${{ width: `${(100 * (p.sigma ?? 0)) / largest}%` }}></i></span><span class="number">${millimetres(p.sigma)} mm</span></div>`)}</div>`;
}

/** A point of a cloud that no scan of the run delivered: what its file says. */
function FurtherPoint({ point, does }) {
  const { distance, level } = point;
  return html`<h2>Point of ${point.cloud.replace(/^\+/, '')}</h2>
    <p class="card-tools"><button type="button" class="button" onClick=${() => does.measureFrom({ point })}>Measure from here</button></p>
    <h3>Coordinates</h3><dl class="facts wide"><dt>${axes().join(', ')}</dt><dd>${point.xyz.map((x) => metres(x)).join(', ')} m</dd></dl>
    ${distance !== null && html`<h3>Distance of the compared clouds</h3><dl class="facts"><dt>distance</dt><dd>${millimetres(distance)} mm</dd>
      ${level !== null && html`<dt>level of detection</dt><dd>${millimetres(level)} mm (95 %)</dd>`}</dl>
      ${level !== null && html`<p>${Math.abs(distance) > level ? 'It is beyond its level of detection.' : 'It is within its level of detection: no change can be told here.'}</p>`}`}
    <p class="muted small">This cloud was given besides those of the run; the run knows no sigmas of its points.</p>`;
}

function CloudPoint({ point, does }) {
  const more = point.more;
  const frames = Object.entries(more?.frames ?? {});
  if (point.further) return html`<${FurtherPoint} point=${point} does=${does} />`;
  return html`<h2>Point of ${point.cloud}</h2>
    <p class="card-tools"><button type="button" class="button" onClick=${() => does.measureFrom({ point })}>Measure from here</button></p>
    <h3>Coordinates</h3><dl class="facts wide">${frames.length ? frames.map(([frame, words]) => html`<dt key=${frame}>${frame}</dt><dd>${[words].flat().map((x) => (typeof x === 'number' ? metres(x) : x)).join(', ')}</dd>`) : html`<dt>${axes().join(', ')}</dt><dd>${point.xyz.map((x) => metres(x)).join(', ')} m</dd>`}</dl>
    <h3>Seen from ${more?.station ?? point.station}</h3><dl class="facts"><dt>range</dt><dd>${more?.range !== undefined && more?.range !== null ? `${metres(more.range, 3)} m` : point.range !== null ? `${metres(point.range, 3)} m` : '–'}</dd>
      <dt>incidence</dt><dd>${point.incidence !== null ? `${point.incidence.toFixed(1)}°` : degrees(more?.incidence)}</dd><dt>intensity</dt><dd>${count(point.intensity)}</dd></dl>
    <h3>Uncertainty <span class="muted">${s.session.value ? 'of the last run' : ''}</span></h3>
    ${more?.covariance ? html`<${SigmaRows} covariance=${more.covariance} />` : point.sigma ? html`<dl class="facts">${point.sigma.map((x, k) => html`<dt key=${k}>σ ${axes()[k]}</dt><dd>${millimetres(x)} mm</dd>`)}<dt>σ of position</dt><dd>${millimetres(length(point.sigma))} mm</dd></dl>` : html`<p class="muted">This cloud carries no sigmas.</p>`}
    ${more?.budget?.length ? html`<h3>What it is made of</h3><${Budget} parts=${more.budget} />` : ''}
    ${more?.words?.note && html`<p class="small">${more.words.note}</p>`}
    ${point.asking && html`<p class="muted small">The program is asked for the full covariance …</p>`}
    ${point.without && html`<p class="muted small">${point.without}</p>`}`;
}

export function Selection({ does }) {
  const it = s.selection.value;
  const m = s.measured.value;
  const head = m ? html`<div class="card inset"><h2>Distance</h2><p>${m.from} to ${m.to}</p>
    <p class="big">${m.words ?? `${metres(m.distance)} m`}</p>${!m.words && m.sigma !== undefined && m.sigma !== null && html`<p>σ ${millimetres(m.sigma)} mm</p>`}${m.note && html`<p class="muted small">${m.note}</p>`}
    ${m.covariance && html`<${Matrix} m=${m.covariance} title="Covariance of the difference [mm²]" />`}
    <p class="card-tools"><button type="button" class="button plain" onClick=${does.noMeasure}>Clear</button></p></div>` : null;
  let body;
  if (!it) body = html`<p class="empty">Pick a point, a target, a station, a line or a point of the cloud in the picture.</p>`;
  else if (it.type === 'cloud') body = html`<${CloudPoint} point=${it.point} does=${does} />`;
  else if (it.type === 'ray') body = html`<${Ray} item=${it.item} does=${does} />`;
  else if (it.type === 'edge') body = html`<${Edge} item=${it.item} />`;
  else if (it.type === 'rejected') body = html`<h2>Rejected candidate</h2><${RejectedCard} at=${it.at} />`;
  else if (it.type === 'turnedDown') body = html`<h2>Rejected target</h2><${TargetCard} at=${it.at} />`;
  else if (it.type === 'site') body = html`<${Site} name=${it.name} />`;
  else if (it.type === 'row') {
    const o = s.observations.value;
    body = html`<h2>${label(o, it.row)}</h2><p>${kindOf(o, it.row)}</p><${RowFacts} o=${o} i=${it.row} /><h3>All values of this observation</h3><${Few} list=${[...o.id.keys()].filter((i) => o.id[i] === it.id)} does=${does} />`;
  } else body = html`<${NamedPoint} name=${it.name} type=${it.type} does=${does} />`;
  return html`<div class="panel scroll selection">${head}${body}</div>`;
}

