// The haptic loop beside drawing, and a bare worker in the same page at the same time, which keeps the same schedule and
// does nothing else: ticks a second, the bare worker's lateness, frontier ticks. Travels by mouse, a round trip of DELAY ms from
// the server. Writes the figures to OUT/ticks.json.
//   node ticks.mjs PACKAGES CHROMIUM FILIFORM SET OUT SLOW_WIRE SECONDS DELAY
import assert from 'node:assert/strict';
import {writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {openBrowser, openPage, serveSets, waitFor} from '../service/browser.mjs';
import {chromium, filiform, name, opened, out, packages, run, set, settled, sleep, slowWire, state} from './travelling.mjs';

const [wire, seconds, delay_ms] = [process.argv[7], Number(process.argv[8]), Number(process.argv[9])];

// In a worker: ticks each ms; a tick that ends late skips what is due before.
function bareLoop() {
  const cell = new Int32Array(new SharedArrayBuffer(4)), late_ms = [];
  let stopped = false;
  const begun = performance.now();
  let due = begun, ticks = 0;
  const slice = () => {
    const until = performance.now() + 500;
    while (performance.now() < until) {
      const left = due - performance.now();
      if (left > 0) Atomics.wait(cell, 0, 0, left);
      const now = performance.now();
      late_ms.push(now - due);
      ++ticks;
      ++due;
      if (now > due) due += Math.floor(now - due) + 1;
    }
    if (!stopped) return setTimeout(slice);
    late_ms.sort((a, b) => a - b);
    const at = (part) => late_ms[Math.floor(part * (late_ms.length - 1))];
    postMessage({rate: ticks / ((performance.now() - begun) / 1000), p50_ms: at(0.5), p99_ms: at(0.99), most_ms: at(1)});
  };
  onmessage = () => { stopped = true; };
  slice();
}

await run(async () => {
  const served = await serveSets(filiform, [set]);
  const address = delay_ms > 0 ? await slowWire(wire, served, delay_ms, 1e9) : served;
  const page = await openPage(await openBrowser(packages, chromium));
  await page.setBypassCSP(true);
  await page.setViewport({width: 640, height: 360});
  await page.goto(`${address}/travel/${name}?segments=20000`);
  await opened(page);
  await settled(page);
  // The state, at the moment when it is new.
  const fresh = async () => {
    const {tick} = await state(page);
    await waitFor('the next state', async () => (await state(page)).tick !== tick, 20);
    return [await state(page), performance.now()];
  };
  const measure = async (travels) => {
    await page.evaluate((code) => {
      window.bare = new Worker(URL.createObjectURL(new Blob([`(${code})()`])));
      window.told = new Promise((done) => { window.bare.onmessage = (event) => done(event.data); });
    }, bareLoop.toString());
    const [x, y] = (await state(page)).proxy_px;
    const [first, from] = await fresh();
    if (travels) {
      await page.mouse.move(x, y);
      await page.mouse.down({button: 'right'});
    }
    for (let i = 0; performance.now() - from < 1000 * seconds; ++i) {
      if (travels) await page.mouse.move(320 + 150 * Math.sin(i / 40), 180 + 100 * Math.cos(i / 64));
      await sleep(50);
    }
    const [last, to] = await fresh();
    if (travels) await page.mouse.up({button: 'right'});
    const bare = await page.evaluate(() => {
      window.bare.postMessage(0);
      return window.told;
    });
    const ticks = last.tick - first.tick;
    return {ticks_s: ticks / ((to - from) / 1000), frames_s: (last.frames - first.frames) / ((to - from) / 1000),
            frontier_part: (last.frontiers - first.frontiers) / ticks, bare_ticks_s: bare.rate, bare_late_p50_ms: bare.p50_ms,
            bare_late_p99_ms: bare.p99_ms, bare_late_most_ms: bare.most_ms};
  };
  const figures = {moving: await measure(true), resting: await measure(false), problems: page.problems};
  writeFileSync(join(out, 'ticks.json'), JSON.stringify(figures, null, 1));
  assert.deepEqual(page.problems, []);
  const {moving, resting} = figures;
  return `${moving.ticks_s.toFixed(1)} ticks/s while travelling (a bare worker ${moving.bare_ticks_s.toFixed(1)}, late by ` +
         `p99 ${moving.bare_late_p99_ms.toFixed(2)} ms), ${resting.ticks_s.toFixed(1)} at rest (${resting.bare_ticks_s.toFixed(1)}, ` +
         `${resting.bare_late_p99_ms.toFixed(2)} ms); frontier ${(100 * moving.frontier_part).toFixed(3)} % of ticks; ` +
         `${moving.frames_s.toFixed(1)} frames/s`;
});
