import { useState } from 'preact/hooks';
import * as s from '../state.js';
import { count, small, spaced } from '../core/format.js';
import { VIEWS } from '../scene/camera.js';
import { html } from './html.js';

function Section({ title, children, open = true }) {
  return html`<details class="section" open=${open}><summary>${title}</summary><div class="section-body">${children}</div></details>`;
}

function Check({ label, checked, change, hint = null, disabled = false, swatch = null }) {
  return html`<label class=${`check ${disabled ? 'off' : ''}`}>
    <input type="checkbox" checked=${checked} disabled=${disabled} onChange=${(e) => change(e.currentTarget.checked)} />
    ${swatch && html`<i class="swatch" style=${{ background: swatch }}></i>`}
    <span class="grow">${label}</span>${hint !== null && html`<span class="hint">${hint}</span>`}
  </label>`;
}

function Slider({ label, value, min, max, step, show, change }) {
  return html`<label class="slider"><span class="slider-head"><span>${label}</span><output>${show(value)}</output></span>
    <input type="range" min=${min} max=${max} step=${step} value=${value} onInput=${(e) => change(Number(e.currentTarget.value))} /></label>`;
}

function Number_({ label, value, change, unit = '', step = 'any', min = undefined }) {
  return html`<label class="field"><span>${label}</span>
    <input type="number" step=${step} min=${min} value=${value} onChange=${(e) => {
      const x = Number(e.currentTarget.value);
      if (e.currentTarget.value !== '' && Number.isFinite(x)) change(x);
    }} />${unit && html`<span class="unit">${unit}</span>`}</label>`;
}

function Layers() {
  const scene = s.scene.value;
  const counts = {
    points: scene.points.name.length,
    stations: scene.stations.name.length,
    ellipsoids: s.points.value.filter((p) => p.covariance).length,
    rays: scene.rays?.from?.length ?? 0,
    edges: scene.edges?.length ?? 0,
    planes: scene.planes?.name?.length ?? 0,
    moves: s.drawnMoves.value.filter((move) => move.long > s.MOVED).length,
    epochs: s.displaced.value.length,
    rejected: (scene.rejected?.scan?.length ?? 0) + s.turnedDown.value.length,
    comparisons: (scene.comparisons ?? []).reduce((sum, c) => sum + (c.sites ?? []).filter((site) => site.xyz).length, 0),
  };
  // few results have epochs, and who has none need not wonder
  return s.LAYERS.filter(([key]) => key !== 'epochs' || counts.epochs > 0).map(([key, title]) => html`<${Check} key=${key} label=${title} checked=${s.on(key)} hint=${counts[key] ?? null}
    disabled=${counts[key] === 0} change=${(x) => s.toggle(key, x)} />`);
}

function Scans({ colours }) {
  const scene = s.scene.value;
  const clouds = (scene.clouds ?? []).filter((cloud) => !cloud.further);
  const further = (scene.clouds ?? []).filter((cloud) => cloud.further);
  const item = (cloud) => html`<${Check} key=${cloud.name} label=${cloud.name.replace(/^\+/, '')} checked=${s.on(`scan:${cloud.name}`)}
      swatch=${colours?.get(cloud.station)} hint=${count(cloud.points)} change=${(x) => s.toggle(`scan:${cloud.name}`, x)} />`;
  const names = clouds.map((cloud) => `scan:${cloud.name}`);
  const all = names.every((name) => s.on(name));
  const set = (x) => {
    const next = new Set(s.hidden.value);
    for (const name of names) x ? next.delete(name) : next.add(name);
    s.hidden.value = next;
  };
  return html`${clouds.length > 1 && html`<${Check} label="All scans" checked=${all} hint=${count(clouds.reduce((n, c) => n + c.points, 0))} change=${set} />`}
    <div class="scans">${clouds.map(item)}</div>
    ${further.length > 0 && html`<p class="muted small sub">Given besides</p>${further.map(item)}`}
    ${(scene.pending ?? []).map((name) => html`<p class="muted small" key=${name}>${name}: is being prepared</p>`)}
    ${!clouds.length && !further.length && !(scene.pending ?? []).length && html`<p class="muted small">${scene.lacking || 'This result has no clouds.'}</p>`}`;
}

export const TITLES = {
  station: 'Station', rgb: 'RGB', intensity: 'Intensity', sigma: 'Sigma of position', sigma_x: 'Sigma x', sigma_y: 'Sigma y',
  sigma_z: 'Sigma z', incidence: 'Incidence', distance: 'Distance',
};

/** Unit and factor in which an attribute is shown. */
export function shownIn(how) {
  if (how?.unit === 'm') return small('m', '');
  return { unit: how?.unit ?? '', factor: 1, digits: 2 };
}

export function titleOf(name) {
  const how = s.attributes.value.get(name);
  const own = how?.title;
  if (!own) return TITLES[name] ?? spaced(name);
  return own.charAt(0).toUpperCase() + own.slice(1);
}

