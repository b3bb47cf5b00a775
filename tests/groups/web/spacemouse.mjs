// A SpaceMouse by WebHID, which a stand-in of navigator.hid sends: chosen, moved, disturbed, unplugged, plugged in again.
//   node spacemouse.mjs PACKAGES CHROMIUM FILIFORM SET OUT
import assert from 'node:assert/strict';

import {openBrowser, serveSets, waitFor} from '../service/browser.mjs';
import {chromium, distance, filiform, packages, run, set, shoot, sleep, state, travel} from './travelling.mjs';

function standIn() {
  const device = Object.assign(new EventTarget(), {
    vendorId: 0x256f, productId: 0xc62e, productName: 'SpaceMouse Wireless', opened: false,
    collections: [{usagePage: 1, usage: 8}], sent: [],
    open: async () => { device.opened = true; },
    sendReport: async (id, data) => { device.sent.push([id, ...data]); },
  });
  const hid = Object.assign(new EventTarget(), {
    getDevices: async () => [],
    requestDevice: async ({filters}) => {
      hid.filters = filters;
      return hid.offers ? [device] : [];
    },
    offers: false,
  });
  Object.defineProperty(navigator, 'hid', {value: hid});
  window.mouse = device;
  // A report whose id is `id`.
  window.sendMouse = (id, bytes) => device.dispatchEvent(Object.assign(
    new Event('inputreport'), {reportId: id, data: new DataView(new Uint8Array(bytes).buffer)}));
  // The axes x, y, z, then the turns, -350 .. 350.
  window.sendAxes = (axes) => window.sendMouse(1, axes.flatMap((value) => [value & 255, value >> 8 & 255]));
  window.plug = (kind) => hid.dispatchEvent(Object.assign(new Event(kind), {device}));
}

await run(async () => {
  const address = await serveSets(filiform, [set]);
  const browser = await openBrowser(packages, chromium);
  const page = await travel(browser, address, (it) => it.evaluateOnNewDocument(standIn));
  const message = async (what) => waitFor(what, async () => (await state(page)).message === what, 20);
  const device = async (what) => waitFor(`the device ${what}`, async () => (await state(page)).device.includes(what), 20);
  // The page itself sends the axes 60 times a second, until other axes or null come.
  const push = (axes) => page.evaluate((a) => {
    clearInterval(window.pushing);
    if (a) window.pushing = setInterval(() => window.sendAxes(a), 16);
  }, axes);
  // The state may be old by a frame and half a second: waits for states until the hand is at the proxy, and neither moves.
  const atRest = async (about) => {
    let last = await state(page);
    await waitFor(`rest ${about}`, async () => {
      const now = await state(page);
      if (now.tick < last.tick + 300) return false;
      const moved = distance(now.h_um, last.h_um) + distance(now.h_um, now.p_um);
      last = now;
      return moved < 1e-3;
    }, 30);
    return last;
  };
  const shown = await page.$eval('#spacemouse', (button) => button.checkVisibility());
  assert.ok(shown, 'no button');
  await page.click('#spacemouse');
  await message('no 3D mouse was chosen');
  await page.evaluate(() => { navigator.hid.offers = true; });
  await page.click('#spacemouse');
  await device('SpaceMouse');
  await message('SpaceMouse is connected');
  assert.deepEqual(await page.evaluate(() => navigator.hid.filters.map((one) => one.vendorId)), [0x256f, 0x046d]);
  await waitFor('the lamp', () => page.evaluate(() => JSON.stringify(window.mouse.sent) === '[[4,1]]'), 20);
  assert.ok(!(await page.$eval('#spacemouse', (button) => button.checkVisibility())));

  // Moves the hand, which pulls the proxy; and turns the view.
  const begun = await state(page);
  let moved = 0;
  for (const axes of [[300, 0, 0, 0, 0, 0], [0, 0, 300, 0, 0, 0], [-300, 0, 0, 0, 0, 0], [0, 0, -300, 0, 0, 0]]) {
    await push(axes);
    for (let i = 0; i < 15; ++i) {
      await sleep(100);
      moved = Math.max(moved, distance((await state(page)).p_um, begun.p_um));
    }
  }
  await push(null);
  assert.ok(moved > 1, `the proxy moved by ${moved} um`);
  await shoot(page, 'spacemouse.png');

  // Reports that mean nothing.
  const calm = await atRest('after the motion');
  for (const [id, count] of [[1, 0], [1, 3], [2, 5], [99, 12], [3, 0], [0, 6], [23, 200]])
    await page.evaluate((i, n) => window.sendMouse(i, new Array(n).fill(127)), id, count);
  await waitFor('the next ticks', async () => (await state(page)).tick > calm.tick + 1000, 20);
  const undisturbed = await atRest('after reports without meaning');
  const disturbed_um = distance(undisturbed.h_um, calm.h_um);
  assert.ok(disturbed_um < 0.01, `reports without meaning moved the hand by ${disturbed_um} um`);

  // Unplugged at rest: the proxy stays, and the mouse replaces the device.
  const lost = async () => {
    await page.evaluate(() => window.plug('disconnect'));
    await device('mouse');
    await message('the device is lost; the mouse replaces it');
    assert.ok(await page.$eval('#spacemouse', (button) => button.checkVisibility()));
  };
  const again = async () => {
    await page.evaluate(() => window.plug('connect'));
    await device('SpaceMouse');
    await message('SpaceMouse is connected again');
  };
  await lost();
  const left = await atRest('after the loss');
  assert.ok(distance(left.p_um, undisturbed.p_um) < 20, `the proxy jumped by ${distance(left.p_um, undisturbed.p_um)} um`);
  assert.equal(left.cell, undisturbed.cell);
  await again();

  // Unplugged while it moves: the hand stops.
  const before = await state(page);
  await push([0, 300, 0, 0, 0, 0]);
  await waitFor('the push', async () => distance((await state(page)).h_um, before.h_um) > 1, 20);
  await lost();
  await atRest('after the loss in motion');
  await push(null);
  await again();
  assert.deepEqual(page.problems, []);
  await page.close();

  const other = await travel(browser, address, (it) => it.evaluateOnNewDocument(
    () => Object.defineProperty(navigator, 'hid', {value: undefined})));
  await other.click('#spacemouse');
  await waitFor('the line', async () => (await state(other)).message.startsWith('this browser has no WebHID'), 20);
  assert.deepEqual(other.problems, []);
  return `moved the proxy by ${moved.toFixed(1)} um; unplugged at ${left.cell}, and plugged in again`;
});
