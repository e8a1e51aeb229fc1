// Elements and plots. A plot is SVG, so that it is sharp at any size and takes its colours, light or dark, from the page's style.

'use strict';

{
  const fill = (element, attributes, children) => {
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    element.append(...children);
    return element;
  };

  Laboratory.html = (tag, attributes = {}, ...children) => fill(document.createElement(tag), attributes, children);

  Laboratory.svg = (tag, attributes = {}, ...children) =>
    fill(document.createElementNS('http://www.w3.org/2000/svg', tag), attributes, children);

  // A drawing of that size in its own units, and what it shows for those who do not see it.
  Laboratory.drawing = (width, height, label) =>
    Laboratory.svg('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': label });

  // A path of the drawing, redrawn by calling it.
  Laboratory.path = (parent, style) => {
    const path = Laboratory.svg('path', { class: style });
    parent.append(path);
    return (d) => path.setAttribute('d', d);
  };

  // The points as dots of a path, which has round ends.
  Laboratory.dots = (points) => points.map(([x, y]) => `M${x} ${y}h0`).join('');

  // The points joined by lines.
  Laboratory.polyline = (points) => points.map(([x, y], i) => `${i ? 'L' : 'M'}${x} ${y}`).join('');

  // A number with so many significant digits, and a minus as printed; a dash for none.
  Laboratory.digits = (value, count = 4) => {
    if (!Number.isFinite(value)) return '\u2013';
    const small = value !== 0 && Math.abs(value) < 1e-4;
    return (small ? value.toExponential(count - 1) : Number(value.toPrecision(count)).toString()).replaceAll('-', '\u2212');
  };

  // So many of them, in words: `1 view`, `4 views`.
  Laboratory.counted = (count, noun) => `${count} ${noun}${count === 1 ? '' : 's'}`;

  const MARGIN = { left: 66, right: 10, top: 10, bottom: 38 };
  // A digit of the labels is so wide, in the units of a drawing.
  const DIGIT = 6.5;

  // Round numbers between two, about five.
  const ticks = (from, to) => {
    const [low, high] = [Math.min(from, to), Math.max(from, to)];
    const rough = (high - low) / 5;
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough) || power;
    const found = [];
    for (let k = Math.ceil(low / step); k * step <= high; k += 1) found.push(Number((k * step).toPrecision(12)));
    return found;
  };

  // Where the pointer is in the units of a drawing, and how many of these are a pixel of the screen.
  const inDrawing = (element, event) => {
    const inverse = element.getScreenCTM().inverse();
    const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(inverse);
    return [x, y, inverse.a];
  };

  // While the pointer is held down on a drawing: `pressed(x, y, unitsPerPixel)` where it goes down, which says whether there is something to
  // move, and then `moved(x, y)`.
  Laboratory.dragged = (element, pressed, moved) => {
    element.classList.add('dragged');
    element.addEventListener('pointerdown', (event) => {
      if (pressed(...inDrawing(element, event))) element.setPointerCapture(event.pointerId);
    });
    element.addEventListener('pointermove', (event) => {
      if (element.hasPointerCapture(event.pointerId)) moved(...inDrawing(element, event));
    });
  };

  // A plot with axes whose range can change: `x` and `y` place a value, `layer` makes a path.
  Laboratory.plot = ({ label, xLabel, yLabel, width = 360, height = 270 }) => {
    const element = Laboratory.drawing(width, height, label);
    const [right, bottom] = [width - MARGIN.right, height - MARGIN.bottom];
    const grid = Laboratory.path(element, 'grid');
    const words = Laboratory.svg('g', { class: 'words' });
    element.append(words);
    const text = (x, y, anchor, content) => Laboratory.svg('text', { x, y, 'text-anchor': anchor }, content);
    const names = [text((MARGIN.left + right) / 2, height - 5, 'middle', xLabel), text(0, 0, 'middle', yLabel)];
    names[1].setAttribute('transform', `translate(12 ${(MARGIN.top + bottom) / 2}) rotate(-90)`);
    // A label of the horizontal axis stays within the drawing.
    const along = (value) => {
      const words = Laboratory.digits(value);
      return text(Math.min(plot.x(value), width - DIGIT * words.length / 2), bottom + 14, 'middle', words);
    };
    let place;
    const plot = {
      element,
      x: (value) => MARGIN.left + (value - place[0][0]) / (place[0][1] - place[0][0]) * (right - MARGIN.left),
      y: (value) => bottom - (value - place[1][0]) / (place[1][1] - place[1][0]) * (bottom - MARGIN.top),
      layer: (style) => Laboratory.path(element, style),
      ranges: (xRange, yRange) => {
        place = [xRange, yRange];
        const [across, up] = [ticks(...xRange), ticks(...yRange)];
        grid(across.map((v) => `M${plot.x(v)} ${bottom}V${MARGIN.top}`).join('') + up.map((v) => `M${MARGIN.left} ${plot.y(v)}H${right}`).join(''));
        words.replaceChildren(
          ...across.map(along),
          ...up.map((v) => text(MARGIN.left - 5, plot.y(v) + 4, 'end', Laboratory.digits(v))),
          ...names,
        );
      },
    };
    return plot;
  };
}
