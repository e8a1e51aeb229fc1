// What a reader moves: sliders with label, value and unit, worked by mouse, finger or keyboard, and their state in the page's address.

'use strict';

{
  const { html } = Laboratory;

  // `#lab-NAME?knob=value&...`: the state of one laboratory of the page.
  const addressOf = (name, values, chapter) => {
    const moved = Object.entries(values).filter(([knob, value]) => value !== chapter[knob]);
    return `#lab-${name}?${moved.map(([knob, value]) => `${knob}=${value}`).join('&')}`;
  };

  // The state that the page's address names for this laboratory, or null.
  const addressed = (name) => {
    const [place, state] = location.hash.slice(1).split('?');
    return place === `lab-${name}` && state !== undefined ? new URLSearchParams(state) : null;
  };

  const slider = (name, knob, spec) => {
    const id = `lab-${name}-${knob}`;
    const input = html('input', { type: 'range', id, min: spec.min, max: spec.max, step: spec.step || 1 });
    const shown = html('output', { for: id, 'aria-live': 'off' });
    const say = () => {
      const words = spec.words ? spec.words(Number(input.value)) : `${input.value.replace('-', '\u2212')}${spec.unit || ''}`;
      shown.textContent = words;
      input.setAttribute('aria-valuetext', words);
    };
    return { element: html('div', { class: 'knob' }, html('label', { for: id }, spec.label), shown, input), input, say };
  };

  const choice = (name, knob, spec) => {
    const id = `lab-${name}-${knob}`;
    const options = spec.options.map((words, i) => html('option', { value: i }, words));
    const input = html('select', { id }, ...options);
    return { element: html('div', { class: 'knob' }, html('label', { for: id }, spec.label), input), input, say: () => {} };
  };

  // The knobs of a laboratory: `specs` names each with its range and the chapter's value; `changed` is called with all values by `start`
  // and whenever one moves. `set` moves some from elsewhere, also those without an input of their own (`hidden`).
  Laboratory.knobs = (name, specs, changed) => {
    const chapter = Object.fromEntries(Object.entries(specs).map(([knob, spec]) => [knob, spec.chapter]));
    const values = { ...chapter };
    const shown = Object.entries(specs).filter(([, spec]) => !spec.hidden);
    const parts = Object.fromEntries(shown.map(([knob, spec]) => [knob, (spec.options ? choice : slider)(name, knob, spec)]));
    const link = html('a', {}, 'Link to this state');
    const reset = html('button', { type: 'button' }, 'The chapter\u2019s values');
    const tell = () => {
      link.href = addressOf(name, values, chapter);
      changed({ ...values });
    };
    const put = (wanted) => {
      for (const [knob, spec] of Object.entries(specs)) {
        const given = wanted[knob] === undefined || wanted[knob] === null || wanted[knob] === '' ? NaN : Number(wanted[knob]);
        values[knob] = Number.isFinite(given) ? Math.min(spec.max ?? Infinity, Math.max(spec.min ?? -Infinity, given)) : spec.chapter;
        if (parts[knob]) {
          parts[knob].input.value = values[knob];
          // The input keeps to its steps.
          values[knob] = Number(parts[knob].input.value);
          parts[knob].say();
        }
      }
    };
    const fromAddress = () => {
      const state = addressed(name);
      if (state) put(Object.fromEntries(state));
      return state !== null;
    };
    for (const [knob, { input, say }] of Object.entries(parts)) {
      input.addEventListener('input', () => {
        values[knob] = Number(input.value);
        say();
        tell();
      });
    }
    reset.addEventListener('click', () => {
      put({});
      tell();
      // The address, if it names a state of this laboratory, names the one that is shown.
      if (addressed(name)) history.replaceState(null, '', link.href);
    });
    addEventListener('hashchange', () => {
      if (fromAddress()) tell();
    });
    put({});
    const here = fromAddress();
    return {
      element: html('div', { class: 'knobs' }, ...Object.values(parts).map((part) => part.element)),
      buttons: [reset, link],
      // Whether the page's address asks for this laboratory.
      here,
      start: tell,
      set: (some) => {
        put({ ...values, ...some });
        tell();
      },
    };
  };
}
