// Looks on at a desk: `filiform view SET --follow` shows its place by way of the server, and the program draws it.
'use strict';

const kSilent_ms = 2000, kAgain_ms = [1000, 2000, 4000, 8000];
const kPolicy = 1008, kFinal = 4000;  // this close code, and those from kFinal on, are final

// `name`: of the desk. `set`: the path of the set on the server. `say(text)` shows one line. `show(place, along)` draws a
// place; null: none. `revision()`: of the set, empty before it is open. Returns the button that goes along with the desk.
function lookOnAtDesk(name, set, say, show, revision) {
  const button = document.createElement('button');
  button.id = 'desk';
  button.hidden = true;
  const path = `${set}/desks/${encodeURIComponent(name)}`;
  const address = `${location.protocol === 'https:' ? 'wss:' : 'ws:'}//${location.host}${path}`;
  let newest = null, heard_ms = 0, along = true, tries = 0, told = '';

  function sayOnce(text) {
    if (text !== told) say(text);
    told = text;
  }

  function put(place) {
    if (!place && !newest) return;
    if (!place) along = true;
    newest = place;
    show(place, along);
    button.hidden = !place || along;
    button.textContent = `go along with ${name}`;
  }

  function hear(text) {
    let place = null;
    try {
      place = JSON.parse(text);
    } catch (failure) {
      return;
    }
    const isPoint = (point, count) => Array.isArray(point) && point.length === count && point.every(Number.isFinite);
    heard_ms = performance.now();
    if (!place || !isPoint(place.proxy_um, 3) || !isPoint(place.hand_um, 3) || !isPoint(place.centre_um, 3) ||
        !isPoint(place.rotation, 4) || !Number.isFinite(place.zoom_um) || !Number.isFinite(place.force_N)) {
      sayOnce(newest ? `the desk ${name} is gone` : `waiting for: filiform view SET --follow ${address}`);
      return put(null);
    }
    put(place);
    sayOnce(`the desk ${name} is here`);
  }

  function connect() {
    const socket = new WebSocket(`${address}/page?revision=${encodeURIComponent(revision())}`);
    socket.onmessage = (event) => {
      tries = 0;
      hear(event.data);
    };
    socket.onclose = (event) => {
      if (event.reason) sayOnce(`the desk ${name}: ${event.reason}`);
      if (event.code >= kFinal || event.code === kPolicy) return put(null);
      setTimeout(connect, kAgain_ms[Math.min(tries++, kAgain_ms.length - 1)]);
    };
  }

  function stay() {
    if (!along || !newest) return;
    along = false;
    put(newest);
  }
  for (const kind of ['pointerdown', 'wheel']) document.getElementById('canvas').addEventListener(kind, stay, true);
  button.addEventListener('click', () => {
    button.blur();  // keys go to the window
    along = true;
    put(newest);
  });
  setInterval(() => {
    if (!newest || performance.now() - heard_ms < kSilent_ms) return;
    sayOnce(`the desk ${name} is silent`);
    put(null);
  }, 500);
  const opening = setInterval(() => {
    if (!revision()) return;
    clearInterval(opening);
    connect();
  }, 100);
  return button;
}
