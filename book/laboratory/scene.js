// The knobs of the four poses, and the scene that they make: the numbers with which `predict`, `calibrate` and their like begin.

'use strict';

{
  // Points of the target along X and Y, always over the same 80 x 60 mm.
  const TARGETS = [[3, 3], [5, 4], [7, 5], [9, 7], [13, 9]];

  const knobs = {
    tilt: { label: 'tilt of the views', unit: '\u00b0', min: 0, max: 45, chapter: 20 },
    distance: { label: 'distance of the target', unit: ' mm', min: 90, max: 240, step: 2, chapter: 120 },
    shift: { label: 'shift towards the corners', unit: ' mm', min: 0, max: 80, step: 2, chapter: 0 },
    views: { label: 'views', min: 1, max: 12, chapter: 4 },
    noise: { label: 'noise on each of u and v', unit: ' px', min: 0.01, max: 0.5, step: 0.01, chapter: 0.1 },
    k1: { label: 'k1 of the lens', min: -0.3, max: 0.3, step: 0.01, chapter: -0.18 },
    k2: { label: 'k2 of the lens', min: -0.1, max: 0.2, step: 0.01, chapter: 0.05 },
    target: { label: 'points of the target', min: 0, max: TARGETS.length - 1, chapter: 3, words: (i) => TARGETS[i].join(' \u00d7 ') },
  };

  const numbers = ({ tilt, distance, shift, views, noise, k1, k2, target }) => [tilt, distance, shift, views, noise, k1, k2, ...TARGETS[target]];

  Laboratory.scene = {
    knobs,
    numbers,
    chapter: numbers(Object.fromEntries(Object.entries(knobs).map(([knob, spec]) => [knob, spec.chapter]))),
    // Width and height of the image, its principal point, and the corner that is farthest from it, px.
    size: [640, 480],
    centre: [326, 243],
    corner: [-0.5, 479.5],
    // Whether a pixel lies outside of the image: pixel (0, 0) is the middle of the first one.
    isBeyond: ([u, v]) => Math.min(u, v) < -0.5 || u > 639.5 || v > 479.5,
  };
}
