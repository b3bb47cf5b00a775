// Starts the program of the page, and does what a program of WebAssembly cannot: downloads pictures, reads and writes
// the address, and says why nothing is shown. CMakeLists.txt puts the other scripts of this folder before this one.
'use strict';

const note = document.getElementById('note');
const canvas = document.getElementById('canvas');
// The address of a file of the page, under which the browser keeps the file.
const pageFile = (name) => `/travel/page/${name}?v=${document.body.dataset.version}`;
const kEvery_ms = 500;
const kLostAgain_ms = 30000;
const kNotch_units = [100, 3, 1];  // a notch of the wheel in pixels, lines, pages

function tell(text) { note.textContent = text; }

function whatIsMissing() {
  if (!window.WebAssembly) return 'This browser has no WebAssembly. Use a newer one.';
  const trial = document.createElement('canvas').getContext('webgl2');
  if (!trial) return 'This browser has no WebGL 2. Switch on hardware acceleration, or use another browser.';
  const lost = trial.getExtension('WEBGL_lose_context');
  if (lost) lost.loseContext();
  if (!window.crossOriginIsolated)
    return 'This page has no threads: open it by https or at localhost, in a tab of its own and not in a frame.';
  return '';
}

// The address: ?budget=MiB&segments=N&desk=NAME#CELL:ID or #X,Y,Z, then &zoom=UM.
function wanted() {
  const query = new URLSearchParams(location.search);
  const [place, ...more] = decodeURIComponent(location.hash.slice(1)).split('&');
  const zoom = more.map((part) => part.split('=')).find(([name]) => name === 'zoom');
  return {
    set: new URL(document.body.dataset.set, location.href).href,
    place: place.replaceAll(',', ' '),
    zoom: zoom ? zoom[1] : '',
    budget: query.get('budget') || '',
    segments: query.get('segments') || '',
    desk: query.get('desk') || '',
  };
}

function pixels() {
  const ratio = window.devicePixelRatio || 1;
  return [Math.max(1, Math.round(window.innerWidth * ratio)), Math.max(1, Math.round(window.innerHeight * ratio))];
}

const unsaid = [];
// Shows a line in the window, once there is a window.
function say(text) { unsaid.push(text); }

// What the program wrote of its state; null while it is being written.
function readState() {
  try {
    return JSON.parse(FS.readFile('/state.json', {encoding: 'utf8'}));
  } catch (failure) {
    return null;
  }
}

function keep() {
  Module._filiform_keep();
  keepFiles(say);
}

function look() {
  const state = readState();
  if (!state) return;
  for (const text of unsaid.splice(0)) Module.ccall('filiform_say', null, ['string'], [text]);
  window.filiformState = state;
  keep();
  if (!state.open || !state.cell || state.mode !== 'constrained' || state.sample === undefined) return;
  const place = encodeURIComponent(state.cell + ':' + state.sample) + '&zoom=' + Number(state.zoom_um.toPrecision(4));
  if ('#' + place !== location.hash) history.replaceState(null, '', location.pathname + location.search + '#' + place);
}

// Of the set; empty before it is open.
function revisionOf() {
  return window.filiformState?.open ? Module.ccall('filiform_revision', 'string', [], []) : '';
}

function scroll(notches) {
  if (Module.calledRun) Module._filiform_scroll(notches);
}

function proxyAt() {
  const state = Module.calledRun ? readState() : null;
  if (!state?.proxy_px || state.overview) return null;
  return state.proxy_px.map((x) => x / (window.devicePixelRatio || 1));
}

// Draws the place of a desk; null: none.
function showDesk(place, along) {
  if (!Module.calledRun) return;
  const numbers = place ? [...place.proxy_um, ...place.hand_um, ...place.centre_um, ...place.rotation, place.zoom_um, place.force_N] : [];
  Module.ccall('filiform_desk', null, ['string', 'array', 'number', 'number', 'number'],
    [asked.desk, new Uint8Array(new Float64Array(numbers).buffer), numbers.length, place?.constrained ? 1 : 0, along ? 1 : 0]);
}