function Colour() {
  const attributes = s.attributes.value;
  const order = ['sigma', 'sigma_x', 'sigma_y', 'sigma_z', 'incidence', 'intensity', 'rgb', 'distance', 'significance'].filter((name) => attributes.has(name));
  const current = s.colour.value;
  const how = attributes.get(current);
  const unit = shownIn(how);
  const [low, high] = s.range.value;
  const set = (pair) => (s.ranges.value = { ...s.ranges.value, [current]: pair });
  const digits = (x) => Number((x * unit.factor).toPrecision(4));
  return html`<label class="field wide"><span>By</span>
      <select value=${current} onChange=${(e) => {
        s.colourSaid.value = true;
        s.colour.value = e.currentTarget.value;
      }}>
        <option value="station" selected=${current === 'station'}>Station</option>
        ${order.map((name) => html`<option key=${name} value=${name} selected=${current === name}>${titleOf(name)}</option>`)}
      </select></label>
    ${how?.low !== undefined && html`<div class="pair">
      <${Number_} label=${unit.unit ? `from [${unit.unit}]` : 'from'} value=${digits(low)} change=${(x) => x / unit.factor < high && set([x / unit.factor, high])} />
      <${Number_} label=${unit.unit ? `to [${unit.unit}]` : 'to'} value=${digits(high)} change=${(x) => x / unit.factor > low && set([low, x / unit.factor])} />
      ${s.ranges.value[current] && html`<button type="button" class="button plain" onClick=${() => {
        const { [current]: _, ...rest } = s.ranges.value;
        s.ranges.value = rest;
      }}>from the data</button>`}</div>`}`;
}

function Slice({ does }) {
  const slice = s.slice.value;
  const set = (change) => (s.slice.value = { ...slice, ...change });
  const axis = ['E', 'N', 'U'];
  const origin = s.scene.value.origin;
  const flat = does.upright;
  return html`<${Check} label="Slice box" checked=${Boolean(slice?.on)} change=${(x) => does.slice(x)} />
    ${slice?.on && html`<div class="grid3">
        ${axis.map((name, k) => html`<${Number_} key=${`c${name}`} label=${name} step="0.1" value=${Number((slice.centre[k] + (flat ? origin[k] : 0)).toFixed(3))}
          change=${(x) => set({ centre: slice.centre.map((v, i) => (i === k ? x - (flat ? origin[k] : 0) : v)) })} />`)}
        ${['width', 'depth', 'height'].map((name, k) => html`<${Number_} key=${name} label=${name} step="0.1" min="0.05" value=${Number((2 * slice.half[k]).toFixed(3))}
          change=${(x) => x > 0 && set({ half: slice.half.map((v, i) => (i === k ? x / 2 : v)) })} />`)}
      </div>
      <${Slider} label="Turn" value=${Math.round((slice.turn * 180) / Math.PI)} min="-90" max="90" step="1" show=${(x) => `${x}°`}
        change=${(x) => set({ turn: (x * Math.PI) / 180 })} />
      <p class="muted small">Metres${flat ? '' : ', about the origin of the drawing'}. Drag the orange handles in the picture.</p>`}`;
}

function Views({ does }) {
  const [name, setName] = useState('');
  const views = Object.keys(s.savedViews.value);
  return html`<div class="buttons">
      ${Object.entries(VIEWS).map(([key, view]) => html`<button type="button" key=${key} class="button" title=${view.title} onClick=${() => does.look(key)}>${key === 'plan' ? 'Plan' : key.charAt(0).toUpperCase()}</button>`)}
    </div>
    <div class="buttons">
      <button type="button" class="button" onClick=${does.home} title="Back to the first view (R)">Reset</button>
      <button type="button" class="button" onClick=${does.fit} title="Everything in the picture (F)">Fit all</button>
      <button type="button" class="button" onClick=${does.project} title="Perspective or parallel (P)">${s.ortho.value ? 'Perspective' : 'Parallel'}</button>
    </div>
    ${views.length > 0 && html`<ul class="plain-list">${views.map((view) => html`<li key=${view}><button type="button" class="button plain" onClick=${() => does.open(s.savedViews.value[view])}>${view}</button></li>`)}</ul>`}
    ${does.canSave && html`<form class="inline" onSubmit=${(e) => {
      e.preventDefault();
      if (name.trim()) does.keep(name.trim());
      setName('');
    }}><input type="text" maxlength="80" placeholder="Name of this view" aria-label="Name of this view" value=${name} onInput=${(e) => setName(e.currentTarget.value)} />
      <button type="submit" class="button" disabled=${!name.trim()}>Keep</button></form>`}`;
}

export function Left({ does, colours }) {
  if (!s.scene.value) return null;
  return html`<aside class=${`left ${s.leftOpen.value ? '' : 'shut'}`} aria-label="Layers and colours">
    <${Section} title="Layers"><${Layers} /><//>
    <${Section} title="Scans"><${Scans} colours=${s.colour.value === 'station' ? colours : null} /><//>
    <${Section} title="Colour"><${Colour} /><//>
    <${Section} title="View"><${Views} does=${does} /><//>
    <${Section} title="Slice" open=${Boolean(s.slice.value)}><${Slice} does=${does} /><//>
    <${Section} title="Drawing">
      <${Slider} label="Point size" value=${s.pointSize.value} min="1" max="8" step="0.5" show=${(x) => `${x} px`} change=${(x) => (s.pointSize.value = x)} />
      <${Slider} label="Point budget" value=${Math.log10(s.budget.value)} min="4.7" max="7" step="0.05" show=${(x) => `${(10 ** x / 1e6).toFixed(x < 6 ? 2 : 1)} M`} change=${(x) => (s.budget.value = Math.round(10 ** x))} />
      <${Slider} label="Shading of edges" value=${s.shading.value} min="0" max="1.5" step="0.1" show=${(x) => (x ? x.toFixed(1) : 'off')} change=${(x) => (s.shading.value = x)} />
      <${Check} label="Larger points where they are sparse" checked=${s.fill.value} change=${(x) => (s.fill.value = x)} />
      <div class="pair">
        <${Number_} label="Ellipsoids ×" value=${s.ellipsoidTimes.value || s.autoEllipsoid.value} min="1" change=${(x) => (s.ellipsoidTimes.value = x > 0 ? x : 0)} />
        <${Number_} label="Moves ×" value=${s.moveTimes.value || s.autoMove.value} min="1" change=${(x) => (s.moveTimes.value = x > 0 ? x : 0)} />
      </div>
    <//>
  </aside>`;
}
