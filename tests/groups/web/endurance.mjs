// A long travel by script: pulls, jumps, steps, zooms, overviews, panels and bookmarks, in turn. The memory stays flat, and
// nothing is said on the console. Writes the samples of memory to OUT/endurance.json.
//   node endurance.mjs PACKAGES CHROMIUM FILIFORM SET OUT SECONDS
import assert from 'node:assert/strict';
import {readdirSync, readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {openBrowser, serveSets} from '../service/browser.mjs';
import {chromium, filiform, name, out, packages, run, set, sleep, state, travel} from './travelling.mjs';

const seconds = Number(process.argv[7]);
const kSamples = 12;        // after the first
const kBudget_MiB = 16;     // so that tiles come and go
const kGrowth = 1.1, kSlack_MB = 64;  // what a later sample may have more than the first third: garbage of workers

const round_MB = (bytes) => Math.round(bytes / 1e5) / 10;

// Memory that is resident, of the process of the page, MB: the largest renderer below the process `root`.
function resident_MB(root) {
  const parents = new Map(), renderers = [];
  for (const id of readdirSync('/proc').filter((entry) => /^\d+$/.test(entry))) {
    try {
      const text = readFileSync(`/proc/${id}/status`, 'utf8');
      parents.set(Number(id), Number(/^PPid:\s+(\d+)/m.exec(text)[1]));
      if (readFileSync(`/proc/${id}/cmdline`, 'utf8').includes('--type=renderer'))
        renderers.push([Number(id), Number(/^VmRSS:\s+(\d+)/m.exec(text)[1]) / 1e3 * 1.024]);
    } catch (ended) {  // meanwhile
    }
  }
  const isBelow = (id) => id === root || (parents.has(id) && isBelow(parents.get(id)));
  return Math.round(Math.max(...renderers.filter(([id]) => isBelow(id)).map(([, size]) => size)));
}

await run(async () => {
  const address = await serveSets(filiform, [set]);
  // While the browser's tools watch requests, the page's process keeps up to 200 MB of their answers: nothing watches here.
  const browser = await openBrowser(packages, chromium, {
    targetFilter: (target) => target.type() !== 'worker', protocolTimeout: 600000, networkEnabled: false,
  });
  const page = await travel(browser, address, null, {width: 640, height: 360}, `&budget=${kBudget_MiB}`);
  const {cells} = await (await fetch(`${address}/v1/sets/${name}/cells`)).json();
  const devtools = await page.createCDPSession();
  const samples = [], began = Date.now();
  const elapsed_s = () => (Date.now() - began) / 1000;
  const sample = async () => {
    await devtools.send('HeapProfiler.collectGarbage');
    const {JSHeapUsedSize} = await page.metrics();
    const now = await state(page);
    samples.push({
      at_s: Math.round(elapsed_s()), resident_MB: resident_MB(browser.process().pid), script_MB: round_MB(JSHeapUsedSize),
      program_MB: round_MB(await page.evaluate(() => wasmMemory.buffer.byteLength)), jumps: now.jumps, frames: now.frames,
      ticks: now.tick, problems: page.problems.length,
    });
  };

  let turn = 0;
  const press = async (key, times = 1) => {
    for (let i = 0; i < times; ++i) await page.keyboard.press(key, {delay: 40}), await sleep(200);
  };
  const steps = [
    async () => {  // pull round the proxy
      const [x, y] = (await state(page)).proxy_px ?? [320, 180];
      await page.mouse.move(x, y);
      await page.mouse.down({button: 'right'});
      for (let i = 0; i < 80; ++i) await page.mouse.move(x + 90 * Math.sin(i / 6), y + 60 * Math.cos(i / 9)), await sleep(50);
      await page.mouse.up({button: 'right'});
    },
    async () => {  // jump to a cell
      await press('/');
      await page.keyboard.type(cells[(turn * 7) % cells.length].name, {delay: 40});
      await press('Enter');
      await sleep(1500);
    },
    async () => { await press(['v', 'b', ']', '[', 'r', 'u'][turn % 6], 5); },
    async () => { await press('-', 6), await press('+', 6); },
    async () => { await press('o'), await sleep(2000), await press('o'), await sleep(1000), await press('o'); },
    async () => { await press(['k', 'm', '\\', 'h', 'e'][turn % 5], 2); },
    async () => { await press(';'), await press('a'), await press('Backspace'), await press('\''), await press('a'); },
    async () => {  // turn the view
      await page.mouse.move(600, 300);
      await page.mouse.down();
      for (let i = 0; i < 20; ++i) await page.mouse.move(600 - 10 * i, 300 - 2 * i), await sleep(50);
      await page.mouse.up();
    },
    async () => { await press('c'), await sleep(1000); },
    async () => { await press('t'), await sleep(4000), await press('Escape'); },
  ];
  await sample();
  for (; samples.length <= kSamples; ++turn)
    for (const step of steps) {
      await step();
      if (elapsed_s() < seconds / kSamples * samples.length) continue;
      await sample();
      writeFileSync(join(out, 'endurance.json'), JSON.stringify({samples, problems: page.problems}, null, 1));
    }
  assert.deepEqual(page.problems, []);
  const last = samples.at(-1);
  assert.ok(last.jumps > samples[0].jumps + turn && last.frames > samples[0].frames, JSON.stringify(last));
  const early = samples.slice(0, 1 + kSamples / 3), late = samples.slice(1 + kSamples / 3);
  for (const what of ['resident_MB', 'script_MB', 'program_MB']) {
    const bound = kGrowth * Math.max(...early.map((one) => one[what])) + kSlack_MB;
    const most = Math.max(...late.map((one) => one[what]));
    assert.ok(most <= bound, `${what} grew to ${most}: ${JSON.stringify(samples)}`);
  }
  const range = (what) => `${Math.min(...samples.map((one) => one[what]))} to ${Math.max(...samples.map((one) => one[what]))}`;
  return `${turn} rounds in ${Math.round(elapsed_s())} s, ${last.jumps - samples[0].jumps} jumps; memory, MB: the page's process ` +
         `${range('resident_MB')}, scripts ${range('script_MB')}, the program ${range('program_MB')}; no line on the console`;
});
