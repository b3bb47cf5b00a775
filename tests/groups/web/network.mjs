// The page while its network is slow or lost: it says so, waits, and goes on.
//   node network.mjs PACKAGES CHROMIUM FILIFORM SET OUT
import assert from 'node:assert/strict';

import {openBrowser, startServer, waitFor} from '../service/browser.mjs';
import {chromium, filiform, packages, run, set, shoot, state, travel} from './travelling.mjs';

await run(async () => {
  let server = await startServer(filiform, [set]);
  const browser = await openBrowser(packages, chromium);
  const page = await travel(browser, server.address);
  const told = async () => (await state(page)).network;
  assert.equal(await told(), '');
  let answers = 0;
  page.on('response', (response) => { answers += response.url().includes('/files/') ? 1 : 0; });
  const zoomOut = async (times) => {
    for (let i = 0; i < times; ++i) await page.keyboard.press('-', {delay: 40});
  };
  const complete = async () => {
    const now = await state(page);
    return now.complete && now.network === '' && now.failures === 0;
  };

  // A server that is silent.
  server.child.kill('SIGSTOP');
  await waitFor('the word that the network is slow', async () => {
    if (!/^the network is slow: no answer for \d+ s/.test(await told())) return zoomOut(1);  // until a tile is missing
    return true;
  }, 30);
  await shoot(page, 'slow.png');
  server.child.kill('SIGCONT');
  await waitFor('a complete picture after the silence', complete, 60);

  // A server that is away.
  const before = await state(page);
  await server.end('SIGKILL');
  const port = new URL(server.address).port;
  await zoomOut(3);
  await waitFor('the word that the network is lost', async () => /^the network is lost: no answer for \d+ s/.test(await told()), 30);
  await waitFor('the list of what is missing', async () => (await state(page)).failures > 0, 30);
  const lost = await state(page);
  await shoot(page, 'lost.png');
  assert.deepEqual([lost.cell, lost.sample], [before.cell, before.sample]);
  if (lost.messages > before.messages) assert.doesNotMatch(lost.message, /cannot be read/);

  const until = answers;
  server = await startServer(filiform, [set], `127.0.0.1:${port}`);
  await waitFor('a complete picture', complete, 60);
  await shoot(page, 'found.png');
  const found = await state(page);
  assert.ok(answers > until, 'no tile has come');
  assert.deepEqual([found.cell, found.sample], [before.cell, before.sample]);
  assert.ok(found.segments > 0 && found.tick > lost.tick);
  // The browser's own lines on requests that failed.
  const others = page.problems.filter((line) => !/ERR_(CONNECTION|EMPTY_RESPONSE)|failed: .*\/files\//.test(line));
  assert.deepEqual(others, []);
  return `${lost.failures} parts missing while lost; ${answers - until} answers afterwards`;
});
