// The four poses with everything that can be moved: what the camera sees, how well the bound says it is known, and calibrations that show
// whether that is so.

'use strict';

{
  const { html, svg, drawing, path, dots, polyline, digits, counted, plot, scene: { chapter: CHAPTER, size: [WIDTH, HEIGHT], ...scene } } = Laboratory;

  const PARAMETERS = ['fx', 'fy', 'cx', 'cy', 'k1', 'k2'];
  const UNITS = ['px', 'px', 'px', 'px', '', ''];
  // Of the parameters, which two the cloud shows.
  const PAIRS = [[4, 5], [0, 1], [0, 2], [0, 5], [2, 3]];
  // As many as the experiment has: then both say the same.
  const TRIALS = 2000;
  const OF_A_TRIAL = PARAMETERS.length + 1;
  // Around each view's panel, px of its image.
  const GAP = 20;
  // Residuals are drawn so long that the noise is this many pixels.
  const ARROW_PX = 15;
  // Squared radius of the ellipse that holds this share of a plane's normal points: -2 log(1 - share).
  const SHARES = [0.5, 0.95];
  const radius = (share) => Math.sqrt(-2 * Math.log(1 - share));

  const knobs = {
    ...scene.knobs,
    draw: { label: 'draw of the noise', min: 0, max: 99, chapter: 0 },
    pair: { label: 'cloud of', options: PAIRS.map((pair) => pair.map((i) => PARAMETERS[i]).join(' and ')), min: 0, max: PAIRS.length - 1, chapter: 0 },
  };

  // What `predict` answers.
  const prediction = (numbers) => ({
    truth: numbers.slice(0, 6),
    covariance: (i, j) => numbers[6 + 6 * i + j],
    rmseMean: numbers[42],
    rmseSd: numbers[43],
    floor: numbers[44],
    reach: numbers[45],
    low: numbers[46],
    width: numbers[47],
    bars: numbers.slice(48),
  });

  // What `calibrate` answers.
  const calibration = (numbers) => ({
    estimate: numbers.slice(0, 6),
    rmse: numbers[12],
    chiSquared: numbers[13],
    residuals: numbers.slice(14),
  });

  // A view in its frame: the points as seen, and their residuals so many times enlarged.
  const viewOf = (points, residuals, enlarged) => {
    const group = svg('g', {}, svg('rect', { class: 'frame', width: WIDTH, height: HEIGHT }));
    path(group, 'residuals')(residuals.map(([u, v], i) => `M${points[i].join(' ')}l${enlarged * u} ${enlarged * v}`).join(''));
    path(group, 'points')(dots(points));
    return group;
  };

  const pairs = (numbers) => Array.from({ length: numbers.length / 2 }, (_, i) => [numbers[2 * i], numbers[2 * i + 1]]);

  const viewsOf = (holder) => ([perView, ...seen], found, { views, noise }, reach) => {
    const [points, residuals] = [pairs(seen), found ? pairs(found.residuals) : []];
    const columns = views <= 4 ? 2 : views <= 9 ? 3 : 4;
    const [across, down] = [WIDTH + GAP, HEIGHT + GAP];
    const element = drawing(columns * across, Math.ceil(views / columns) * down, `The points in ${counted(views, 'view')}, each with its residual`);
    const enlarged = ARROW_PX / noise;
    for (let view = 0; view < views; view += 1) {
      const of = (all) => all.slice(view * perView, (view + 1) * perView);
      const group = viewOf(of(points), of(residuals), enlarged);
      group.setAttribute('transform', `translate(${(view % columns) * across + GAP / 2} ${Math.floor(view / columns) * down + GAP / 2})`);
      element.append(group);
    }
    const share = Math.round(100 * reach / Math.hypot(scene.corner[0] - scene.centre[0], scene.corner[1] - scene.centre[1]));
    const beyond = points.filter(scene.isBeyond).length;
    const words = `Points as seen, and residuals \u00d7 ${digits(enlarged)}; points reach ${digits(reach, 3)} px from the principal point, ${share} % of the way to the farthest corner.` +
      (beyond ? ` Beyond the border of the image, where a real camera would not see them: ${beyond} of ${points.length} points.` : '');
    holder.replaceChildren(html('p', { class: 'panel-title' }, 'The views'), element, html('p', { class: 'says' }, words));
  };

  // What must be said where some calibrations have no result, or nothing.
  const selection = (answered, done) => (answered === done ? ''
    : ` Only ${answered} of ${done} calibrations gave an answer, the rest were refused: what is shown is a selection, and need not follow the prediction.`);

  // The ellipse that holds a share of the errors of two parameters, in standard deviations of each.
  const ellipse = (correlation, share) => {
    const points = [];
    for (let k = 0; k <= 72; k += 1) {
      const angle = k / 36 * Math.PI;
      const [c, s] = [Math.cos(angle), Math.sin(angle)].map((x) => radius(share) * x);
      points.push([c, correlation * c + Math.sqrt(1 - correlation * correlation) * s]);
    }
    return points;
  };

  const cloudOf = (holder) => {
    const words = html('p', { class: 'says' });
    let now;
    return {
      begin: (theory, [i, j], estimate) => {
        const [si, sj] = [i, j].map((k) => Math.sqrt(theory.covariance(k, k)));
        const known = Number.isFinite(si);
        const label = `Estimates of ${PARAMETERS[i]} and ${PARAMETERS[j]} inside the ellipses that the bound predicts`;
        const axis = (k) => `${PARAMETERS[k]}${UNITS[k] && ` (${UNITS[k]})`}`;
        const chart = plot({ label, xLabel: axis(i), yLabel: axis(j) });
        const correlation = theory.covariance(i, j) / (si * sj);
        if (known) {
          chart.ranges([theory.truth[i] - 4 * si, theory.truth[i] + 4 * si], [theory.truth[j] - 4 * sj, theory.truth[j] + 4 * sj]);
        }
        const put = ([a, b]) => [chart.x(theory.truth[i] + a * si), chart.y(theory.truth[j] + b * sj)].map((v) => v.toFixed(1));
        const cloud = chart.layer('cloud');
        if (known) SHARES.forEach((share) => chart.layer('predicted')(polyline(ellipse(correlation, share).map(put))));
        if (known && estimate) chart.layer('own')(dots([put([(estimate[i] - theory.truth[i]) / si, (estimate[j] - theory.truth[j]) / sj])]));
        holder.replaceChildren(html('p', { class: 'panel-title' }, `${PARAMETERS[i]} against ${PARAMETERS[j]}`), chart.element, words);
        words.textContent = known ? '' : 'The bound is infinite: these views determine no camera.';
        now = { i, j, si, sj, correlation, put, cloud, known };
      },
      trials: (values) => {
        if (!now.known) return;
        const { i, j, si, sj, correlation, put, cloud } = now;
        const points = [];
        let inside = 0;
        let estimated = 0;
        const limit = radius(SHARES[1]) ** 2;
        for (let at = 0; at < values.length; at += OF_A_TRIAL) {
          const [a, b] = [values[at + i] / si, values[at + j] / sj];
          if (Number.isNaN(a)) continue;
          estimated += 1;
          if ((a * a - 2 * correlation * a * b + b * b) / (1 - correlation * correlation) <= limit) inside += 1;
          points.push(put([a, b]));
        }
        cloud(dots(points));
        const share = estimated ? `Inside the outer ellipse, which is to hold ${100 * SHARES[1]} %: ${(100 * inside / estimated).toFixed(1)} % of ${counted(estimated, 'calibration')}.` : '';
        words.textContent = share + selection(estimated, values.length / OF_A_TRIAL);
      },
    };
  };

  const histogramOf = (holder) => {
    const words = html('p', { class: 'says' });
    let now;
    return {
      begin: (theory, own) => {
        const label = 'Histogram of the reprojection error over the calibrations, and the law that it should follow';
        const chart = plot({ label, xLabel: 'RMSE (px)', yLabel: 'share of calibrations' });
        const high = theory.low + theory.width * theory.bars.length;
        chart.ranges([theory.low, high], [0, 1.5 * Math.max(...theory.bars)]);
        const bars = chart.layer('bars');
        const middle = (k) => theory.low + (k + 0.5) * theory.width;
        chart.layer('predicted')(polyline([...theory.bars].map((share, k) => [chart.x(middle(k)), chart.y(share)])));
        const upright = (value, style) => {
          if (value > theory.low && value < high) chart.layer(style)(`M${chart.x(value)} ${chart.y(0)}V10`);
        };
        upright(theory.floor, 'floor');
        if (own) upright(own.rmse, 'own-line');
        holder.replaceChildren(html('p', { class: 'panel-title' }, 'RMSE, and its law'), chart.element, words);
        const said = `Predicted ${digits(theory.rmseMean)} \u00b1 ${digits(theory.rmseSd, 2)} px, under the floor of ${digits(theory.floor)} px (dotted)` +
          (own ? `; this draw: ${digits(own.rmse)} px.` : '.');
        words.textContent = said;
        now = { theory, chart, bars, said };
      },
      trials: (values) => {
        const { theory, chart, bars, said } = now;
        const counts = new Array(theory.bars.length).fill(0);
        let estimated = 0;
        for (let at = OF_A_TRIAL - 1; at < values.length; at += OF_A_TRIAL) {
          if (Number.isNaN(values[at])) continue;
          estimated += 1;
          const bar = Math.floor((values[at] - theory.low) / theory.width);
          if (bar >= 0 && bar < counts.length) counts[bar] += 1;
        }
        const left = (k) => chart.x(theory.low + k * theory.width);
        const bar = (count, k) => `M${left(k)} ${chart.y(0)}V${chart.y(Math.min(count / estimated, 1.5 * Math.max(...theory.bars)))}H${left(k + 1)}V${chart.y(0)}Z`;
        bars(estimated ? counts.map(bar).join('') : '');
        words.textContent = said + selection(estimated, values.length / OF_A_TRIAL);
      },
    };
  };

  const tableOf = (holder) => {
    const cells = PARAMETERS.map(() => [0, 1, 2, 3, 4].map(() => html('td')));
    const heads = ['', 'true', 'this draw', 's, predicted', 's of the trials', 'ratio'];
    const row = (name, k) => html('tr', {}, html('th', { scope: 'row' }, name + (UNITS[k] && ` (${UNITS[k]})`)), ...cells[k]);
    const head = html('thead', {}, html('tr', {}, ...heads.map((words) => html('th', { scope: 'col' }, words))));
    const words = html('p', { class: 'says' });
    const pace = html('p', { class: 'says pace' });
    holder.append(html('div', { class: 'table-wrapper' }, html('table', {}, head, html('tbody', {}, ...PARAMETERS.map(row)))), words, pace);
    const sd = (theory, k) => Math.sqrt(theory.covariance(k, k));
    return {
      begin: (theory, own) => cells.forEach((cell, k) => {
        cell[0].textContent = digits(theory.truth[k]);
        cell[1].textContent = own ? digits(own.estimate[k], 6) : '\u2013';
        cell[2].textContent = digits(sd(theory, k), 3);
        cell[3].textContent = cell[4].textContent = '';
        words.textContent = '';
        pace.textContent = '';
      }),
      trials: (theory, spread, done, aFrame) => {
        cells.forEach((cell, k) => {
          cell[3].textContent = spread[0] > 1 ? digits(spread[1 + k], 3) : '';
          cell[4].textContent = spread[0] > 1 ? (spread[1 + k] / sd(theory, k)).toFixed(3) : '';
        });
        const mean = spread[0] ? `; mean RMSE ${digits(spread[7])} px` : '';
        words.textContent = `${done} of ${TRIALS} calibrations${mean}.${selection(spread[0], done)}`;
        pace.textContent = `${counted(Math.round(aFrame), 'calibration')} a frame.`;
      },
    };
  };

  // The golden numbers that a single draw gives, and those of all trials.
  const ofDraw = (theory, own) => ({
    ...Object.fromEntries(PARAMETERS.flatMap((name, k) => [[`four-pose.${name}`, own.estimate[k]], [`four-pose.${name}-sd`, Math.sqrt(theory.covariance(k, k))]])),
    'four-pose.rmse': own.rmse,
    'four-pose.rmse-expected': theory.rmseMean,
    'four-pose.chi-squared-ours': own.chiSquared,
  });
  const ofTrials = (theory, spread) => ({
    'four-pose.converged': spread[0],
    'four-pose.rmse-mean': spread[7],
    ...Object.fromEntries(PARAMETERS.map((name, k) => [`four-pose.${name}-sd-ratio`, spread[1 + k] / Math.sqrt(theory.covariance(k, k))])),
  });

  const start = ({ element, stage, ask, same }) => {
    const holders = [0, 1, 2, 3].map(() => html('div', { class: 'panel' }));
    stage.append(...holders);
    const views = viewsOf(holders[0]);
    const [cloud, histogram, table] = [cloudOf(holders[1]), histogramOf(holders[2]), tableOf(holders[3])];
    let [theory, scenery, atChapter] = [null, '', false];
    const trials = Laboratory.monteCarlo({
      element,
      ask,
      trials: TRIALS,
      numbers: OF_A_TRIAL,
      drawn: (values, done, aFrame) => {
        const spread = ask('spread', values);
        cloud.trials(values);
        histogram.trials(values);
        table.trials(theory, spread, done, aFrame);
        if (done < TRIALS) return;
        stage.setAttribute('aria-busy', 'false');
        if (atChapter) same(ofTrials(theory, spread));
      },
    });
    same(ofDraw(prediction(ask('predict', CHAPTER)), calibration(ask('calibrate', [...CHAPTER, 0]))));

    const pause = html('button', { type: 'button', 'aria-pressed': 'false' }, 'Pause');
    pause.addEventListener('click', () => {
      const on = pause.getAttribute('aria-pressed') === 'false';
      pause.setAttribute('aria-pressed', on);
      trials.pause(on);
    });

    const show = (values) => {
      const numbers = scene.numbers(values);
      theory = prediction(ask('predict', numbers));
      const draw = [...numbers, values.draw];
      let [own, refusal] = [null, null];
      try {
        own = calibration(ask('calibrate', draw));
      } catch (error) {
        if (!(error instanceof Laboratory.Refusal)) throw error;
        refusal = error;
      }
      atChapter = numbers.every((number, k) => number === CHAPTER[k]);
      views(ask('observe', draw), own, values, theory.reach);
      cloud.begin(theory, PAIRS[values.pair], own && own.estimate);
      histogram.begin(theory, own);
      table.begin(theory, own);
      // Another draw or another cloud is another view of the same calibrations.
      if (scenery === numbers.join()) {
        trials.redraw();
        return refusal;
      }
      scenery = numbers.join();
      stage.setAttribute('aria-busy', 'true');
      trials.restart(numbers);
      return refusal;
    };
    return { show, buttons: [pause] };
  };

  Laboratory.widgets['four-pose'] = { title: 'Laboratory: the four poses', knobs, start };
}
