// What the tests in a browser share: Chromium, a server of files, `filiform serve` as a process.
import assert from 'node:assert/strict';
import {spawn} from 'node:child_process';
import {createReadStream, existsSync, mkdtempSync, rmSync, statSync} from 'node:fs';
import {createServer} from 'node:http';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {extname, join, normalize} from 'node:path';
import {createInterface} from 'node:readline';

// Ends what was started, in the reverse order.
const endings = [];
export async function endAll() {
  while (endings.length > 0) await endings.pop()();
}

export function atEnd(ending) { endings.push(ending); }

async function launch(packages, options) {
  const puppeteer = createRequire(join(packages, 'package.json'))('puppeteer-core');
  const profile = mkdtempSync(join(tmpdir(), 'filiform-browser-'));
  const browser = await puppeteer.launch({userDataDir: profile, defaultViewport: {width: 1280, height: 800}, ...options});
  endings.push(async () => {
    await browser.close();
    rmSync(profile, {recursive: true, force: true});
  });
  return browser;
}

// `options`: more of puppeteer's.
export const openBrowser = (packages, chromium, options = {}) => launch(packages, {
  executablePath: chromium,
  headless: true,
  args: [
    '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking',
    '--disable-component-update', '--disable-sync', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'
  ],
  ...options,
});

// Needs a display: without a window Firefox has no WebGL 2.
export const openFirefox = (packages, firefox) => launch(packages, {
  browser: 'firefox',
  executablePath: firefox,
  headless: false,
  env: {...process.env, LIBGL_ALWAYS_SOFTWARE: '1'},
});

// A page that lists everything that goes wrong in it.
export async function openPage(browser) {
  const page = await browser.newPage();
  page.problems = [];
  page.on('console', (message) => {
    if (message.type() === 'error') page.problems.push(`console: ${message.text()}`);
  });
  page.on('pageerror', (error) => page.problems.push(`error: ${error.message}`));
  page.on('requestfailed', (request) => page.problems.push(`failed: ${request.url()} ${request.failure()?.errorText}`));
  page.on('response', (response) => {
    if (response.status() >= 400) page.problems.push(`${response.status()}: ${response.url()}`);
  });
  return page;
}

// Serves a folder with ranges, also to pages of `origin`. Returns its address.
export async function serveFolder(folder, origin) {
  const types = {'.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm'};
  const server = createServer((request, response) => {
    const path = join(folder, normalize(decodeURIComponent(new URL(request.url, 'http://x').pathname)));
    const headers = {'Content-Type': types[extname(path)] ?? 'application/octet-stream', 'Accept-Ranges': 'bytes'};
    if (origin && request.headers.origin === origin)
      Object.assign(headers, {'Access-Control-Allow-Origin': origin, 'Access-Control-Allow-Headers': 'Range'});
    if (request.method === 'OPTIONS') return response.writeHead(204, headers).end();
    if (!existsSync(path) || !statSync(path).isFile()) return response.writeHead(404, headers).end();
    const size = statSync(path).size;
    const range = request.headers.range?.match(/^bytes=(\d+)-(\d*)$/);
    const first = range ? Number(range[1]) : 0;
    const last = range && range[2] ? Math.min(Number(range[2]), size - 1) : size - 1;
    if (range) headers['Content-Range'] = `bytes ${first}-${last}/${size}`;
    headers['Content-Length'] = last - first + 1;
    response.writeHead(range ? 206 : 200, headers);
    if (request.method === 'HEAD' || size === 0) return response.end();
    createReadStream(path, {start: first, end: last}).pipe(response);
  });
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  endings.push(() => new Promise((done) => {
    server.closeAllConnections();
    server.close(done);
  }));
  return `http://127.0.0.1:${server.address().port}`;
}

// `filiform serve` at `listen`, of which port 0 is a free one; without a token, unless `args` name a file of tokens.
// `end(signal)` returns when the process has ended; a process that was stopped goes on first.
export async function startServer(filiform, args, listen = '127.0.0.1:0') {
  const open = args.some((word) => word.startsWith('--token')) ? [] : ['--no-token'];
  const child = spawn(filiform, ['serve', ...args, ...open, '--listen', listen], {stdio: ['ignore', 'pipe', 'ignore']});
  const end = (signal) => new Promise((done) => {
    if (child.exitCode !== null || child.signalCode !== null) return done();
    child.once('exit', done);
    child.kill(signal);
    child.kill('SIGCONT');
  });
  endings.push(() => end('SIGTERM'));
  const address = await new Promise((done, fail) => {
    createInterface({input: child.stdout}).once('line', done);
    child.once('exit', (code) => fail(new Error(`filiform serve ended with code ${code}`)));
  });
  assert.match(address, /^http:\/\/127\.0\.0\.1:\d+$/);
  return {address, child, end};
}

// Returns the address of `filiform serve` at a free port.
export async function serveSets(filiform, args) { return (await startServer(filiform, args)).address; }

export async function waitFor(what, check, seconds = 150) {
  const until = Date.now() + seconds * 1000;
  for (;;) {
    if (await check()) return;
    if (Date.now() > until) throw new Error(`${what} did not happen within ${seconds} s`);
    await new Promise((done) => setTimeout(done, 100));
  }
}
