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
  // Sends the axes at 60 reports a second.
  const push = async (axes, seconds) => {
    for (let i = 0; i < 60 * seconds; ++i) await page.evaluate((a) => window.sendAxes(a), axes), await sleep(16);
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
  assert.deepEqual(await page.evaluate(() => window.mouse.sent), [[4, 1]], 'the lamp');
  assert.ok(!(await page.$eval('#spacemouse', (button) => button.checkVisibility())));

  // Moves the hand, which pulls the proxy; and turns the view.
  const begun = await state(page);
  let moved = 0;
  for (const axes of [[300, 0, 0, 0, 0, 0], [0, 0, 300, 0, 0, 0], [-300, 0, 0, 0, 0, 0], [0, 0, -300, 0, 0, 0]]) {
    await push(axes, 1.5);
    moved = Math.max(moved, distance((await state(page)).p_um, begun.p_um));
  }
  assert.ok(moved > 1, `the proxy moved by ${moved} um`);
  await shoot(browser, page, 'spacemouse.png');

  // Reports that mean nothing.
  await sleep(500);
  const calm = await state(page);
  for (const [id, count] of [[1, 0], [1, 3], [2, 5], [99, 12], [3, 0], [0, 6], [23, 200]])
    await page.evaluate((i, n) => window.sendMouse(i, new Array(n).fill(127)), id, count);
  await sleep(1000);
  const undisturbed = await state(page);
  assert.ok(distance(undisturbed.h_um, calm.h_um) < 1e-6, 'reports without meaning moved the hand');
  assert.ok(undisturbed.tick > calm.tick);

  // Unplugged while it moves: the proxy stays, and the mouse replaces it.
  await push([0, 300, 0, 0, 0, 0], 0.5);
  const last = await state(page);
  await page.evaluate(() => window.plug('disconnect'));
  await device('mouse');
  await message('the device is lost; the mouse replaces it');
  await sleep(500);
  const left = await state(page);
  assert.ok(distance(left.p_um, last.p_um) < 20, `the proxy jumped by ${distance(left.p_um, last.p_um)} um`);
  assert.equal(left.cell, last.cell);
  assert.ok(await page.$eval('#spacemouse', (button) => button.checkVisibility()));
  await page.evaluate(() => window.plug('connect'));
  await device('SpaceMouse');
  await message('SpaceMouse is connected again');
  assert.deepEqual(page.problems, []);
  await page.close();

  const other = await travel(browser, address, (it) => it.evaluateOnNewDocument(
    () => Object.defineProperty(navigator, 'hid', {value: undefined})));
  await other.click('#spacemouse');
  await waitFor('the line', async () => (await state(other)).message.startsWith('this browser has no WebHID'), 20);
  assert.deepEqual(other.problems, []);
  return `moved the proxy by ${moved.toFixed(1)} um; unplugged at ${last.cell}, and plugged in again`;
});
