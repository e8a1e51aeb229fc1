// Are the numbers of this page those of golden/? Golden values, which stand in the page, beside what the page itself computes.

'use strict';

{
  const { html } = Laboratory;

  // `golden` lists [id, value, unit]. `judge` is given some of the computed values by id, and may be called again with others.
  Laboratory.sameNumbers = (golden) => {
    const found = new Map();
    const line = html('summary', { role: 'status' });
    const body = html('tbody');
    const head = html('tr', {}, ...['number', 'verdict', 'golden', 'computed in this page'].map((words) => html('th', { scope: 'col' }, words)));
    const table = html('div', { class: 'table-wrapper' }, html('table', {}, html('thead', {}, head), body));
    const element = html('details', { class: 'same-numbers' }, line, table);
    const row = ([id, value, unit]) => {
      const [experiment, number] = id.split(/\.(.*)/);
      const ours = found.get(id);
      const verdict = ours === undefined ? 'not yet' : Object.is(ours, value) ? 'same bits' : 'differs';
      const link = html('a', { href: `record-${experiment}.html#number-${number}` }, html('code', {}, id));
      return html('tr', verdict === 'differs' ? { class: 'deviates' } : {}, html('td', {}, link), html('td', {}, verdict), html('td', {}, `${value} ${unit}`),
        html('td', {}, ours === undefined ? '' : `${ours} ${unit}`));
    };
    const judge = (values) => {
      Object.entries(values).forEach(([id, value]) => found.set(id, value));
      const judged = golden.filter(([id]) => found.has(id));
      const wrong = judged.filter(([id, value]) => !Object.is(found.get(id), value));
      const waiting = golden.length - judged.length;
      const rest = waiting ? `; ${waiting} more once all calibrations of the chapter\u2019s scene are done` : '';
      const words = wrong.length
        ? `Not the same numbers: ${wrong.map(([id]) => id).join(', ')} ${wrong.length > 1 ? 'differ' : 'differs'} from the golden value`
        : `Same numbers: ${judged.length} of ${golden.length} golden values come out of this page to the last bit${rest}`;
      if (line.textContent !== words) line.textContent = words;
      element.classList.toggle('deviates', wrong.length > 0);
      element.dataset.same = wrong.length ? 'no' : waiting ? 'so far' : 'yes';
      body.replaceChildren(...golden.map(row));
    };
    judge({});
    return { element, judge };
  };
}