const asked = wanted();
let reader;  // the worker that makes the program's requests
var Module = {
  canvas,
  arguments: [asked.set, asked.place, asked.zoom, asked.budget, asked.segments, ...pixels().map(String)],
  locateFile: pageFile,
  mainScriptUrlOrBlob: pageFile('filiform.js'),
  preRun: [() => {
    ENV.XDG_CONFIG_HOME = '/config';
    restoreFiles(say);
  }],
  onRuntimeInitialized: () => {
    reader.postMessage([wasmMemory, Module._filiform_reader_desk()]);
    tell('');
  },
  postRun: [() => {
    const corner = document.createElement('div');
    corner.id = 'corner';
    if (asked.desk) corner.append(lookOnAtDesk(asked.desk, new URL(asked.set).pathname, say, showDesk, revisionOf));
    corner.append(offerSpaceMouse(say));
    document.body.append(corner);
  }],
  print: (text) => console.log(text),
  printErr: (text) => console.warn(text),
  onAbort: (what) => tell('The program has ended: ' + what + '. Load the page again.'),
  // Called by the program.
  failed: (text) => tell(text),
  download: (width, height, name, bytes) => {
    const picture = document.createElement('canvas');
    [picture.width, picture.height] = [width, height];
    picture.getContext('2d').putImageData(new ImageData(bytes, width, height), 0, 0);
    picture.toBlob((blob) => {
      const link = document.createElement('a');
      link.href = URL.createObjectURL(blob);
      link.download = name;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 60000);
    });
  },
  lastKey: '',
};

const missing = whatIsMissing();
if (missing) {
  tell(missing);
} else {
  // The picture stays in the canvas until the next frame, so that panels may be drawn over it.
  const getContext = canvas.getContext.bind(canvas);
  canvas.getContext = (kind, options) =>
    getContext(kind, {...options, alpha: false, antialias: false, preserveDrawingBuffer: true});
  window.addEventListener('keydown', (event) => {
    Module.lastKey = event.key;
    if (event.ctrlKey && event.key === 'p') event.preventDefault();  // the browser would print
  }, true);
  listenToFingers(canvas, proxyAt, scroll);
  // Before the program's own handlers, which give pixels for notches.
  for (const kind of ['wheel', 'mousewheel'])
    canvas.addEventListener(kind, (event) => {
      event.preventDefault();
      event.stopImmediatePropagation();
      if (kind === 'wheel') scroll(-event.deltaY / kNotch_units[event.deltaMode]);
    }, {capture: true, passive: false});
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  window.addEventListener('resize', () => {
    if (Module.calledRun) Module._filiform_resize(...pixels());
  });
  document.addEventListener('visibilitychange', () => {
    if (Module.calledRun) Module._filiform_hide(document.hidden ? 1 : 0);
  });
  window.addEventListener('pagehide', () => {
    if (Module.calledRun) keep();
  });
  // After a reset of the graphics driver the page begins again at its address, unless it has just done so.
  canvas.addEventListener('webglcontextlost', () => {
    if (Module.calledRun) look();
    const last = Number(sessionStorage.getItem('context_lost') || 0);
    sessionStorage.setItem('context_lost', Date.now());
    if (Date.now() - last > kLostAgain_ms) location.reload();
    else tell('The graphics driver was reset again and again. Load the page again.');
  });
  setInterval(() => { if (Module.calledRun) look(); }, kEvery_ms);
  const unloaded = () => tell('The program of this page cannot be loaded. Is the server still running?');
  reader = new Worker(pageFile('reader.js'));
  reader.onerror = unloaded;
  const program = document.createElement('script');
  program.src = pageFile('filiform.js');
  program.onerror = unloaded;
  document.body.append(program);
}
