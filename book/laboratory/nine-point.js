// Nine dots to drag: which map still fits them?

'use strict';

{
  const { html, svg, drawing, path, digits, plot, dragged } = Laboratory;

  const [WIDTH, HEIGHT] = [1571, 1053];
  const MODELS = ['affine', 'similarity', 'projective'];
  const OF_A_MODEL = 31;
  const REACH_PX = 150;
  const DOTS = [0, 1, 2, 3, 4, 5, 6, 7, 8];
  const AXES = ['u', 'v'];
  // Of a dot, in the image; and how far beside a small one a finger may press, pixels of the screen.
  const RADIUS = 40;
  const FINGER_PX = 22;
  // Keys that move the dot that has the focus, by a pixel; with Shift by ten.
  const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

  // How far each dot is moved, px: no sliders, the dots themselves are moved.
  const knobs = Object.fromEntries(DOTS.flatMap((dot) => AXES.map((axis) => [`${axis}${dot + 1}`,
    { hidden: true, min: -REACH_PX, max: REACH_PX, chapter: 0 }])));

  // What `nine_points` answers of one model.
  const fitted = (numbers, model) => {
    const of = numbers.subarray(OF_A_MODEL * model, OF_A_MODEL * (model + 1));
    return {
      matrix: of.subarray(0, 9),
      scales: of.subarray(9, 11),
      rms: of[11],
      max: of[12],
      residuals: DOTS.map((dot) => [of[13 + 2 * dot], of[14 + 2 * dot]]),
    };
  };

  const golden = (affine) => ({
    'nine-point.m11': affine.matrix[0],
    'nine-point.m12': affine.matrix[1],
    'nine-point.m21': affine.matrix[3],
    'nine-point.m22': affine.matrix[4],
    'nine-point.tx': affine.matrix[2],
    'nine-point.ty': affine.matrix[5],
    'nine-point.sx': affine.scales[0],
    'nine-point.sy': affine.scales[1],
    'nine-point.rms': affine.rms,
    'nine-point.max': affine.max,
  });

  // The residuals of a model at the nine places of the target, enlarged until they are seen.
  const panelOf = (name) => {
    const chart = plot({ label: `Residuals of the ${name} map at the nine places`, xLabel: 'x (units)', yLabel: 'y (units)', height: 300 });
    chart.ranges([-1.5, 1.5], [-1.5, 1.5]);
    const places = DOTS.map((i) => [i % 3 - 1, 1 - Math.floor(i / 3)]);
    chart.layer('cloud')(Laboratory.dots(places.map(([x, y]) => [chart.x(x), chart.y(y)])));
    const arrows = chart.layer('residuals');
    const words = html('p', { class: 'says' });
    const element = html('div', { class: 'panel' }, html('p', { class: 'panel-title' }, name), chart.element, words);
    return {
      element,
      show: ({ residuals, rms, max, scales }) => {
        const enlarge = 10 ** Math.floor(Math.log10(0.4 / Math.max(max, 1e-15)));
        arrows(places.map(([x, y], i) => {
          const [a, b] = residuals[i];
          return `M${chart.x(x)} ${chart.y(y)}L${chart.x(x + enlarge * a)} ${chart.y(y + enlarge * b)}`;
        }).join(''));
        const perPx = (scales[0] + scales[1]) / 2;
        words.textContent = `RMS ${digits(rms, 3)} units, ${digits(rms / perPx, 3)} px; arrows \u00d7 ${digits(enlarge)}.`;
      },
    };
  };

  const start = ({ stage, ask, same, set, data }) => {
    const found = DOTS.map((dot) => [data.u[dot], data.v[dot]]);
    const image = drawing(WIDTH, HEIGHT, 'The nine dots in the image');
    image.setAttribute('role', 'group');
    image.append(svg('rect', { class: 'frame', width: WIDTH, height: HEIGHT }));
    const joined = path(image, 'grid');
    let moved = DOTS.map(() => [0, 0]);
    let held = null;
    const move = (dot, [du, dv]) => set({ [`u${dot + 1}`]: Math.round(du), [`v${dot + 1}`]: Math.round(dv) });
    const marks = found.map(([u, v], dot) => {
      const mark = svg('circle', { class: 'dot', r: RADIUS, tabindex: 0, role: 'button', 'aria-roledescription': 'dot to move' });
      mark.addEventListener('keydown', (event) => {
        const step = KEYS[event.key];
        if (!step) return;
        event.preventDefault();
        const by = event.shiftKey ? 10 : 1;
        move(dot, moved[dot].map((at, axis) => at + by * step[axis]));
      });
      image.append(mark);
      return mark;
    });
    // The dot that is pressed, and how far from its middle: it follows the pointer and does not jump to it.
    const grabbed = (x, y, unitsPerPixel) => {
      const from = DOTS.map((dot) => AXES.map((_, axis) => found[dot][axis] + moved[dot][axis] - [x, y][axis]));
      const dot = DOTS.reduce((least, other) => (Math.hypot(...from[other]) < Math.hypot(...from[least]) ? other : least));
      const isReached = Math.hypot(...from[dot]) <= Math.max(RADIUS, FINGER_PX * unitsPerPixel);
      held = isReached ? { dot, from: from[dot] } : null;
      return isReached;
    };
    dragged(image, grabbed, (x, y) => {
      const { dot, from } = held;
      move(dot, AXES.map((_, axis) => [x, y][axis] + from[axis] - found[dot][axis]));
    });
    const panels = MODELS.map(panelOf);
    const hint = html('p', { class: 'says' }, 'Drag a dot, or go to one with the Tab key and move it with the arrow keys, with Shift by ten pixels.');
    stage.append(html('div', { class: 'panel' }, html('p', { class: 'panel-title' }, 'The image'), image, hint), ...panels.map((panel) => panel.element));

    same(golden(fitted(ask('nine_points', found.flat()), 0)));

    const show = (values) => {
      moved = DOTS.map((dot) => AXES.map((axis) => values[`${axis}${dot + 1}`]));
      const at = found.map(([u, v], dot) => [u + moved[dot][0], v + moved[dot][1]]);
      marks.forEach((mark, dot) => {
        mark.setAttribute('cx', at[dot][0]);
        mark.setAttribute('cy', at[dot][1]);
        mark.setAttribute('aria-label', `dot ${dot + 1}, moved by ${moved[dot][0]} and ${moved[dot][1]} pixels`);
      });
      const rows = [[0, 1, 2], [3, 4, 5], [6, 7, 8], [0, 3, 6], [1, 4, 7], [2, 5, 8]];
      joined(rows.map((row) => Laboratory.polyline(row.map((dot) => at[dot]))).join(''));
      const answer = ask('nine_points', at.flat());
      panels.forEach((panel, model) => panel.show(fitted(answer, model)));
    };
    return { show };
  };

  Laboratory.widgets['nine-point'] = { title: 'Laboratory: nine dots to drag', knobs, start };
}
