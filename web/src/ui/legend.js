import * as s from '../state.js';
import { count, tick, ticks } from '../core/format.js';
import { SCALES, scaleOf } from '../core/colour.js';
import { ROLES, VERDICTS } from '../scene/network.js';
import { html } from './html.js';
import { shownIn, titleOf } from './left.js';

function Scale() {
  const name = s.colour.value;
  const how = s.attributes.value.get(name);
  if (how?.low === undefined) return null;
  const unit = shownIn(how);
  const [low, high] = s.range.value.map((x) => x * unit.factor);
  const marks = ticks(low, high, 5);
  const stops = SCALES[scaleOf(name)];
  return html`<div class="legend-scale">
    <div class="legend-title">${titleOf(name)}${unit.unit && html` <span class="muted">[${unit.unit}]</span>`}</div>
    <div class="ramp" style=${{ background: `linear-gradient(to right, ${stops.join(', ')})` }}></div>
    <div class="ramp-ticks">${marks.ticks.map((x) => html`<span key=${x} style=${{ left: `${(100 * (x - low)) / (high - low)}%` }}>${tick(x, marks.step)}</span>`)}</div>
  </div>`;
}

function Stations({ colours }) {
  return html`<div class="legend-keys">${[...colours].map(([name, hex]) => html`<span key=${name}><i class="swatch" style=${{ background: hex }}></i>${name}</span>`)}</div>`;
}

const SHAPES = {
  triangle: 'M7 1 13 12H1z',
  diamond: 'M7 1 13 7 7 13 1 7z',
  circle: 'M7 2a5 5 0 1 0 0 10A5 5 0 1 0 7 2',
  square: 'M2.5 2.5h9v9h-9z',
};

export function Legend({ colours }) {
  const scene = s.scene.value;
  if (!scene) return null;
  const roles = ['control', 'check', 'free'].filter((role) => s.points.value.some((p) => p.role === role));
  const rays = s.on('rays') && s.rays.value.length > 0;
  return html`<div class="legend card">
    ${s.colour.value === 'station' ? html`<${Stations} colours=${colours} />` : html`<${Scale} />`}
    <div class="legend-keys">
      ${s.on('points') && roles.map((role) => html`<span key=${role}><svg viewBox="0 0 14 14" class="mark"><path d=${SHAPES[ROLES[role].symbol]} fill=${ROLES[role].colour} /></svg>${ROLES[role].title}</span>`)}
      ${s.on('stations') && html`<span><svg viewBox="0 0 14 14" class="mark"><path d=${SHAPES.square} fill=${ROLES.station.colour} /></svg>station</span>`}
      ${rays && html`<span title="largest |w| of the observations between two places"><i class="line quiet"></i>|w| below 2</span><span><i class="line warm"></i>2 to 3</span><span><i class="line bad"></i>suspicious</span>`}
    </div>
    <div class="legend-notes">
      ${s.on('ellipsoids') && html`<span>Ellipsoids of ${Math.round((scene.confidence ?? 0.95) * 1000) / 10} %, drawn <b>${count(s.ellipsoidTimes.value || s.autoEllipsoid.value)} times</b></span>`}
      ${s.on('epochs') && s.displaced.value.length > 0 && html`<span class="legend-keys">${Object.entries(VERDICTS).filter(([verdict]) => s.displaced.value.some((p) => p.verdict === verdict)).map(([verdict, how]) => html`<span key=${verdict}><i class="line" style=${{ borderColor: how.colour }}></i>${verdict}</span>`)}</span>
        <span>displacements, drawn <b>${count(s.epochTimes.value)} times</b></span>`}
      ${s.on('moves') && s.drawnMoves.value.some((m) => m.long > s.MOVED) && html`<span class="moves-note"><i class="line move"></i><span>moves${s.comparing.value ? ` from ${s.stateName(s.comparing.value.a)} to ${s.stateName(s.comparing.value.b)}` : ''}, drawn <b>${count(s.moveTimes.value || s.autoMove.value)} times</b></span></span>`}
    </div>
  </div>`;
}

export function Hud() {
  const { points, total, loading } = s.shown.value;
  if (!s.scene.value?.clouds?.length) return null;
  return html`<div class="hud" role="status"><b>${count(points)}</b> of ${count(total)} points shown${s.slice.value?.on ? ', less what the slice cuts off' : ''}${loading ? html`<span class="spin" aria-label="loading"></span>` : ''}</div>`;
}
