// What the page keeps in the browser: settings and bookmarks, and what it says if they are damaged.
//   node kept.mjs PACKAGES CHROMIUM FILIFORM SET OUT
import assert from 'node:assert/strict';

import {openBrowser, serveSets, waitFor} from '../service/browser.mjs';
import {chromium, filiform, opened, packages, run, set, state, travel} from './travelling.mjs';

const kSettings = 'filiform:/config/filiform/view.json';
const kept = (page) => page.evaluate((key) => localStorage.getItem(key), kSettings);

await run(async () => {
  const address = await serveSets(filiform, [set]);
  const page = await travel(await openBrowser(packages, chromium), address);
  assert.equal((await state(page)).orthographic, false);
  await page.keyboard.type('a');
  await page.keyboard.type('g', {delay: 60});
  await page.keyboard.type(';', {delay: 60});
  await page.keyboard.type('z', {delay: 60});
  await waitFor('the settings', async () => JSON.parse(await kept(page) ?? '{}').orange_blue === true, 20);
  await waitFor('the bookmark', async () => (await state(page)).bookmarks.includes('z'), 20);
  await waitFor('the kept bookmark', () => page.evaluate(
    () => Object.entries(localStorage).some(([key, text]) => key.includes('/places/') && text.includes('"z"'))), 20);

  await page.reload();
  const again = await opened(page);
  assert.equal(again.orthographic, true);
  assert.equal(again.orange_blue, true);
  assert.deepEqual(again.bookmarks, ['z']);

  // What is no JSON is said in one line, a value out of range is not taken.
  for (const [text, told] of [['{"orthographic": tr', /not a settings file.*using the defaults/], ['{"stereo": "odd", "separation": 99}', null]]) {
    await page.evaluate((key, damaged) => {
      window.addEventListener('pagehide', () => localStorage.setItem(key, damaged));
    }, kSettings, text);
    const before = (await state(page)).frames;
    await page.reload();
    await waitFor('the damaged file', async () => (await state(page))?.frames > 0 && (await state(page)).open, 60);
    const now = await opened(page);
    assert.equal(now.orthographic, false, text);
    assert.equal(now.stereo, 'mono', text);
    assert.equal(now.separation, 1, text);
    if (told) assert.match(now.message, told);
    assert.ok(before > 0);
  }
  assert.deepEqual(page.problems, []);
  return 'settings and bookmarks are there after a reload; a damaged file is said and ignored';
});
