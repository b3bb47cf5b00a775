// Fingers and a pen on the page, at two pixels of the screen a pixel of CSS.
//   node fingers.mjs PACKAGES CHROMIUM FILIFORM SET OUT
import assert from 'node:assert/strict';

import {openBrowser, serveSets, waitFor} from '../service/browser.mjs';
import {chromium, distance, filiform, packages, run, set, shoot, sleep, state, travel} from './travelling.mjs';

const kRatio = 2, kWidth = 360, kHeight = 240;

await run(async () => {
  const address = await serveSets(filiform, [set]);
  const browser = await openBrowser(packages, chromium);
  const page = await travel(browser, address, null,
                            {width: kWidth, height: kHeight, deviceScaleFactor: kRatio, hasTouch: true, isMobile: false});
  const devtools = await page.createCDPSession();
  const touch = (type, ...points) => devtools.send('Input.dispatchTouchEvent',
    {type, touchPoints: points.map(([x, y], id) => ({x, y, id}))});
  const proxy = async () => (await state(page)).proxy_px.map((x) => x / kRatio);
  const still = async () => {  // frames of a software renderer take long
    const {frames} = await state(page);
    await waitFor('some frames', async () => (await state(page)).frames > frames + 5, 30);
    return state(page);
  };
  const begun = await state(page);
  assert.deepEqual([begun.width, begun.height], [kWidth * kRatio, kHeight * kRatio]);

  // One finger from the proxy pulls.
  const [x, y] = await proxy();
  await touch('touchStart', [x + 4, y - 4]);
  await sleep(600);
  let moved = 0;
  for (let i = 0; i <= 16; ++i) {
    const angle = i * Math.PI / 8;
    await touch('touchMove', [x + 60 * Math.sin(angle), y - 60 * Math.cos(angle)]);
    await sleep(150);
    moved = Math.max(moved, distance((await state(page)).p_um, begun.p_um));
  }
  const pulled = await state(page);
  await shoot(page, 'finger.png');
  await touch('touchEnd');
  assert.ok(moved > 1, `one finger moved the proxy by ${moved} um`);
  assert.ok(pulled.force_N > 0);
  await waitFor('no force', async () => (await state(page)).force_N < 0.01, 20);

  // One finger elsewhere turns the view.
  const calm = await still();
  await touch('touchStart', [330, 220]);
  for (let i = 1; i <= 5; ++i) await touch('touchMove', [330 - 16 * i, 220]), await sleep(50);
  await touch('touchEnd');
  await waitFor('the turn', async () => distance((await state(page)).rotation, calm.rotation) > 0.05, 20);
  assert.equal((await state(page)).zoom_um, calm.zoom_um);

  // Two fingers move and zoom.
  const near = await still();
  await touch('touchStart', [120, 100]);
  await touch('touchStart', [120, 100], [200, 160]);
  await sleep(300);
  for (let i = 1; i <= 5; ++i)
    await touch('touchMove', [120 - 8 * i, 100 - 12 * i], [200 + 24 * i, 160 + 12 * i]), await sleep(100);
  await touch('touchEnd');
  const zoomed = await still();
  assert.ok(Math.abs(near.zoom_um / zoomed.zoom_um - 3) < 0.01, `zoom ${zoomed.zoom_um} um, was ${near.zoom_um}`);
  assert.ok(distance(zoomed.shift, near.shift) > 0, `no shift: ${zoomed.shift}`);
  assert.deepEqual(zoomed.rotation, near.rotation);
  await shoot(page, 'pinch.png');

  // A notch of the wheel, and a part of a notch as a touch pad sends it.
  for (const [deltaY, factor] of [[100, 1.2], [-100, 1 / 1.2], [25, 1.2 ** 0.25]]) {
    const {zoom_um} = await still();
    await page.mouse.wheel({deltaY: kRatio * deltaY});  // which the browser divides again
    const now = await still();
    assert.ok(Math.abs(now.zoom_um / zoom_um / factor - 1) < 1e-3, `wheel ${deltaY}: ${zoom_um} to ${now.zoom_um} um`);
  }

  // A long press pulls from anywhere.
  await touch('touchStart', [240, 190]);
  await waitFor('the pull of a long press', async () => (await state(page)).force_N > 0.05, 20);
  await touch('touchEnd');
  await waitFor('the end of the pull', async () => (await state(page)).force_N < 0.01, 20);

  // A pen is a mouse: its side button pulls.
  const pen = (kind, at, buttons) => page.evaluate((k, [px, py], down) => {
    document.getElementById('canvas').dispatchEvent(new PointerEvent(k, {
      pointerType: 'pen', pointerId: 77, clientX: px, clientY: py, button: k === 'pointermove' ? -1 : 2, buttons: down,
      bubbles: true, cancelable: true}));
  }, kind, at, buttons);
  await pen('pointerdown', [60, 200], 2);
  await pen('pointermove', [50, 210], 2);
  await waitFor('the pull of a pen', async () => (await state(page)).force_N > 0.05, 20);
  await pen('pointerup', [50, 210], 0);
  await waitFor('the end of the pull', async () => (await state(page)).force_N < 0.01, 20);
  assert.deepEqual(page.problems, []);
  return `one finger pulled ${moved.toFixed(1)} um; two zoomed by ${(near.zoom_um / zoomed.zoom_um).toFixed(2)}`;
});
