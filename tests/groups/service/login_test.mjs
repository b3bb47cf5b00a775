// A log-in with OpenID Connect, as users do it: Chromium, Apache with tools/serve/operate/apache-login.conf, and `filiform serve`
// behind it. The provider is npm's oidc-provider, with its own pages for log-ins.
//
//   node login_test.mjs PACKAGES CHROMIUM FILIFORM FOLDER
//
// FOLDER holds column.fil, small.fil, certificate.pem and key.pem. Prints what was seen; exits with 1 at the first
// difference.
import assert from 'node:assert/strict';
import {spawn, spawnSync} from 'node:child_process';
import {readFileSync, writeFileSync} from 'node:fs';
import {createServer} from 'node:http';
import {createRequire} from 'node:module';
import {createServer as createTcpServer} from 'node:net';
import {join} from 'node:path';
import {pathToFileURL} from 'node:url';
import {atEnd, endAll, openBrowser, serveSets, waitFor} from './browser.mjs';

const [packages, chromium, filiform, folder] = process.argv.slice(2);
const kSecret = 'a secret of the client, of this test alone';

async function freePort() {
  const server = createTcpServer();
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  const {port} = server.address();
  await new Promise((done) => server.close(done));
  return port;
}

// Whoever logs in with a name has it, as NAME@lab.example.
async function startProvider(redirect) {
  const path = createRequire(join(packages, 'package.json')).resolve('oidc-provider');
  const {default: Provider} = await import(pathToFileURL(path));
  const port = await freePort(), issuer = `http://127.0.0.1:${port}`;
  const provider = new Provider(issuer, {
    clients: [{client_id: 'filiform', client_secret: kSecret, redirect_uris: [redirect]}],
    claims: {openid: ['sub'], email: ['email']},
    findAccount: (_, id) => ({accountId: id, claims: () => ({sub: id, email: `${id}@lab.example`})}),
  });
  const server = createServer(provider.callback());
  await new Promise((done) => server.listen(port, '127.0.0.1', done));
  atEnd(() => new Promise((done) => {
    server.closeAllConnections();
    server.close(done);
  }));
  return issuer;
}

// tools/serve/operate/apache-login.conf with the addresses of this test.
async function startApache(port, issuer, address) {
  let text = readFileSync(new URL('../../../tools/serve/operate/apache-login.conf', import.meta.url), 'utf8');
  for (const [was, now] of [
    ['https://login.example', issuer], ['secret of this client at the provider', kSecret],
    ['https://tiles.example', `https://127.0.0.1:${port}`], ['<VirtualHost *:443>', `<VirtualHost 127.0.0.1:${port}>`],
    ['ServerName tiles.example', 'ServerName 127.0.0.1'], ['/etc/ssl/filiform/', `${folder}/`],
    ['http://127.0.0.1:7878/', `${address}/`]
  ]) {
    assert.ok(text.includes(was), `apache-login.conf has no ${was}`);
    text = text.replaceAll(was, now);
  }
  const modules = [
    'mpm_event', 'authn_core', 'authz_core', 'authz_user', 'auth_openidc', 'headers', 'proxy', 'proxy_http', 'ssl',
    'socache_shmcb'
  ].map((name) => `LoadModule ${name}_module /usr/lib/apache2/modules/mod_${name}.so\n`).join('');
  writeFileSync(join(folder, 'apache.conf'), `ServerRoot ${folder}\nServerName 127.0.0.1\nPidFile ${folder}/apache.pid\n` +
    `DefaultRuntimeDir ${folder}\nMutex file:${folder} default\nErrorLog ${folder}/apache.log\nUser www-data\n` +
    `Group www-data\nListen 127.0.0.1:${port}\n${modules}${text}`);
  const child = spawn('/usr/sbin/apache2', ['-X', '-f', join(folder, 'apache.conf')], {stdio: 'ignore'});
  atEnd(() => new Promise((done) => {
    if (child.exitCode !== null) return done();
    child.once('exit', done);
    child.kill('SIGTERM');
  }));
  await waitFor('apache listens', async () => {
    assert.equal(child.exitCode, null, `apache2 ended; ${folder}/apache.log says why`);
    return new Promise((done) => fetch(`http://127.0.0.1:${port}/`).then(() => done(true), () => done(false)));
  }, 20);
}

