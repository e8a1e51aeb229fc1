// The library's solver in the page: numbers in, numbers out. Its WebAssembly stands in calibench.js, as text, because a browser that opens
// a file from a disk may load a script, but no data.

'use strict';

// What the scripts of the laboratory share; the only name that they add to a page.
const Laboratory = { widgets: {} };

// Why the solver gives no answer, in its own words.
Laboratory.Refusal = class extends Error {};

// The solver, once its code is compiled: a promise of `ask(question, numbers)`.
Laboratory.solver = async (bytes) => {
  const { exports } = (await WebAssembly.instantiate(bytes, {})).instance;
  return (question, numbers) => {
    const input = exports.lab_input(numbers.length);
    new Float64Array(exports.memory.buffer, input, numbers.length).set(numbers);
    const length = exports[`lab_${question}`]();
    // Memory may have grown, and moved, while the question was answered.
    const memory = exports.memory.buffer;
    if (length < 0) {
      throw new Laboratory.Refusal(new TextDecoder().decode(new Uint8Array(memory, exports.lab_refusal(), -length)));
    }
    return new Float64Array(memory, exports.lab_output(), length).slice();
  };
};

// The bytes of a text in base64.
Laboratory.bytes = (base64) => Uint8Array.from(atob(base64), (character) => character.charCodeAt(0));
