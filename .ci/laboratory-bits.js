// Does a WebAssembly of the laboratory give the bits that native code gave? Reads the lines of `laboratory-bits`, asks the same questions
// through the script that the pages use, and compares every bit. Then measures its size and the time of a calibration.
//
//     laboratory-bits | node .ci/laboratory-bits.js FILE.wasm

'use strict';

const fs = require('fs');
const path = require('path');
const vm = require('vm');

const script = path.join(__dirname, '../book/laboratory/solver.js');
const Laboratory = vm.runInThisContext(`${fs.readFileSync(script, 'utf8')}\nLaboratory`);

// The chapter's scene of four poses.
const CHAPTER = [20, 120, 0, 4, 0.1, -0.18, 0.05, 9, 7];
// The least of so many portions is the time: what else the machine does only adds.
const PORTIONS = 40;
const OF_A_PORTION = 25;

const bits = (numbers) => {
  const words = new BigUint64Array(numbers.buffer, numbers.byteOffset, numbers.length);
  return Array.from(words, (word) => word.toString(16).padStart(16, '0')).join(' ');
};

// A NaN has many bits, and WebAssembly may choose; that it is one is all that it says.
const withoutPayload = (text) => text.replace(/\b[7f]ff[89a-f][0-9a-f]{12}\b/g, 'nan');

const answer = (ask, question, numbers) => {
  try {
    return bits(ask(question, numbers));
  } catch (error) {
    if (error instanceof Laboratory.Refusal) return `refused: ${error.message}`;
    throw error;
  }
};

// The section in which it carries the fingerprint of its sources, as src/laboratory/lib.rs names it.
const fingerprint = (code) => {
  const [section] = WebAssembly.Module.customSections(new WebAssembly.Module(code), 'calibench-fingerprint');
  return section ? Buffer.from(section).toString() : 'none';
};

const main = async () => {
  const code = fs.readFileSync(process.argv[2]);
  const ask = await Laboratory.solver(code);
  const [first, ...lines] = fs.readFileSync(0, 'utf8').split('\n').filter(Boolean);
  const stale = `fingerprint | ${fingerprint(code)}` !== first;
  if (stale) console.log(`FAILED laboratory: ${process.argv[2]} is stale, its sources have changed: run \`.ci/laboratory --write\` and commit it`);
  let [same, compared] = [0, 0];
  for (const line of lines) {
    const [question, numbers, native] = line.split(' | ');
    const here = answer(ask, question, numbers.split(' ').map(Number));
    if (withoutPayload(here) === withoutPayload(native)) same += 1;
    else console.log(`differs: ${question} ${numbers.slice(0, 120)}`);
    compared += native.startsWith('refused') ? 0 : native.split(' ').length;
  }
  let microseconds = Infinity;
  for (let portion = 0; portion < PORTIONS; portion += 1) {
    const began = process.hrtime.bigint();
    ask('trials', [...CHAPTER, portion * OF_A_PORTION, OF_A_PORTION]);
    microseconds = Math.min(microseconds, Number(process.hrtime.bigint() - began) / 1000 / OF_A_PORTION);
  }
  console.log(`wasm32 under node ${process.version}: ${same} of ${lines.length} answers have the bits of native code, ${compared} numbers`);
  console.log(`${code.length} bytes; ${microseconds.toFixed(0)} us a calibration of four views with covariance`);
  if (stale || lines.length === 0 || same < lines.length) process.exitCode = 1;
};

main();
