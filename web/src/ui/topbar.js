import * as s from '../state.js';
import { count, plain } from '../core/format.js';
import { Icon, html } from './html.js';

function Chip({ label, value, kind = '', title = '', act = null }) {
  const inside = html`<span class="chip-label">${label}</span><span class="chip-value">${value}</span>`;
  return act
    ? html`<button type="button" class=${`chip ${kind}`} title=${title} onClick=${act}>${inside}</button>`
    : html`<span class=${`chip ${kind}`} title=${title}>${inside}</span>`;
}

/** The global test in one word, its figures in the tooltip. */
function verdict(summary) {
  const test = summary.global_test;
  if (!test) return { value: 'no redundancy', kind: 'warn', title: 'The global test needs redundancy.' };
  const title = `v'Pv = ${plain(test.statistic, 1)}, limits ${plain(test.lower, 1)} to ${plain(test.upper, 1)}`;
  return test.accepted ? { value: 'accepted', kind: 'good', title } : { value: 'rejected', kind: 'bad', title };
}

export function TopBar({ does }) {
  const scene = s.scene.value;
  const summary = s.summary.value;
  if (!scene || !summary) return html`<header class="top"></header>`;
  const test = verdict(summary);
  const live = s.session.value;
  const edits = s.edits.value.length;
  const warnings = s.warnings.value.length;
  const running = live?.running;
  return html`<header class="top">
    <svg viewBox="0 0 32 32" class="brand" aria-hidden="true">
      <path class="plate" d="M16 3 29 26H3z" /><circle cx="16" cy="18" r="4.4" class="bull" />
    </svg>
    <div class="title"><strong>${scene.title}</strong><span>${scene.datum}</span></div>
    <div class="chips" role="status">
      <${Chip} label="σ₀" value=${plain(summary.posterior, 3)} title="sigma of unit weight, a posteriori; a priori ${plain(summary.prior, 3)}" />
      <${Chip} label="dof" value=${summary.dof} title="degrees of freedom" />
      <${Chip} label="global test" value=${test.value} kind=${test.kind} title=${test.title} />
      <${Chip} label=${edits === 1 ? 'edit' : 'edits'} value=${edits} kind=${edits ? 'warn' : ''} title="decisions kept beside the project" act=${() => (s.tab.value = 'changes')} />
      <${Chip} label=${warnings === 1 ? 'warning' : 'warnings'} value=${warnings} kind=${warnings ? 'warn' : ''} title="what the program warns of" act=${() => (s.tab.value = 'notes')} />
    </div>
    <div class="tools">
      ${live &&
      html`<button type="button" class="tool" title="Undo (Ctrl+Z)" disabled=${!live.undo || s.waiting.value} onClick=${does.undo}><${Icon} name="undo" /><span class="sr">Undo</span></button>
        <button type="button" class="tool" title="Redo (Ctrl+Shift+Z)" disabled=${!live.redo || s.waiting.value} onClick=${does.redo}><${Icon} name="redo" /><span class="sr">Redo</span></button>
        <button type="button" class=${`tool ${live.saved ? '' : 'due'}`} title="Keep the decisions in edits.toml (Ctrl+S)" disabled=${live.saved || s.waiting.value} onClick=${does.save}>
          <${Icon} name="save" /><span>${live.saved ? 'Saved' : 'Save'}</span>
        </button>
        ${running
          ? html`<button type="button" class="tool" title="Stop the run" onClick=${does.cancel}><${Icon} name="stop" /><span>Cancel</span></button>`
          : html`<button type="button" class="tool primary" title="Run the project: new clouds with new sigmas" onClick=${does.run}><${Icon} name="run" /><span>Run</span></button>`}`}
      <button type="button" class="tool" title="Copy a link to this view" onClick=${does.link}><${Icon} name="link" /><span class="sr">Copy link</span></button>
      <button type="button" class="tool" title=${s.theme.value === 'dark' ? 'Light theme' : 'Dark theme'} onClick=${() => (s.theme.value = s.theme.value === 'dark' ? 'light' : 'dark')}>
        <${Icon} name=${s.theme.value === 'dark' ? 'sun' : 'moon'} /><span class="sr">Theme</span>
      </button>
      <button type="button" class=${`tool narrow ${s.leftOpen.value ? 'active' : ''}`} title="Layers and colours" aria-pressed=${s.leftOpen.value} onClick=${() => (s.leftOpen.value = !s.leftOpen.value)}><${Icon} name="layers" /><span class="sr">Layers</span></button>
      <button type="button" class=${`tool narrow ${s.rightOpen.value ? 'active' : ''}`} title="Tables" aria-pressed=${s.rightOpen.value} onClick=${() => (s.rightOpen.value = !s.rightOpen.value)}><${Icon} name="table" /><span class="sr">Tables</span></button>
    </div>
  </header>`;
}

export function Banners({ does }) {
  const out = [];
  if (s.defect.value) {
    out.push(html`<div class="banner bad" role="alert" key="defect">
      <div>${s.defect.value.map((sentence) => html`<p>${sentence}</p>`)}<p>The network stays as it was before.</p></div>
      <button type="button" class="button" onClick=${does.undoDefect}>Undo</button>
    </div>`);
  }
  if (s.progress.value) {
    const p = s.progress.value;
    out.push(html`<div class="banner" role="status" key="progress">
      <div><p>${!s.session.value?.running ? 'Preparing clouds: ' : ''}${p.what ?? 'Running'}${p.total ? `, ${count(p.done ?? 0)} of ${count(p.total)}` : ''}</p>
        <progress max=${p.total || undefined} value=${p.total ? p.done ?? 0 : undefined}></progress></div>
      ${s.session.value?.running && html`<button type="button" class="button" onClick=${does.cancel}>Cancel</button>`}
    </div>`);
  } else if (s.session.value && s.moves.value.some((move) => move.long > s.MOVED)) {
    out.push(html`<div class="banner quiet" key="moved">
      <p>Positions moved, sigmas of the last run. <span class="muted">Run writes the clouds anew.</span></p>
    </div>`);
  }
  if (s.session.value && !s.alive.value) {
    out.push(html`<div class="banner bad" role="alert" key="gone"><p>The program does not answer. Is it still running? The page asks again by itself.</p></div>`);
  }
  for (const notice of s.notices.value) {
    out.push(html`<div class=${`banner ${notice.kind === 'error' ? 'bad' : ''}`} role=${notice.kind === 'error' ? 'alert' : 'status'} key=${notice.id}>
      <p>${notice.words}</p><button type="button" class="button plain" aria-label="Close" onClick=${() => s.unsay(notice.id)}><${Icon} name="close" /></button>
    </div>`);
  }
  return html`<div class="banners">${out}</div>`;
}
