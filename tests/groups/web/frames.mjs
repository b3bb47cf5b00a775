// Time of a frame in motion, 30 000 segments, 640x360, by a software renderer: the page and the native window, by turns in
// the same minute. The simulated hand travels (key t) from the same place. Writes the figures to OUT/frames.json. Needs a
// display and xdotool.
//   node frames.mjs PACKAGES CHROMIUM FILIFORM SET OUT
import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {existsSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {join} from 'node:path';

import {openBrowser, openPage, serveSets, waitFor} from '../service/browser.mjs';
import {chromium, filiform, name, opened, out, packages, pressInWindow, run, set, settled, sleep, state} from './travelling.mjs';

const kSegments = 30000, kZoom_um = 300, kSeconds = 10, kTurns = 3;

// `read()`: the state; frames over kSeconds of motion. Returns ms a frame, and the segments of the last.
async function measure(read) {
  const first = await read(), from = performance.now();
  await sleep(1000 * kSeconds);
  const last = await read(), to = performance.now();
  assert.ok(Math.hypot(...last.p_um.map((x, i) => x - first.p_um[i])) > 1, 'the proxy does not move');
  return {ms: (to - from) / (last.frames - first.frames), segments: last.segments};
}

async function native() {
  const file = join(out, 'native.json');
  rmSync(file, {force: true});
  const child = spawn(filiform, ['view', set, '--size', '640x360', '--segments', kSegments, '--zoom', kZoom_um, '--state', file],
                      {stdio: 'ignore', env: {...process.env, LIBGL_ALWAYS_SOFTWARE: '1', XDG_CONFIG_HOME: join(out, 'config')}});
  const read = async () => {
    for (;;)
      try { return JSON.parse(readFileSync(file, 'utf8')); } catch (partly) { await sleep(20); }
  };
  await waitFor('the window', async () => existsSync(file) && (await read()).open && (await read()).complete, 60);
  await pressInWindow(child.pid, 't');
  await sleep(2000);
  const figures = {...await measure(read), renderer: (await read()).renderer};
  child.kill('SIGINT');
  await new Promise((done) => child.once('exit', done));
  return figures;
}

await run(async () => {
  const address = await serveSets(filiform, [set]);
  const page = await openPage(await openBrowser(packages, chromium));
  await page.setViewport({width: 640, height: 360});
  const inPage = async () => {
    await page.goto('about:blank');
    await page.goto(`${address}/travel/${name}?segments=${kSegments}`);
    await opened(page);
    await settled(page);
    await page.keyboard.press('t', {delay: 60});
    await sleep(2000);
    const figures = {...await measure(() => state(page)), renderer: (await state(page)).renderer};
    await page.goto('about:blank');
    return figures;
  };
  const figures = {native: [], page: []};
  for (let turn = 0; turn < kTurns; ++turn) {
    figures.native.push(await native());
    figures.page.push(await inPage());
  }
  writeFileSync(join(out, 'frames.json'), JSON.stringify(figures, null, 1));
  assert.deepEqual(page.problems, []);
  const list = (rows) => rows.map(({ms}) => ms.toFixed(0)).join(', ');
  const middle = (rows) => rows.map(({ms}) => ms).sort((a, b) => a - b)[rows.length >> 1];
  return `a frame takes ${list(figures.native)} ms in the window (${figures.native[0].segments} segments), ` +
         `${list(figures.page)} ms in the page (${figures.page[0].segments}): ${(middle(figures.page) / middle(figures.native)).toFixed(2)} times`;
});
