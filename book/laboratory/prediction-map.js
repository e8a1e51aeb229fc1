// Where in the image is a calibration good? The error that the bound predicts for every pixel, as a map.

'use strict';

{
  const { html, svg, drawing, digits } = Laboratory;

  const [WIDTH, HEIGHT] = [640, 480];
  // The map's cells are as wide as the frame over this.
  const CELL = WIDTH / 30;
  // Darkest at so many times the noise of a point.
  const DARKEST = 4;
  const TARGETS = [[3, 3], [5, 4], [7, 5], [9, 7], [13, 9]];
  const USES = ['points at the target\u2019s distance', 'directions'];
  // Principal point of the chapter's camera, px.
  const CENTRE = [326, 243];

  const knobs = {
    tilt: { label: 'tilt of the views', unit: '\u00b0', min: 1, max: 45, chapter: 20 },
    distance: { label: 'distance of the target', unit: ' mm', min: 90, max: 240, step: 2, chapter: 120 },
    views: { label: 'views', min: 2, max: 12, chapter: 4 },
    noise: { label: 'noise on each of u and v', unit: ' px', min: 0.01, max: 0.5, step: 0.01, chapter: 0.1 },
    target: { label: 'points of the target', min: 0, max: TARGETS.length - 1, chapter: 3, words: (i) => TARGETS[i].join(' \u00d7 ') },
    use: { label: 'the camera is used for', options: USES, min: 0, max: 1, chapter: 0 },
  };

  const ofScene = ({ tilt, distance, views, noise, target, use }) => [tilt, distance, views, noise, -0.18, 0.05, ...TARGETS[target], use];

  // What `uncertainty` answers.
  const mapped = (numbers) => ({ reach: numbers[0], within: numbers[1], beyond: numbers[2], nodes: numbers.subarray(3) });

  const start = ({ stage, ask, same }) => {
    const image = drawing(WIDTH, HEIGHT, 'Map of the predicted error of a pixel over the image');
    const cells = svg('g');
    const reach = svg('circle', { class: 'reach', cx: CENTRE[0], cy: CENTRE[1] });
    image.append(cells, reach);
    const legend = html('p', { class: 'legend' });
    const words = html('p', { class: 'says' });
    stage.append(html('div', { class: 'panel wide' }, image, legend, words));

    const chapter = Object.fromEntries(Object.entries(knobs).map(([knob, spec]) => [knob, spec.chapter]));
    const [atTarget, directions] = [0, 1].map((use) => mapped(ask('uncertainty', ofScene({ ...chapter, use }))));
    same({
      'prediction-map.covered-radius': atTarget.reach,
      'prediction-map.predicted-at-target-covered': atTarget.within,
      'prediction-map.predicted-at-target-beyond': atTarget.beyond,
      'prediction-map.predicted-directions-covered': directions.within,
      'prediction-map.predicted-directions-beyond': directions.beyond,
    });

    const show = (values) => {
      const map = mapped(ask('uncertainty', ofScene(values)));
      const floor = Math.SQRT2 * values.noise;
      const shade = (error) => Math.min(1, error / (DARKEST * floor)).toFixed(3);
      const found = [];
      for (let at = 0; at < map.nodes.length; at += 3) {
        const [u, v, error] = map.nodes.subarray(at, at + 3);
        const cell = svg('rect', { class: 'cell', x: u - CELL / 2 + 0.5, y: v - CELL / 2 + 0.5, width: CELL, height: HEIGHT / Math.round(HEIGHT / CELL), 'fill-opacity': shade(error) });
        cell.append(svg('title', {}, `(${Math.round(u)}, ${Math.round(v)}): ${digits(error, 2)} px`));
        found.push(cell);
      }
      cells.replaceChildren(...found);
      reach.setAttribute('r', map.reach);
      const swatch = (times) => {
        const colour = html('span', { class: 'swatch', style: `--shade: ${times / DARKEST}` });
        return html('span', {}, colour, ` ${digits(times * floor, 2)} px${times === DARKEST ? ' and more' : ''}`);
      };
      legend.replaceChildren(...[0, 1, 2, 3, DARKEST].map(swatch));
      words.textContent = `Within the circle, as far as points were seen: ${digits(map.within, 3)} px, root mean square; beyond it: ${digits(map.beyond, 3)} px. ` +
        `A single point is measured to ${digits(floor, 3)} px.`;
    };
    return { show };
  };

  Laboratory.widgets['prediction-map'] = { title: 'Laboratory: where the image is known', knobs, start };
}
