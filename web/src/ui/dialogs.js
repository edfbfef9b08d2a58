import { useEffect, useRef, useState } from 'preact/hooks';
import * as s from '../state.js';
import { spaced } from '../core/format.js';
import { kindOf, label, askWhatIf, whatIf } from './observations.js';
import { html } from './html.js';

/** A dialogue of the browser itself: it keeps the keys inside, and Escape closes it. */
function Modal({ title, children, submit, ready, action }) {
  const host = useRef(null);
  useEffect(() => {
    host.current.showModal();
  }, []);
  const close = () => (s.dialog.value = null);
  return html`<dialog ref=${host} class="dialog" onClose=${close} onCancel=${close}>
    <form method="dialog" onSubmit=${(e) => {
      e.preventDefault();
      if (ready) submit();
    }}>
      <h2>${title}</h2>
      ${children}
      <div class="dialog-foot"><button type="button" class="button" onClick=${close}>Cancel</button>
        <button type="submit" class="button primary" disabled=${!ready}>${action}</button></div>
    </form></dialog>`;
}

function Reason({ reason, set, example = 'prism tilted, see field book page 12' }) {
  return html`<label class="stack"><span>Reason <span class="muted">(is kept with the decision and stands in the report)</span></span>
    <textarea rows="2" maxlength="400" autofocus required value=${reason} onInput=${(e) => set(e.currentTarget.value)} placeholder=${`for example: ${example}`}></textarea></label>`;
}

function Use({ ids }) {
  const o = s.observations.value;
  const rowsOf = ids.map((id) => o.id.indexOf(id)).filter((i) => i >= 0);
  const now = new Set(rowsOf.map((i) => o.state[i]));
  const [use, setUse] = useState(now.has('active') ? 'off' : 'active');
  const [reason, setReason] = useState('');
  useEffect(() => {
    if (rowsOf.length === 1) askWhatIf(rowsOf[0], true);
  }, []);
  const ask = whatIf.value?.id === ids[0] && ids.length === 1 ? whatIf.value : null;
  const submit = () => {
    s.dialog.value = null;
    s.act('api/edits', { changes: ids.map((observation) => ({ do: 'use', observation, use, reason: reason.trim() })) });
  };
  return html`<${Modal} title=${ids.length === 1 ? `${label(o, rowsOf[0])}, ${spaced(o.kind[rowsOf[0]])}` : `${ids.length} observations`} submit=${submit} ready=${Boolean(reason.trim())} action="Adjust again">
    ${ids.length === 1 && html`<p class="muted small">${o.source[rowsOf[0]]}${o.reason?.[rowsOf[0]] ? ` · now: ${o.reason[rowsOf[0]]}` : ''}</p>`}
    <fieldset class="choices"><legend class="sr">Use</legend>
      ${[['active', 'On', 'takes part in the adjustment'], ['check', 'Check', 'is compared with the result, does not pull on it'], ['off', 'Off', 'is left out']].map(([value, title, words]) => html`<label key=${value} class=${use === value ? 'choice chosen' : 'choice'}>
        <input type="radio" name="use" value=${value} checked=${use === value} onChange=${() => setUse(value)} /><span><b>${title}</b><br /><span class="muted">${words}</span></span></label>`)}
    </fieldset>
    ${ask?.words && use === 'off' && html`<p class="note">${ask.words}</p>`}
    <${Reason} reason=${reason} set=${setReason} />
  <//>`;
}

