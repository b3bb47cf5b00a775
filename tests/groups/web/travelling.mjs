// What the tests of the page share: a set that is served, a page that travels, its state and its pictures.
import assert from 'node:assert/strict';
import {execFileSync, spawn} from 'node:child_process';
import {createRequire} from 'node:module';
import {basename, join} from 'node:path';
import {createInterface} from 'node:readline';

import {atEnd, endAll, openPage, waitFor} from '../service/browser.mjs';
import {coverage} from './picture.mjs';

export const [packages, chromium, filiform, set, out] = process.argv.slice(2);
export const name = basename(set, '.fil');
export const {sync: {read: readPng}} = createRequire(join(packages, 'package.json'))('pngjs').PNG;

export const state = (page) => page.evaluate(() => window.filiformState ?? null);
export const distance = (a, b) => Math.hypot(...a.map((x, i) => x - b[i]));
export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

// Takes a screenshot. Returns the part of its pixels that show neurites.
export async function shoot(page, file) {
  const picture = await page.screenshot({path: join(out, file)});
  return coverage(readPng(Buffer.from(picture)));
}

export async function opened(page) {
  let last = null;
  try {
    await waitFor('the first picture', async () => {
      last = await state(page);
      return last?.open && last.segments > 0 && last.tick > 0;
    }, 60);
  } catch (error) {
    const note = await page.evaluate(() => document.getElementById('note')?.textContent);
    error.message += `; page: ${note}; ${page.problems.join('; ')}; state ${JSON.stringify(last)}`;
    throw error;
  }
  if (last.overview) {  // as at the first start
    await page.keyboard.press('o', {delay: 60});
    await waitFor('the workspace', async () => !(last = await state(page)).overview, 20);
  }
  return last;
}

// The state once the picture is complete and the cell has a name.
export async function settled(page) {
  let now = null;
  await waitFor('a complete picture and the name of the cell', async () => {
    now = await state(page);
    return now.complete && now.cell;
  });
  return now;
}

// Pulls the proxy to and fro with the mouse, and takes a screenshot before it lets go. Returns the most that the proxy
// moved, um. Fails if it did not move, or without a force.
export async function pull(page, file) {
  const before = await state(page);
  const [x, y] = before.proxy_px;
  await page.mouse.move(x, y);
  await page.mouse.down({button: 'right'});
  let moved_um = 0, force_N = 0;
  for (let turn = 0; turn < 4; ++turn)
    for (let i = 0; i < 20; ++i) {
      const angle = turn * Math.PI / 2;
      await page.mouse.move(x + 6 * i * Math.cos(angle), y + 6 * i * Math.sin(angle));
      await sleep(25);
      const now = await state(page);
      moved_um = Math.max(moved_um, distance(now.p_um, before.p_um));
      force_N = Math.max(force_N, now.force_N);
    }
  await shoot(page, file);
  await page.mouse.up({button: 'right'});
  assert.ok(moved_um > 1, `the proxy did not move: ${moved_um} um`);
  assert.ok(force_N > 0, 'no force');
  return moved_um;
}

// Goes to a cell by its name, sets a bookmark `z` there, and takes a screenshot after each: PREFIXsearched.png and
// PREFIXbookmarked.png.
export async function searchAndBookmark(page, cell, prefix) {
  const {jumps} = await state(page);
  await page.keyboard.type('/');
  await waitFor('the search', async () => (await state(page)).search, 10);
  await page.keyboard.type(cell, {delay: 60});
  await page.keyboard.press('Enter', {delay: 60});
  await waitFor('the jump', async () => (await state(page)).jumps > jumps, 20);
  await settled(page);
  await shoot(page, `${prefix}searched.png`);
  await page.keyboard.type(';', {delay: 60});
  await page.keyboard.type('z', {delay: 60});
  await waitFor('the bookmark', async () => (await state(page)).bookmarks.includes('z'), 20);
  await shoot(page, `${prefix}bookmarked.png`);
}

// A page of this size on the set; `prepare(page)` runs before anything is loaded. `more` is added to the address.
export async function travel(browser, address, prepare, viewport = {width: 640, height: 360}, more = '') {
  const page = await openPage(browser);
  await page.setViewport(viewport);
  await prepare?.(page);
  await page.goto(`${address}/travel/${name}?segments=20000${more}`);  // for a software renderer
  await opened(page);
  await settled(page);
  return page;
}

// Presses a key in the window of a program, once it has one.
export async function pressInWindow(pid, key) {
  let windows = [];
  await waitFor('a window', async () => {
    try {
      windows = execFileSync('xdotool', ['search', '--onlyvisible', '--pid', pid], {stdio: ['ignore', 'pipe', 'ignore']})
                  .toString().trim().split('\n');
    } catch (none) {
      return false;
    }
    return true;
  }, 30);
  execFileSync('xdotool', ['windowfocus', '--sync', windows.at(-1), 'key', '--clearmodifiers', key]);
}

// The address of a server behind a wire with this round trip and this rate, bytes a second.
export async function slowWire(program, address, delay_ms, rate) {
  const child = spawn(program, [new URL(address).host, '--delay', delay_ms, '--rate', rate]);
  atEnd(() => child.kill());
  const port = await new Promise((done, fail) => {
    createInterface({input: child.stdout}).once('line', done);
    child.once('exit', () => fail(new Error('slow_wire ended')));
  });
  return `http://127.0.0.1:${/\d+/.exec(port)[0]}`;
}

// Runs a test, prints what it returns, and ends all that it started.
export async function run(test) {
  try {
    console.log(await test());
  } catch (error) {
    console.error(error);  // now, since an ending may fail too
    process.exitCode = 1;
  } finally {
    await endAll();
  }
}
