// Makes the requests of the program. A worker of its own, which always returns to its event loop.
// index/remote/web/page_reader.h says what the numbers in the program's memory are.
'use strict';

const kSenders = 32;  // channels
const kDesk = {asked: 0, page: 1};  // words
const kRequest = {next: 0, is_answered: 1, url: 2, token: 3, to: 4, room: 5, method: 6, past_the_cache: 7, timeout_ms: 8,
                  status: 9, body_bytes: 10, retry_after_s: 11};
const kStatedBytes = 48;  // byte
const kHead = 1, kKept = 2;  // methods

let memory, desk;
const channels = [];
const kept = new Map();  // address of a request to an answer for whose body it had no room

const bytes = () => new Uint8Array(memory.buffer);
const words = () => new Uint32Array(memory.buffer);

function textAt(address) {
  const all = bytes();
  return new TextDecoder().decode(all.slice(address, all.indexOf(0, address)));
}

function readAll() {
  const requests = [];
  const all = words();
  let address = Atomics.exchange(all, desk / 4 + kDesk.asked, 0);
  for (; address !== 0; address = all[address / 4 + kRequest.next]) requests.push(address);
  requests.reverse().forEach(answer);
}

async function fetchBody(address) {
  const asked = (what) => words()[address / 4 + kRequest[what]];
  const headers = {}, token = textAt(asked('token'));
  if (token) headers.Authorization = 'Bearer ' + token;
  const ending = new AbortController();
  const timer = setTimeout(() => ending.abort(), asked('timeout_ms'));
  try {
    const answer = await fetch(textAt(asked('url')), {
      method: asked('method') === kHead ? 'HEAD' : 'GET', headers, cache: asked('past_the_cache') ? 'no-cache' : 'default',
      signal: ending.signal,
    });
    const body = new Uint8Array(await answer.arrayBuffer());
    const stated = answer.headers.get('Content-Length');
    new DataView(memory.buffer).setFloat64(address + kStatedBytes, stated === null ? -1 : Number(stated), true);
    words()[address / 4 + kRequest.retry_after_s] = Number(answer.headers.get('Retry-After')) || 0;
    return {status: answer.status, body};
  } catch (failure) {
    return {status: 0, body: new Uint8Array(0)};
  } finally {
    clearTimeout(timer);
  }
}

async function answer(address) {
  const is_kept = words()[address / 4 + kRequest.method] === kKept;
  const {status, body} = is_kept ? kept.get(address) : await fetchBody(address);
  kept.delete(address);
  const all = words(), at = address / 4;
  all[at + kRequest.status] = status;
  all[at + kRequest.body_bytes] = body.length;
  if (body.length <= all[at + kRequest.room]) bytes().set(body, all[at + kRequest.to]);
  else kept.set(address, {status, body});
  Atomics.store(all, at + kRequest.is_answered, 1);
  Atomics.notify(new Int32Array(memory.buffer), at + kRequest.is_answered);
}

onmessage = ({data}) => {
  [memory, desk] = data;
  const page = 1 + crypto.getRandomValues(new Uint32Array(1))[0] % 0x7ffffffe;
  for (let sender = 0; sender < kSenders; ++sender) {
    channels.push(new BroadcastChannel(`filiform-${page}-${sender}`));
    channels[sender].onmessage = readAll;
  }
  Atomics.store(words(), desk / 4 + kDesk.page, page);
  readAll();
};
