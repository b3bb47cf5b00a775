// The page for travel in Firefox, in a window: opens a set, pulls the proxy with the mouse, searches, sets a bookmark.
//   node firefox.mjs PACKAGES FIREFOX FILIFORM SET OUT
import assert from 'node:assert/strict';

import {openFirefox, serveSets} from '../service/browser.mjs';
import {chromium as firefox, filiform, packages, pull, run, searchAndBookmark, set, shoot, state, travel} from './travelling.mjs';

await run(async () => {
  const address = await serveSets(filiform, [set]);
  const begun = Date.now();
  const page = await travel(await openFirefox(packages, firefox), address);
  const complete_s = (Date.now() - begun) / 1000;
  const scene = await shoot(page, 'firefox.png');
  assert.ok(scene > 0.005, `the screenshot shows no scene: ${scene}`);

  const moved_um = await pull(page, 'firefox_pulled.png');
  await searchAndBookmark(page, (await state(page)).cell, 'firefox_');
  assert.deepEqual(page.problems, []);
  return `complete picture ${complete_s.toFixed(1)} s after the start of Firefox; ` +
         `${(100 * scene).toFixed(1)} % of the screenshot is scene; pulled ${moved_um.toFixed(1)} um`;
});
