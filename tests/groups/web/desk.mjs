// A desk beside the page: `filiform view SET --follow` shows its proxy, which moves, is lost, and comes back; so does the
// network. Needs a display for the desk's window, and xdotool.
//   node desk.mjs PACKAGES CHROMIUM FILIFORM SET OUT OTHER_SET
import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {readFileSync} from 'node:fs';
import {join} from 'node:path';

import {atEnd, openBrowser, startServer, waitFor} from '../service/browser.mjs';
import {
  chromium, distance, filiform, name, out, packages, pressInWindow, readPng, run, set, sleep, state, travel
} from './travelling.mjs';

const other = process.argv[7];
const kViolet = [215, 140, 255];

// A window. `told`: its lines so far; `travel()` starts its simulated hand. `end(signal)` returns its exit code.
function startDesk(address, scene = set) {
  const child = spawn(filiform, [
    'view', scene, '--follow', address, '--size', '320x240', '--segments', '2000', '--state', join(out, 'desk.json')
  ], {stdio: ['ignore', 'ignore', 'pipe'],
      env: {...process.env, LIBGL_ALWAYS_SOFTWARE: '1', XDG_CONFIG_HOME: join(out, 'config')}});
  const desk = {told: '', travel: () => pressInWindow(child.pid, 't')};
  child.stderr.on('data', (bytes) => { desk.told += bytes; });
  const ended = new Promise((done) => child.once('exit', (code) => done(code)));
  desk.end = (signal) => {
    if (signal) child.kill(signal);
    return ended;
  };
  atEnd(() => desk.end('SIGKILL'));
  return desk;
}

const ticksOf = () => JSON.parse(readFileSync(join(out, 'desk.json'), 'utf8')).tick;

await run(async () => {
  let server = await startServer(filiform, [set]);
  const browser = await openBrowser(packages, chromium);
  const page = await travel(browser, server.address, null, {width: 640, height: 480}, '&desk=anna');
  const message = (what) => waitFor(`the line ${what}`, async () => what.test((await state(page)).message), 30);
  const here = () => waitFor('the desk', async () => (await state(page)).companion, 60);
  const gone = () => waitFor('the end of the desk', async () => !(await state(page)).companion, 30);
  const place = async () => (await state(page)).companion;
  const button = () => page.$eval('#desk', (it) => it.checkVisibility());
  await message(/^waiting for: filiform view SET --follow ws:/);
  const address = (await state(page)).message.split(' ').at(-1);
  assert.equal(address, `${server.address.replace('http:', 'ws:')}/v1/sets/${name}/desks/anna`);
  assert.equal((await state(page)).companion, undefined);
  assert.ok(!(await button()));

  // Comes, and moves; the view goes along.
  let desk = startDesk(address);
  await here();
  await message(/^the desk anna is here$/);
  const begun = await place();
  await desk.travel();
  assert.equal(begun.name, 'anna');
  let moved_um = 0, updates = 0;
  for (let last = begun, i = 0; i < 40 || moved_um < 1; ++i) {
    await sleep(100);
    const now = await place();
    updates += distance(now.p_um, last.p_um) > 0 ? 1 : 0;
    moved_um = Math.max(moved_um, distance(now.p_um, begun.p_um));
    last = now;
    assert.ok(i < 300, `the desk's proxy does not move: ${moved_um} um`);
  }
  await waitFor('the proxy in the picture, beside the panels', async () => {
    const {px} = await place();
    return px && px[0] > 0 && px[0] < 640 && px[1] > 135 && px[1] < 370;
  }, 60);
  const picture = readPng(Buffer.from(await page.screenshot({path: join(out, 'desk.png')})));
  let violet = 0;
  for (let at = 0; at < picture.data.length; at += 4)
    if (kViolet.every((value, i) => Math.abs(picture.data[at + i] - value) < 24)) ++violet;
  assert.ok(violet > 20, `${violet} pixels show the desk's proxy`);

  // The user looks elsewhere, and goes along again.
  await page.mouse.click(320, 180);
  await waitFor('the own view', async () => !(await place()).along && await button(), 20);
  await page.screenshot({path: join(out, 'desk_apart.png')});
  await page.click('#desk');
  await waitFor('the view of the desk', async () => (await place()).along && !(await button()), 20);

  // The network is lost. The desk's loop goes on.
  const port = new URL(server.address).port;
  await server.end('SIGKILL');
  await gone();
  await waitFor('the line of the desk', () => desk.told.includes('trying again'), 30);
  const [ticks, from] = [ticksOf(), Date.now()];
  await sleep(3000);
  const rate = (ticksOf() - ticks) / ((Date.now() - from) / 1000);
  assert.ok(rate > 700, `${rate} ticks a second at the desk without a network`);
  server = await startServer(filiform, [set], `127.0.0.1:${port}`);
  await here();
  assert.match(desk.told, /shown again at/);

  // The desk dies, and comes back.
  await desk.end('SIGKILL');
  await gone();
  await message(/^the desk anna is gone$/);
  desk = startDesk(address);
  await here();
  await message(/^the desk anna is here$/);

  // It is silent.
  await desk.end('SIGINT');
  await gone();

  // Another set, and wrong addresses: one line, and an exit code.
  for (const [scene, where, line] of [
    [other, address, /the server has revision r-\w+, not r-\w+; open the same set on both sides/],
    [set, address.replace(name, 'nothing'), /no set 'nothing'/],
    [set, address.replace('ws:', 'http:'), /give ws:\/\/HOST:PORT/],
  ]) {
    const wrong = startDesk(where, scene);
    assert.equal(await wrong.end(), 2, wrong.told);
    assert.match(wrong.told, line);
  }
  const others = page.problems.filter((text) => !/ERR_(CONNECTION|EMPTY_RESPONSE)|failed: |WebSocket connection/.test(text));
  assert.deepEqual(others, []);
  return `the desk's proxy moved by ${moved_um.toFixed(1)} um in the page, ${updates} times in 4 s; ` +
         `${rate.toFixed(0)} ticks/s at the desk without a network`;
});
