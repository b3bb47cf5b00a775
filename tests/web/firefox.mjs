// The page for travel in Firefox, in a window: opens a set, pulls the proxy with the mouse.
//   node firefox.mjs PACKAGES FIREFOX FILIFORM SET OUT
import assert from 'node:assert/strict';

import {openFirefox, serveSets} from '../service/browser.mjs';
import {chromium as firefox, distance, filiform, packages, run, set, shoot, sleep, state, travel} from './travelling.mjs';

await run(async () => {
  const address = await serveSets(filiform, [set]);
  const begun = Date.now();
  const page = await travel(await openFirefox(packages, firefox), address);
  const complete_s = (Date.now() - begun) / 1000;
  const before = await state(page);
  const scene = await shoot(page, 'firefox.png');
  assert.ok(scene > 0.005, `the screenshot shows no scene: ${scene}`);

  const [x, y] = before.proxy_px;
  await page.mouse.move(x, y);
  await page.mouse.down({button: 'right'});
  let moved = 0, force_N = 0;
  for (let turn = 0; turn < 4; ++turn)
    for (let i = 0; i < 20; ++i) {
      const angle = turn * Math.PI / 2;
      await page.mouse.move(x + 6 * i * Math.cos(angle), y + 6 * i * Math.sin(angle));
      await sleep(25);
      const now = await state(page);
      moved = Math.max(moved, distance(now.p_um, before.p_um));
      force_N = Math.max(force_N, now.force_N);
    }
  await shoot(page, 'firefox_pulled.png');
  await page.mouse.up({button: 'right'});
  assert.ok(moved > 1, `the proxy did not move: ${moved} um`);
  assert.ok(force_N > 0, 'no force');
  assert.deepEqual(page.problems, []);
  return `complete picture ${complete_s.toFixed(1)} s after the start of Firefox; ` +
         `${(100 * scene).toFixed(1)} % of the screenshot is scene; pulled ${moved.toFixed(1)} um`;
});
