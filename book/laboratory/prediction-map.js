// Where in the image is a calibration good? The error that the bound predicts for every pixel, as a map.

'use strict';

{
  const { html, svg, drawing, digits, scene: { size: [WIDTH, HEIGHT], centre: CENTRE, ...scene } } = Laboratory;

  // The map's cells are as wide as the frame over this.
  const CELL = WIDTH / 30;
  // Darkest at so many times the noise of a point.
  const DARKEST = 4;
  const FOLDS = 'not known: the lens folds back';
  const USES = ['points at the target\u2019s distance', 'directions'];

  const knobs = {
    ...scene.knobs,
    use: { label: 'the camera is used for', options: USES, min: 0, max: 1, chapter: 0 },
  };

  // What `uncertainty` answers.
  const mapped = (numbers) => ({ reach: numbers[0], within: numbers[1], beyond: numbers[2], nodes: numbers.subarray(3) });

  const start = ({ stage, ask, same }) => {
    const image = drawing(WIDTH, HEIGHT, 'Map of the predicted error of a pixel over the image');
    const hatch = svg('pattern', { id: 'lab-unknown', width: 8, height: 8, patternUnits: 'userSpaceOnUse', patternTransform: 'rotate(45)' },
      svg('rect', { class: 'unknown', width: 3, height: 8 }));
    const cells = svg('g');
    const reach = svg('circle', { class: 'reach', cx: CENTRE[0], cy: CENTRE[1] });
    image.append(svg('defs', {}, hatch), cells, reach);
    const legend = html('p', { class: 'legend' });
    const words = html('p', { class: 'says' });
    stage.append(html('div', { class: 'panel wide' }, image, legend, words));

    const [atTarget, directions] = [0, 1].map((use) => mapped(ask('uncertainty', [...scene.chapter, use])));
    same({
      'prediction-map.covered-radius': atTarget.reach,
      'prediction-map.predicted-at-target-covered': atTarget.within,
      'prediction-map.predicted-at-target-beyond': atTarget.beyond,
      'prediction-map.predicted-directions-covered': directions.within,
      'prediction-map.predicted-directions-beyond': directions.beyond,
    });

    const show = (values) => {
      const map = mapped(ask('uncertainty', [...scene.numbers(values), values.use]));
      const floor = Math.SQRT2 * values.noise;
      const shade = (error) => Math.min(1, error / (DARKEST * floor)).toFixed(3);
      const found = [];
      let unknown = false;
      for (let at = 0; at < map.nodes.length; at += 3) {
        const [u, v, error] = map.nodes.subarray(at, at + 3);
        const known = Number.isFinite(error);
        const look = known ? { class: 'cell', 'fill-opacity': shade(error) } : { fill: 'url(#lab-unknown)' };
        const cell = svg('rect', { ...look, x: u - CELL / 2 + 0.5, y: v - CELL / 2 + 0.5, width: CELL, height: HEIGHT / Math.round(HEIGHT / CELL) });
        cell.append(svg('title', {}, `(${Math.round(u)}, ${Math.round(v)}): ${known ? `${digits(error, 2)} px` : FOLDS}`));
        found.push(cell);
        unknown ||= !known;
      }
      cells.replaceChildren(...found);
      reach.setAttribute('r', map.reach);
      const swatch = (times) => {
        const colour = html('span', { class: 'swatch', style: `--shade: ${times / DARKEST}` });
        return html('span', {}, colour, ` ${digits(times * floor, 2)} px${times === DARKEST ? ' and more' : ''}`);
      };
      legend.replaceChildren(...[0, 1, 2, 3, DARKEST].map(swatch));
      if (unknown) legend.append(html('span', {}, html('span', { class: 'swatch unknown' }), ` ${FOLDS}`));
      words.textContent = `Within the circle, as far as points were seen: ${digits(map.within, 3)} px, root mean square; beyond it: ${digits(map.beyond, 3)} px. ` +
        `A single point is measured to ${digits(floor, 3)} px.`;
    };
    return { show };
  };

  Laboratory.widgets['prediction-map'] = { title: 'Laboratory: where the image is known', knobs, start };
}