// The headings of the page, one a set.
const setsOf = (page) => page.$$eval('h2', (all) => all.map((one) => one.textContent));

// The provider's two pages: a name, then its consent.
async function logIn(page, front, name) {
  await page.goto(`${front}/`, {waitUntil: 'networkidle0'});
  await page.type('input[name=login]', name);
  await page.type('input[name=password]', 'any');
  for (let i = 0; i < 2 && !page.url().startsWith(front); ++i)
    await Promise.all([page.waitForNavigation({waitUntil: 'networkidle0'}), page.click('button[type=submit]')]);
  assert.equal(page.url(), `${front}/`);
}

try {
  const port = await freePort(), front = `https://127.0.0.1:${port}`;
  writeFileSync(join(folder, 'users.toml'), '[[user]]\nname = "eve@lab.example"\nsets = ["small"]\n' +
    '[[user]]\nname = "max@lab.example"\n[[token]]\nname = "robot"\ntoken = "0123456789abcdef-robot"\n', {mode: 0o600});
  const address = await serveSets(filiform, [
    join(folder, 'column.fil'), join(folder, 'small.fil'), '--tokens', join(folder, 'users.toml'), '--proxy', '127.0.0.1',
    '--user-header', 'X-Filiform-User', '--no-pictures'
  ]);
  await startApache(port, await startProvider(`${front}/oauth2/callback`), address);
  const browser = await openBrowser(packages, chromium, {
    acceptInsecureCerts: true,
    args: ['--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking',
      '--disable-component-update', '--disable-sync', '--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1']
  });
  const seen = [];
  for (const [name, sets] of [['eve', ['small']], ['max', ['column', 'small']], ['mallory', null]]) {
    const context = await browser.createBrowserContext();
    const page = await context.newPage();
    await logIn(page, front, name);
    if (sets === null)
      assert.match(await page.$eval('body', (body) => body.textContent), /mallory@lab.example.*may not ask/);
    else
      assert.deepEqual(await setsOf(page), sets);
    if (name === 'eve') {
      // The cookie of the log-in opens no more than the page did, also for a WebSocket.
      assert.equal((await page.goto(`${front}/v1/sets/column`)).status(), 404);
      const greeting = await page.evaluate(() => new Promise((done, fail) => {
        const socket = new WebSocket(`wss://${location.host}/v1/session`, ['filiform.v1']);
        socket.onopen = () => socket.send('{"jsonrpc":"2.0","id":1,"method":"hello"}');
        socket.onmessage = ({data}) => done(data);
        socket.onerror = () => fail(new Error('no WebSocket'));
      }));
      assert.deepEqual(JSON.parse(greeting).result.sets.map((one) => one.name), ['small']);
    }
    seen.push(`${name}: ${sets === null ? 'refused' : sets.join(' and ')}`);
    await context.close();
  }
  const token = spawnSync('curl', ['-sk', '-H', 'Authorization: Bearer 0123456789abcdef-robot', `${front}/v1/sets`]);
  assert.equal(JSON.parse(String(token.stdout)).sets.length, 2, 'a token of a program passes');
  const header = spawnSync('curl', ['-sk', '-o', '/dev/null', '-w', '%{http_code}', '-H', 'X-Filiform-User: max@lab.example',
    '-H', 'Authorization: Bearer none', `${front}/v1/sets`]);
  assert.equal(String(header.stdout), '401', 'the header of a client does not pass');
  console.log(seen.join('; '));
} catch (error) {
  console.error(String(error.stack || error));
  process.exitCode = 1;
} finally {
  await endAll();
}
