// Calibrations while the reader watches: as many in a frame as it has time for, stopped when nobody sees them.

'use strict';

{
  // Of a frame of a sixtieth of a second, ms: the rest is for drawing.
  const BUDGET_MS = 12;
  // Most trials that are asked for at once. A scene that says little takes the solver a hundred times as long: then it is one.
  const MOST = 8;

  // Runs `trials` trials of a scene, `numbers` numbers each. `drawn` is called after each frame with all that are done, their
  // number, and how many came in a frame on average. Those who want no motion get one call at the end.
  Laboratory.monteCarlo = ({ element, ask, trials, numbers, drawn }) => {
    const calm = matchMedia('(prefers-reduced-motion: reduce)');
    const values = new Float64Array(trials * numbers);
    let [scene, done, frames, seen, paused, asked] = [null, 0, 0, false, false, 0];
    let portion = 1;
    const calibrate = () => {
      const began = performance.now();
      const count = Math.min(portion, trials - done);
      values.set(ask('trials', [...scene, done, count]), done * numbers);
      done += count;
      portion = performance.now() - began < BUDGET_MS / 4 ? Math.min(MOST, 2 * portion) : 1;
    };
    const draw = () => {
      if (!calm.matches || done === trials) drawn(values.subarray(0, done * numbers), done, done / frames);
    };
    const frame = () => {
      asked = 0;
      if (!scene || paused || !seen || done === trials) return;
      const began = performance.now();
      frames += 1;
      while (done < trials && performance.now() - began < BUDGET_MS) calibrate();
      draw();
      next();
    };
    const next = () => {
      if (!asked && done < trials) asked = requestAnimationFrame(frame);
    };
    new IntersectionObserver((entries) => {
      seen = entries[entries.length - 1].isIntersecting;
      if (seen) next();
    }).observe(element);
    return {
      // Begins anew, with another scene.
      restart: (other) => {
        [scene, done, frames] = [other, 0, 0];
        next();
      },
      // Draws what is done once more, for another view of it.
      redraw: () => {
        if (done) draw();
      },
      pause: (on) => {
        paused = on;
        next();
      },
    };
  };
}
