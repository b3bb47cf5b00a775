// Figures of the page over a slow wire: 20 ms, 20 Mbit/s. Writes them to OUT/figures.json.
//   node measure.mjs PACKAGES CHROMIUM FILIFORM SET OUT SLOW_WIRE
import {writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {openBrowser, openPage, serveSets, waitFor} from '../service/browser.mjs';
import {chromium, filiform, name, out, packages, run, set, sleep, slowWire, state} from './travelling.mjs';

const kDelay_ms = 20, kRate = 20e6 / 8, kSegments = 30000;  // the rate in bytes a second

// In the page: when the program first drew segments and first had a proxy, s after the link was opened; calls of OpenGL.
function watch() {
  window.seen = {calls: [], call: 0, by_name: {}, most: 0};
  for (const key of Object.getOwnPropertyNames(WebGL2RenderingContext.prototype)) {
    const about = Object.getOwnPropertyDescriptor(WebGL2RenderingContext.prototype, key);
    if (typeof about.value !== 'function') continue;
    WebGL2RenderingContext.prototype[key] = function(...words) {
      ++window.seen.call;
      window.seen.by_name[key] = (window.seen.by_name[key] ?? 0) + 1;
      return about.value.apply(this, words);
    };
  }
  const frame = () => {
    requestAnimationFrame(frame);
    window.seen.calls.push(window.seen.call);
    if (window.seen.call > window.seen.most)
      Object.assign(window.seen, {most: window.seen.call, busiest: window.seen.by_name});
    Object.assign(window.seen, {call: 0, by_name: {}});
    if ((window.seen.proxy_s && window.seen.picture_s) || typeof Module === 'undefined' || !Module.calledRun) return;
    const now = readState();
    if (now?.open && now.segments > 0) window.seen.picture_s ??= performance.now() / 1000;
    if (now?.open && now.tick > 0 && now.mode === 'constrained' && now.proxy_px)
      window.seen.proxy_s ??= performance.now() / 1000;
    window.seen.program_s ??= performance.now() / 1000;
  };
  requestAnimationFrame(frame);
}

await run(async () => {
  const address = await slowWire(process.argv[7], await serveSets(filiform, [set]), kDelay_ms, kRate);
  const browser = await openBrowser(packages, chromium);
  const page = await openPage(browser);
  await page.setViewport({width: 640, height: 360});
  await page.evaluateOnNewDocument(watch);
  const requests = [];
  let page_bytes = 0, set_bytes = 0, begun = 0;
  page.on('response', (response) => {
    const bytes = Number(response.headers()['content-length'] ?? 0), path = new URL(response.url()).pathname;
    if (path.includes('/files/')) set_bytes += bytes;
    else page_bytes += bytes;
    requests.push(`${((Date.now() - begun) / 1000).toFixed(2)} s ${path.split('/').slice(-3).join('/')} ${bytes}`);
  });
  begun = Date.now();
  await page.goto(`${address}/travel/${name}?segments=${kSegments}`, {waitUntil: 'domcontentloaded', timeout: 60000});
  await waitFor('a picture and a proxy', () => page.evaluate(() => window.seen.proxy_s && window.seen.picture_s), 60);
  const before = {set_bytes, page_bytes};
  const {program_s, picture_s, proxy_s} = await page.evaluate(() => window.seen);
  await waitFor('a complete picture', async () => (await state(page)).complete, 60);
  await sleep(1000);
  // Pulls, so that each frame is drawn anew.
  const [x, y] = (await state(page)).proxy_px;
  await page.mouse.move(x, y);
  await page.mouse.down({button: 'right'});
  await page.evaluate(() => { Object.assign(window.seen, {calls: [], most: 0}); });
  const first = await state(page), from = Date.now();
  for (let i = 0; i < 200; ++i) {
    await page.mouse.move(x + 60 * Math.sin(i / 8), y + 40 * Math.cos(i / 8));
    await sleep(50);
  }
  const last = await state(page);
  const rate = (last.tick - first.tick) / ((Date.now() - from) / 1000);
  const calls = (await page.evaluate(() => window.seen.calls)).sort((a, b) => a - b);
  const busiest = await page.evaluate(() => window.seen.busiest);
  await page.mouse.up({button: 'right'});
  const round = (value, digits = 2) => Number(value.toFixed(digits));
  const figures = {
    program_s: round(program_s), picture_s: round(picture_s), proxy_s: round(proxy_s),
    set_MB: round(before.set_bytes / 1e6), loaded_KB: round(before.page_bytes / 1e3, 0), ticks_s: round(rate, 0),
    late_ticks: last.missed_deadlines, compute_p99_us: last.compute_p99_us, frame_ms: round(last.frame_ms, 1),
    segments: last.segments, calls_most: calls.at(-1), calls_median: calls[calls.length >> 1],
    calls_by_name: Object.fromEntries(Object.entries(busiest ?? {}).sort(([, a], [, b]) => b - a)), frontiers: last.frontiers,
    problems: page.problems, requests,
  };
  writeFileSync(join(out, 'figures.json'), JSON.stringify(figures, null, 1));
  return `first picture ${figures.picture_s} s, proxy ${figures.proxy_s} s after the link; ${figures.set_MB} MB of tiles; ` +
         `${figures.calls_most} calls a frame; frame ${figures.frame_ms} ms; ${figures.ticks_s} ticks/s`;
});
