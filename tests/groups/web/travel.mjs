// The page for travel in Chromium: opens a set, pulls the proxy with the mouse, goes to a place, loads the page again.
//   node travel.mjs PACKAGES CHROMIUM FILIFORM SET OUT
// PACKAGES: where tools/setup --web put the npm packages. OUT: a folder for screenshots. FILIFORM_WEB: the page's files.
import assert from 'node:assert/strict';
import {writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {openBrowser, openPage, serveSets, waitFor} from '../service/browser.mjs';
import {
  chromium, filiform, name, opened, out, packages, pull, run, searchAndBookmark, set, settled, shoot, sleep, state
} from './travelling.mjs';

async function main() {
  const address = await serveSets(filiform, [set]);
  const browser = await openBrowser(packages, chromium);
  const page = await openPage(browser);
  await page.setViewport({width: 640, height: 360});
  let bytes = 0, requests = 0;
  page.on('response', (response) => {
    if (!response.url().includes('/files/')) return;
    ++requests;
    bytes += Number(response.headers()['content-length'] ?? 0);
  });
  const begun = Date.now();
  const program = page.waitForResponse((response) => response.url().includes('/filiform.wasm'), {timeout: 60000});
  const answer = await page.goto(`${address}/travel/${name}`);
  assert.equal(answer.headers()['cross-origin-embedder-policy'], 'require-corp');
  assert.equal((await program).headers()['content-encoding'], 'gzip');
  await opened(page);
  const opened_s = (Date.now() - begun) / 1000;
  const before = await settled(page);
  const scene = await shoot(page, 'opened.png');
  assert.ok(scene > 0.005, `the screenshot shows no scene: ${scene}`);

  const moved_um = await pull(page, 'pulled.png');

  // Ticks over ten seconds, between two writes of the state.
  const written = async () => {
    const {tick} = await state(page);
    await waitFor('the next state', async () => (await state(page)).tick !== tick, 20);
    return [await state(page), Date.now()];
  };
  const [first, from] = await written();
  await sleep(10000);
  const [last, to] = await written();
  const rate = (last.tick - first.tick) / ((to - from) / 1000);

  await searchAndBookmark(page, before.cell, '');

  // A link opens the same place.
  await waitFor('the address', async () => (await page.evaluate(() => location.hash)).length > 1, 10);
  await sleep(1500);
  const there = await state(page), link = page.url();
  const again = await openPage(browser);
  await again.setViewport({width: 640, height: 360});
  await page.close();
  await again.goto(link);
  await opened(again);
  await waitFor('the same sample', async () => (await state(again)).sample === there.sample, 20);
  const back = await state(again);
  assert.equal(back.cell, there.cell);
  assert.ok(Math.abs(back.zoom_um / there.zoom_um - 1) < 1e-3, `zoom ${back.zoom_um}, was ${there.zoom_um}`);
  assert.deepEqual(page.problems, []);
  assert.deepEqual(again.problems, []);
  writeFileSync(join(out, 'state.json'), JSON.stringify(last, null, 1));
  return `first picture ${opened_s.toFixed(1)} s, ${requests} requests, ${(bytes / 1e6).toFixed(2)} MB; ` +
         `${(100 * scene).toFixed(1)} % of the screenshot is scene; pulled ${moved_um.toFixed(1)} um; ` +
         `${rate.toFixed(0)} ticks/s; frame ${last.frame_ms.toFixed(0)} ms`;
}

await run(main);
