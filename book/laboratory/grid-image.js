// A photograph of a grid, and the same corrected with the lens that the reader believes in: one divider, two images.

'use strict';

{
  const { html, digits, scene: { size: [WIDTH, HEIGHT] } } = Laboratory;

  // The lens that took the photograph is the chapter's.
  const LENS = [-0.18, 0.05];
  // Height of the line that is measured, ideal px.
  const LINE = 60;

  const knobs = {
    divider: { label: 'divider of the images', min: 0, max: 100, chapter: 50, words: (share) => `${share} % photograph` },
    k1: { label: 'k1 of the correction', min: -0.4, max: 0.2, step: 0.01, chapter: -0.18 },
    k2: { label: 'k2 of the correction', min: -0.1, max: 0.2, step: 0.01, chapter: 0.05 },
  };

  // Grey levels as the image of a canvas.
  const imageOf = (levels) => {
    const image = new ImageData(WIDTH, HEIGHT);
    for (let k = 0; k < levels.length; k += 1) {
      image.data.fill(levels[k], 4 * k, 4 * k + 3);
      image.data[4 * k + 3] = 255;
    }
    return image;
  };

  const start = ({ stage, ask, same, set }) => {
    const canvas = html('canvas', { width: WIDTH, height: HEIGHT, role: 'img', 'aria-label': 'The photograph left of the divider, its correction right of it' });
    const surface = canvas.getContext('2d');
    const words = html('p', { class: 'says' });
    const holder = html('div', { class: 'divided' }, canvas, html('span', { class: 'left' }, 'photograph'), html('span', { class: 'right' }, 'corrected'));
    stage.append(html('div', { class: 'panel wide' }, holder, words));

    const place = (event) => set({ divider: Math.round(100 * (event.clientX - canvas.getBoundingClientRect().left) / canvas.clientWidth) });
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      place(event);
    });
    canvas.addEventListener('pointermove', (event) => {
      if (canvas.hasPointerCapture(event.pointerId)) place(event);
    });

    const photograph = ask('photograph', LENS);
    const before = imageOf(photograph);
    // The correction's question: its lens, then the photograph.
    const question = new Float64Array(2 + photograph.length);
    question.set(photograph, 2);
    const line = (k1, k2) => ask('bend', [...LENS, k1, k2, LINE]);
    const right = line(...LENS);
    same({
      'line-bending.max-deviation': right[0],
      'line-bending.rms-deviation': right[1],
      'line-bending.max-after-correction': right[2],
      'line-bending.round-trip': right[4],
    });

    let [lens, after] = ['', null];
    const show = ({ divider, k1, k2 }) => {
      if (lens !== `${k1} ${k2}`) {
        question.set([k1, k2]);
        after = imageOf(ask('rectify', question));
        lens = `${k1} ${k2}`;
      }
      const at = Math.round(WIDTH * divider / 100);
      surface.putImageData(before, 0, 0, 0, 0, at, HEIGHT);
      surface.putImageData(after, 0, 0, at, 0, WIDTH - at, HEIGHT);
      surface.fillStyle = '#d55e00';
      surface.fillRect(at - 1, 0, 2, HEIGHT);
      const found = line(k1, k2);
      words.textContent = `The computed points of the top line leave their regression line by ${digits(found[0])} px in the photograph and by ${digits(found[2], found[2] < 1e-9 ? 1 : 4)} px after the correction.`;
    };
    return { show };
  };

  Laboratory.widgets['grid-image'] = { title: 'Laboratory: before and after', knobs, start };
}
