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
  const busy = s.waiting.value || s.ended.value;
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
      html`<button type="button" class="tool" title="Undo (Ctrl+Z)" disabled=${!live.undo || busy} onClick=${does.undo}><${Icon} name="undo" /><span class="sr">Undo</span></button>
        <button type="button" class="tool" title="Redo (Ctrl+Shift+Z)" disabled=${!live.redo || busy} onClick=${does.redo}><${Icon} name="redo" /><span class="sr">Redo</span></button>
        <button type="button" class=${`tool ${live.saved ? '' : 'due'}`} title="Keep the decisions in edits.toml (Ctrl+S)" disabled=${live.saved || busy} onClick=${does.save}>
          <${Icon} name="save" /><span>${live.saved ? 'Saved' : 'Save'}</span>
        </button>
        ${running
          ? html`<button type="button" class="tool" title="Stop the run" disabled=${live.stopping} onClick=${does.cancel}><${Icon} name="stop" /><span>${live.stopping ? 'Stopping' : 'Cancel'}</span></button>`
          : html`<button type="button" class="tool primary" title="Run the project: new clouds with new sigmas" disabled=${busy} onClick=${does.run}><${Icon} name="run" /><span>Run</span></button>`}`}
      <button type="button" class="tool" title="Copy a link to this view" onClick=${does.link}><${Icon} name="link" /><span class="sr">Copy link</span></button>
      <button type="button" class="tool" title=${s.theme.value === 'dark' ? 'Light theme' : 'Dark theme'} onClick=${() => (s.theme.value = s.theme.value === 'dark' ? 'light' : 'dark')}>
        <${Icon} name=${s.theme.value === 'dark' ? 'sun' : 'moon'} /><span class="sr">Theme</span>
      </button>
      <button type="button" class=${`tool narrow ${s.leftOpen.value ? 'active' : ''}`} title="Layers and colours" aria-pressed=${s.leftOpen.value} onClick=${() => (s.leftOpen.value = !s.leftOpen.value)}><${Icon} name="layers" /><span class="sr">Layers</span></button>
      <button type="button" class=${`tool narrow ${s.rightOpen.value ? 'active' : ''}`} title="Tables" aria-pressed=${s.rightOpen.value} onClick=${() => (s.rightOpen.value = !s.rightOpen.value)}><${Icon} name="table" /><span class="sr">Tables</span></button>
    </div>
  </header>`;
}

/** What it means that nobody answers any more, and what to do. */
function Gone() {
  const live = s.session.value;
  if (!s.keeping.value) return html`<div class="banner bad" role="alert"><p><b>The web server does not answer.</b> What was loaded can still be looked at.</p></div>`;
  const command = live ? 'tribrach workbench PROJECT.toml' : 'tribrach view FOLDER';
  const lost = live && !live.saved ? html`<p>Decisions that were not saved are lost with it.</p>` : '';
  return html`<div class="banner bad gone" role="alert"><div>
    ${s.ended.value
      ? html`<p><b>The program has ended.</b> What was loaded can still be looked at. To go on, start it again (<code>${command}</code>) and open the address that it prints.</p>${lost}`
      : html`<p><b>The program does not answer.</b> The page asks again by itself. If it was ended, start it again (<code>${command}</code>) and open the address that it prints.</p>`}
  </div></div>`;
}

export function Banners({ does }) {
  const out = [];
  const lacks = s.scene.value.lacking;
  if (s.defect.value) {
    out.push(html`<div class="banner bad" role="alert" key="defect">
      <div>${s.defect.value.map((sentence) => html`<p>${sentence}</p>`)}<p>The network stays as it was before.</p></div>
      <button type="button" class="button" onClick=${does.closeDefect}>Close</button>
    </div>`);
  }
  if (s.progress.value) {
    const p = s.progress.value;
    const stopping = s.session.value?.stopping;
    out.push(html`<div class="banner" role="status" key="progress">
      <div><p>${stopping ? 'Stopping, at the next place where it can: ' : !s.session.value?.running ? 'Preparing clouds: ' : ''}${p.what ?? 'Running'}${p.total ? `, ${count(p.done ?? 0)} of ${count(p.total)}` : ''}</p>
        <progress max=${p.total || undefined} value=${p.total ? p.done ?? 0 : undefined}></progress></div>
      ${s.session.value?.running && html`<button type="button" class="button" disabled=${stopping} onClick=${does.cancel}>${stopping ? 'Stopping …' : 'Cancel'}</button>`}
    </div>`);
  } else if (lacks && !s.understood.value) {
    out.push(html`<div class="banner quiet" role="status" key="lacking"><p>${lacks}</p>
      <button type="button" class="button plain" aria-label="Close" onClick=${() => (s.understood.value = true)}><${Icon} name="close" /></button></div>`);
  } else if (s.session.value?.ran && s.moves.value.some((move) => move.long > s.MOVED)) {
    out.push(html`<div class="banner quiet" key="moved">
      <p>Positions moved, sigmas of the last run. <span class="muted">Run writes the clouds anew.</span></p>
    </div>`);
  }
  if (s.tool.value === 'measure') {
    out.push(html`<div class="banner hint" role="status" key="measure">
      <p><b>Distance:</b> ${s.measure.value.length === 0 ? 'choose the first end' : `from ${s.measure.value[0].name ?? 'a point of the cloud'}; choose the other end`}
        <span class="muted"> in the picture or in the list of points</span></p>
      <button type="button" class="button plain" onClick=${does.endMeasure}>Cancel</button>
    </div>`);
  }
  if (s.ended.value || !s.alive.value) out.unshift(html`<${Gone} key="gone" />`);
  for (const notice of s.notices.value) {
    out.push(html`<div class=${`banner ${notice.kind === 'error' ? 'bad' : ''}`} role=${notice.kind === 'error' ? 'alert' : 'status'} key=${notice.id}>
      <p>${notice.words}</p><button type="button" class="button plain" aria-label="Close" onClick=${() => s.unsay(notice.id)}><${Icon} name="close" /></button>
    </div>`);
  }
  return html`<div class="banners">${out}</div>`;
}
