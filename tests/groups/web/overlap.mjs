// A screenshot of the page shows the same pixels as `filiform render` from the same place. Writes both pictures to OUT, and
// the part of their pixels that agree to OUT/overlap.json.
//   node overlap.mjs PACKAGES CHROMIUM FILIFORM SET OUT
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {readFileSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {openBrowser, serveSets, waitFor} from '../service/browser.mjs';
import {chromium, filiform, name, opened, out, packages, readPng, run, set, shoot, state, travel} from './travelling.mjs';
import {coverage, overlap} from './picture.mjs';

const kWidth = 1280, kHeight = 720, kSegments = 20000, kZoom_um = 200, kLeast = 0.95;
// Panels cover the rest.
const isScene = (x, y) => y > 200 && y < kHeight - 60 && x < kWidth - 120;

await run(async () => {
  const address = await serveSets(filiform, [set]);
  const page = await travel(await openBrowser(packages, chromium), address, null, {width: kWidth, height: kHeight});
  const {cell, sample} = await state(page);
  await page.goto('about:blank');
  await page.goto(`${address}/travel/${name}?segments=${kSegments}#${cell}:${sample}&zoom=${kZoom_um}`);
  await opened(page);
  await page.keyboard.press('m', {delay: 60});  // the minimap
  await page.mouse.move(kWidth - 150, 100);     // above the rows that are compared: it may have a tooltip
  await waitFor('a complete picture at rest', async () => {
    const now = await state(page);
    return now.complete && !now.moving && now.pending === 0 && now.sample === sample && now.force_N < 0.01;
  }, 60);
  const {segments, zoom_um} = await state(page);
  await shoot(page, 'page.png');
  const drawn = JSON.parse(execFileSync(filiform, [
    'render', set, '-o', join(out, 'render.png'), '--size', `${kWidth}x${kHeight}`, '--at', `${cell}:${sample}`,
    '--zoom', zoom_um, '--highlight', cell, '--segments', kSegments, '--json'
  ]));
  const [seen, wanted] = ['page.png', 'render.png'].map((file) => readPng(readFileSync(join(out, file))));
  const part = overlap(seen, wanted, isScene);
  writeFileSync(join(out, 'overlap.json'), JSON.stringify({overlap: Number(part.toFixed(4)), segments}));
  const shown = coverage(wanted);
  assert.ok(shown > 0.02, `the picture of render shows no scene: ${shown}`);
  assert.deepEqual(page.problems, []);
  assert.ok(part >= kLeast, `${part.toFixed(3)} of the scene's pixels agree; render ${JSON.stringify(drawn)}, page ${segments}`);
  return `${(100 * part).toFixed(1)} % of the scene's pixels agree; ${segments} segments`;
});