function Role({ name }) {
  const point = s.points.value.find((p) => p.name === name);
  const [role, setRole] = useState(point.role === 'control' ? 'check' : 'control');
  const [reason, setReason] = useState('');
  const submit = () => {
    s.dialog.value = null;
    s.act('api/edits', { changes: [{ do: 'role', point: name, role, reason: reason.trim() }] });
  };
  return html`<${Modal} title=${`Role of ${name}`} submit=${submit} ready=${Boolean(reason.trim()) && role !== point.role} action="Adjust again">
    <fieldset class="choices"><legend class="sr">Role</legend>
      ${[['control', 'Control', 'its given coordinates take part'], ['check', 'Check', 'its given coordinates are only compared'], ['free', 'Free', 'its given coordinates are left out']].map(([value, title, words]) => html`<label key=${value} class=${role === value ? 'choice chosen' : 'choice'}>
        <input type="radio" name="role" value=${value} checked=${role === value} onChange=${() => setRole(value)} /><span><b>${title}</b>${point.role === value ? ' (now)' : ''}<br /><span class="muted">${words}</span></span></label>`)}
    </fieldset><${Reason} reason=${reason} set=${setReason} /><//>`;
}

function Target({ at, reject }) {
  const t = s.scene.value.targets;
  const [name, setName] = useState(t.name[at] ?? '');
  const back = t.accepted && !t.accepted[at];
  const [accept, setAccept] = useState(!reject);
  const [reason, setReason] = useState('');
  const submit = () => {
    s.dialog.value = null;
    s.act('api/edits', { changes: [{ do: 'target', scan: t.scan[at], number: t.number[at], name: back && name.trim() === t.name[at] ? null : name.trim() || null, accept, reason: reason.trim() }] });
  };
  return html`<${Modal} title=${`${back ? 'Take back' : reject ? 'Reject' : 'Target'} ${t.name[at] || `number ${t.number[at]}`}, ${t.scan[at]}`} submit=${submit} ready=${Boolean(reason.trim())} action="Adjust again">
    <p class="muted small">${spaced(t.kind[at])}${t.remark[at] ? `, ${t.remark[at]}` : ''}</p>
    <fieldset class="choices two"><legend class="sr">Decision</legend>
      <label class=${accept ? 'choice chosen' : 'choice'}><input type="radio" name="accept" checked=${accept} onChange=${() => setAccept(true)} /><span><b>It is a target</b></span></label>
      <label class=${accept ? 'choice' : 'choice chosen'}><input type="radio" name="accept" checked=${!accept} onChange=${() => setAccept(false)} /><span><b>It is none</b></span></label>
    </fieldset>
    ${accept && html`<label class="stack"><span>Name of the point</span><input type="text" maxlength="200" value=${name} onInput=${(e) => setName(e.currentTarget.value)} list="point-names" /></label>
      <datalist id="point-names">${s.points.value.map((p) => html`<option key=${p.name} value=${p.name}></option>`)}</datalist>`}
    <${Reason} reason=${reason} set=${setReason} example=${accept ? 'label read in the photograph of the set-up' : 'a reflection, no target stood there'} /><//>`;
}

export function Dialogs() {
  const d = s.dialog.value;
  if (!d) return null;
  if (d.type === 'use') return html`<${Use} ids=${d.ids} />`;
  if (d.type === 'role') return html`<${Role} name=${d.name} />`;
  if (d.type === 'target') return html`<${Target} at=${d.at} reject=${d.reject} />`;
  if (d.type === 'keys') return html`<${Keys} />`;
  return null;
}

function Keys() {
  const keys = [
    ['drag', 'turn about the point under the pointer (parallel views: move; Ctrl turns)'], ['Shift or right button', 'move'], ['wheel', 'nearer or farther, towards the pointer'],
    ['double click', 'go there'], ['R, F', 'first view; everything'], ['P, 1 to 5', 'perspective or parallel; plan and elevations'], ['M', 'measure a distance'],
    ['Escape', 'end a tool, clear the selection'], ['arrows in the table', 'next row; Enter or X: off, check or on'], ['Ctrl+Z, Ctrl+Shift+Z, Ctrl+S', 'undo, redo, save'],
  ];
  return html`<${Modal} title="Keys and pointer" submit=${() => (s.dialog.value = null)} ready=${true} action="Close"><dl class="keys">${keys.map(([key, words]) => html`<dt key=${key}>${key}</dt><dd>${words}</dd>`)}</dl><//>`;
}
