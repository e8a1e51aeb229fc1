// Starts the laboratories of the page. Each stands in an element that names it and holds its golden values; without scripts, and on paper,
// the element is empty and the figure beside it is all there is.

'use strict';

{
  const { html } = Laboratory;

  const startOne = (element, ask) => {
    const name = element.dataset.lab;
    const { title, knobs: specs, start } = Laboratory.widgets[name];
    const same = Laboratory.sameNumbers(JSON.parse(element.dataset.golden));
    const words = html('p', { class: 'refusal', role: 'status' });
    const stage = html('div', { class: 'stage' });
    // A question that is refused leaves the drawings as they were, faint; a laboratory that draws all the same returns its refusal.
    const answering = (show) => (values) => {
      let refusal = null;
      let stale = false;
      try {
        refusal = show(values);
      } catch (error) {
        if (!(error instanceof Laboratory.Refusal)) throw error;
        [refusal, stale] = [error, true];
      }
      words.textContent = refusal ? `The library refuses: ${refusal.message}.` : '';
      stage.classList.toggle('stale', stale);
    };
    let show = () => {};
    const knobs = Laboratory.knobs(name, specs, (values) => answering(show)(values));
    const data = element.dataset.columns ? JSON.parse(element.dataset.columns) : {};
    const parts = start({ element, stage, ask, same: same.judge, set: knobs.set, data });
    show = parts.show;
    element.setAttribute('role', 'group');
    element.setAttribute('aria-label', title);
    element.append(html('p', { class: 'lab-title' }, title), knobs.element,
      html('p', { class: 'buttons' }, ...(parts.buttons || []), ...knobs.buttons), words, stage, same.element);
    knobs.start();
    if (knobs.here) element.scrollIntoView();
  };

  const all = [...document.querySelectorAll('.laboratory[data-lab]')];
  // A browser too old for the code shows the figures alone.
  const solver = Laboratory.solver(Laboratory.bytes(Laboratory.code)).catch(() => null);
  solver.then((ask) => {
    if (!ask) return;
    document.documentElement.classList.add('laboratories-run');
    all.forEach((element) => startOne(element, ask));
    // What the address names may have been hidden until now.
    const named = document.querySelector('.with-laboratory :target');
    if (named) named.scrollIntoView();
  });
}
