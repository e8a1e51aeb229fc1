// A straight line and a lens: how far is the line bent, where in the image, and does it come back?

'use strict';

{
  const { html, svg, drawing, path, polyline, digits, plot, dragged, scene: { size: [WIDTH, HEIGHT], isBeyond } } = Laboratory;

  // Lines of the chapter's grid, ideal pixels.
  const ACROSS = [20, 80, 140, 200, 260, 320, 380, 440, 500, 560, 620];
  const DOWN = [60, 120, 180, 240, 300, 360, 420];
  // So many pieces make a line of the grid look smooth.
  const PIECES = 24;
  const POINTS = 61;

  const knobs = {
    k1: { label: 'k1 of the lens', min: -0.4, max: 0.4, step: 0.01, chapter: -0.18 },
    k2: { label: 'k2 of the lens', min: -0.2, max: 0.5, step: 0.01, chapter: 0.05 },
    height: { label: 'height of the line', unit: ' px', min: 0, max: HEIGHT - 1, chapter: 60 },
  };

  // What `bend` answers.
  const bending = (numbers) => {
    const column = (k) => Array.from({ length: POINTS }, (_, i) => numbers[5 + 6 * i + k]);
    const [u, v, deviation] = [0, 1, 2].map(column);
    return {
      max: numbers[0],
      rms: numbers[1],
      maxCorrected: numbers[2],
      roundTrip: numbers[4],
      seen: u.map((x, i) => [x, v[i]]),
      deviation,
    };
  };

  // What of the line the image does not show, in words.
  const outside = (count) => {
    if (count === 0) return '';
    return count === POINTS ? ' The line lies outside of the image.' : ` Outside of the image: ${count} of its ${POINTS} points.`;
  };

  // The grid's lines as lists of ideal points.
  const straight = (() => {
    const along = (a, b, k) => a + (b - a) * k / PIECES;
    const steps = Array.from({ length: PIECES + 1 }, (_, k) => k);
    const level = DOWN.map((v) => steps.map((k) => [along(ACROSS[0], ACROSS[ACROSS.length - 1], k), v]));
    const upright = ACROSS.map((u) => steps.map((k) => [u, along(DOWN[0], DOWN[DOWN.length - 1], k)]));
    return [...level, ...upright];
  })();

  const start = ({ stage, ask, same, set }) => {
    const image = drawing(WIDTH, HEIGHT, 'A grid as the lens shows it, and one of its level lines');
    image.append(svg('rect', { class: 'frame', width: WIDTH, height: HEIGHT }));
    const [grid, ideal, line] = ['grid', 'floor', 'points'].map((style) => path(image, style));
    const place = (x, y) => {
      set({ height: Math.round(y) });
      return true;
    };
    dragged(image, place, place);
    const chart = plot({ label: 'Distance of every point of the line from the regression line', xLabel: 'u of the point (px)', yLabel: 'distance (px)' });
    const deviation = chart.layer('residuals');
    const axis = chart.layer('predicted');
    const words = html('p', { class: 'says' });
    stage.append(html('div', { class: 'panel' }, html('p', { class: 'panel-title' }, 'The line in the image: drag it'), image),
      html('div', { class: 'panel' }, html('p', { class: 'panel-title' }, 'Distance from the regression line'), chart.element, words));

    // Both lenses of the book, at the chapter's line.
    const [barrel, pincushion] = [-0.18, 0.18].map((k1) => bending(ask('bend', [k1, 0.05, k1, 0.05, 60])));
    same({
      'line-bending.max-deviation': barrel.max,
      'line-bending.rms-deviation': barrel.rms,
      'line-bending.max-after-correction': barrel.maxCorrected,
      'line-bending.round-trip': barrel.roundTrip,
      'line-bending.pincushion-max-deviation': pincushion.max,
      'line-bending.pincushion-rms-deviation': pincushion.rms,
    });

    const show = ({ k1, k2, height }) => {
      const found = bending(ask('bend', [k1, k2, k1, k2, height]));
      const bent = straight.map((points) => {
        const flat = ask('distort', [k1, k2, ...points.flat()]);
        return points.map((_, i) => [flat[2 * i], flat[2 * i + 1]]);
      });
      grid(bent.map(polyline).join(''));
      ideal(`M20 ${height}H620`);
      line(polyline(found.seen));
      // Room for a pixel, or for twice as much, and so on.
      const room = 2 ** Math.max(0, Math.ceil(Math.log2(1.1 * found.max)));
      // A point outside of the image is shown too.
      const across = found.seen.map(([u]) => u);
      const [left, right] = [Math.min(0, ...across), Math.max(WIDTH, ...across)];
      chart.ranges([left, right], [room, -room]);
      deviation(polyline(found.seen.map(([u], i) => [chart.x(u), chart.y(found.deviation[i])])));
      axis(`M${chart.x(left)} ${chart.y(0)}H${chart.x(right)}`);
      words.textContent = `At most ${digits(found.max)} px, RMS ${digits(found.rms)} px; corrected with the same lens ${digits(found.maxCorrected, 1)} px.` +
        outside(found.seen.filter(isBeyond).length);
    };
    return { show };
  };

  Laboratory.widgets['line-bending'] = { title: 'Laboratory: bend the line', knobs, start };
}
