// The page of the service and the door `precomputed` with the released Neuroglancer, in Chromium.
//   node neuroglancer_test.mjs PACKAGES CHROMIUM FILIFORM SET OUT
// PACKAGES: where tools/setup --service put the npm packages and the bundle. OUT: a folder for screenshots and files.
import assert from 'node:assert/strict';
import {spawnSync} from 'node:child_process';
import {writeFileSync} from 'node:fs';
import {basename, join} from 'node:path';

import {endAll, openBrowser, openPage, serveFolder, serveSets, waitFor} from './browser.mjs';

const [packages, chromium, filiform, set, out] = process.argv.slice(2);

// What Neuroglancer has loaded: skeletons, their vertices and edges, and a label.
async function loaded(page) {
  return page.evaluate(() => {
    const counts = {skeletons: 0, vertices: 0, edges: 0, needed: 0, available: 0, labels: {}};
    const seen = new Set();
    for (const {layer} of globalThis.viewer?.layerManager.managedLayers ?? []) {
      for (const render of layer?.renderLayers ?? []) {
        const source = render.base?.source;
        const progress = render.layerChunkProgressInfo;
        if (progress) {
          counts.needed = Math.max(counts.needed, progress.numVisibleChunksNeeded);
          counts.available = Math.max(counts.available, progress.numVisibleChunksAvailable);
        }
        if (!source?.chunks || seen.has(source)) continue;
        seen.add(source);
        for (const chunk of source.chunks.values()) {
          if (!(chunk.numVertices > 0)) continue;
          ++counts.skeletons;
          counts.vertices += chunk.numVertices;
          counts.edges += chunk.numIndices / 2;
        }
      }
      const map = layer?.displayState?.segmentationGroupState?.value?.segmentPropertyMap?.value;
      const inline = map?.segmentPropertyMap?.inlineProperties;
      const label = inline?.properties.find((property) => property.type === 'label');
      if (label) inline.ids.forEach((id, i) => counts.labels[String(id)] = label.values[i]);
    }
    return counts;
  });
}

async function expectAll(browser, address, expected, picture) {
  const page = await openPage(browser);
  await page.goto(address);
  let counts;
  try {
    await waitFor(`loading of ${expected.skeletons} skeletons`, async () => {
      counts = await loaded(page);
      return counts.skeletons >= expected.skeletons && counts.available >= expected.skeletons;
    });
  } catch (error) {
    error.message += `; loaded ${JSON.stringify(counts)}; ${page.problems.join('; ')}`;
    throw error;
  }
  for (const what of ['skeletons', 'vertices', 'edges', 'needed', 'available'])
    assert.equal(counts[what], expected[what] ?? expected.skeletons, what);
  assert.deepEqual(counts.labels, expected.labels);
  assert.deepEqual(page.problems, []);
  await waitFor('drawing', () => page.evaluate(() => globalThis.viewer.isReady()));
  await page.screenshot({path: join(out, picture)});
  await page.close();
  return counts;
}

async function linkOf(page) {
  const links = await page.$$eval('a', (all) => all.filter((a) => a.textContent.startsWith('Open in')).map((a) => a.href));
  assert.equal(links.length, 1);
  return links[0];
}

const name = basename(set, '.fil');

const isPicture = (address) => address.includes('/picture?');

// Opens the server's page, and waits until its picture is there. A busy server refuses pictures at first.
async function openServersPage(browser, server) {
  const page = await openPage(browser);
  await page.goto(`${server}/`, {waitUntil: 'networkidle0'});
  await waitForPicture(page);
  return page;
}

async function waitForPicture(page) {
  await waitFor('the picture', () => page.$$eval('img', (all) => all.length === 1 && all[0].naturalWidth === 640));
}

// The page asks again for a picture that was refused.
async function expectAnotherTry(browser, server) {
  const page = await openPage(browser);
  let refused = 0;
  await page.setRequestInterception(true);
  page.on('request', (request) => {
    if (!isPicture(request.url()) || refused >= 2) return request.continue();
    ++refused;
    return request.respond({status: 503, headers: {'Retry-After': '1'}, contentType: 'application/problem+json', body: '{}'});
  });
  await page.goto(`${server}/`, {waitUntil: 'networkidle0'});
  await waitForPicture(page);
  assert.equal(refused, 2);
  await page.close();
}

try {
  const browser = await openBrowser(packages, chromium);
  const bundle = await serveFolder(join(packages, 'dist'));
  const neuroglancer = `${bundle}/neuroglancer.html`;

  // The page: pictures, a link, nothing that the browser complains of.
  const server = await serveSets(filiform, [set, '--neuroglancer', neuroglancer, '--source-url', 'https://source.example/']);
  const page = await openServersPage(browser, server);
  await page.screenshot({path: join(out, 'page.png'), fullPage: true});
  // Chromium names each refused answer twice, on its console without the address.
  const isBusy = (problem) => /^503: .*[/]picture[?]/.test(problem) || /^console: .*\b503\b/.test(problem);
  assert.deepEqual(page.problems.filter((problem) => !isBusy(problem)), []);
  await expectAnotherTry(browser, server);

  const info = await (await fetch(`${server}/v1/sets/${name}`)).json();
  const cells = (await (await fetch(`${server}/v1/sets/${name}/cells`)).json()).cells;
  const expected = {
    skeletons: info.cells, vertices: info.samples, edges: info.segments,
    labels: Object.fromEntries(cells.map((cell) => [String(cell.id + 1), cell.name]))
  };
  const counts = await expectAll(browser, await linkOf(page), expected, 'neuroglancer.png');
  console.log(`Neuroglancer: ${counts.skeletons} skeletons, ${counts.vertices} vertices, ${counts.edges} edges`);

  // The same as files in shards, from a server that knows nothing of filiform.
  const files = join(out, 'web');
  const written = spawnSync(filiform, ['export', set, '--all', '--format', 'precomputed', '-o', files]);
  assert.equal(written.status, 0, String(written.stderr));
  const shards = await serveFolder(files, bundle);
  const link = new URL(await linkOf(page));
  const state = JSON.parse(decodeURIComponent(link.hash.slice(2)));
  state.layers[0].source = `precomputed://${shards}`;
  await expectAll(browser, `${neuroglancer}#!${encodeURIComponent(JSON.stringify(state))}`, expected, 'shards.png');

  // A token: the link holds a capability instead, until it is revoked.
  const token = '0123456789abcdef0123456789abcdef';
  writeFileSync(join(out, 'token'), `${token}\n`);
  const closed = await serveSets(filiform, [set, '--token-file', join(out, 'token'), '--neuroglancer', neuroglancer]);
  const secret = await openPage(browser);
  await secret.goto(`${closed}/?token=${token}`, {waitUntil: 'networkidle0'});
  assert.equal(secret.url(), `${closed}/`);
  await waitForPicture(secret);
  assert.deepEqual(secret.problems, []);
  const secret_link = await linkOf(secret);
  assert.ok(!secret_link.includes(token));
  await expectAll(browser, secret_link, expected, 'capability.png');
  const door = (await secret.$$eval('pre', (all) => all.map((pre) => pre.textContent)))
    .find((text) => text.startsWith('precomputed://')).trim().slice('precomputed://'.length);
  assert.equal((await fetch(`${door}/info`)).status, 200);
  const revoked = await fetch(`${closed}/v1/capability`, {method: 'DELETE', headers: {Authorization: `Bearer ${token}`}});
  assert.equal(revoked.status, 200);
  assert.equal((await fetch(`${door}/info`)).status, 401);
} catch (error) {
  console.error(error);
  process.exitCode = 1;
} finally {
  await endAll();
}
