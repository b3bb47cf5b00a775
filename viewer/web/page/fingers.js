// Fingers and pens act as a mouse.
//
//   one finger    the left button; near the proxy, or after a long press, the right button, which pulls
//   two fingers   the middle button, which moves the view; spreading them zooms in, as the wheel does
//   a pen         its own buttons
'use strict';

const kNearProxy_px = 32, kStill_px = 10, kLongPress_ms = 500;  // pixels of CSS
const kNotch = 1.2;  // the zoom of a notch of the wheel
const kLeft = 0, kMiddle = 1, kRight = 2;

// `proxyAt()` returns where the proxy is drawn, [x, y] in pixels of CSS, or null. `scroll(notches)` turns the wheel.
function listenToFingers(canvas, proxyAt, scroll) {
  const fingers = new Map();  // pointerId to {x, y}, in the order in which they came
  let pressed = null;         // the button that is down, or will be after the next frames
  let begun = null;           // {x, y} of the finger that pressed
  let timer = 0, distance = 0;
  let waiting = [];  // events that wait for a frame; null begins the next frame

  const send = (kind, at, button) => canvas.dispatchEvent(new MouseEvent(
    kind, {clientX: at.x, clientY: at.y, button: button ?? 0, bubbles: true, cancelable: true, view: window}));

  function serve() {
    while (waiting.length > 0) {
      const event = waiting.shift();
      if (event === null) return requestAnimationFrame(serve);
      send(...event);
    }
  }
  function later(...event) {
    if (waiting.length === 0) return send(...event);
    if (event[0] === 'mousemove' && waiting.at(-1)?.[0] === 'mousemove') waiting.pop();
    waiting.push(event);
  }

  // The window learns in a frame where the pointer is. Only then it knows whether a panel is under it.
  function press(at, button) {
    release(at);
    later('mousemove', at);
    const starts = waiting.length === 0;
    waiting.push(null, null, ['mousedown', at, button]);
    if (starts) serve();
    pressed = button;
  }
  function release(at) {
    clearTimeout(timer);
    if (pressed !== null) later('mouseup', at, pressed);
    pressed = null;
  }

  const middle = ([a, b]) => ({x: (a.x + b.x) / 2, y: (a.y + b.y) / 2});
  const between = ([a, b]) => Math.max(1, Math.hypot(a.x - b.x, a.y - b.y));

  function isNearProxy(at) {
    const proxy = proxyAt();
    return proxy !== null && Math.hypot(proxy[0] - at.x, proxy[1] - at.y) < kNearProxy_px;
  }

  function comes(event, at) {
    if (event.pointerType === 'pen') return press(at, event.button === 2 ? kRight : event.button === 1 ? kMiddle : kLeft);
    if (fingers.size === 1) {
      begun = at;
      press(at, isNearProxy(at) ? kRight : kLeft);
      if (pressed === kLeft) timer = setTimeout(() => press(begun, kRight), kLongPress_ms);
    } else if (fingers.size === 2) {
      const both = [...fingers.values()];
      distance = between(both);
      press(middle(both), kMiddle);
    }
  }

  function moves(at) {
    if (fingers.size > 2) return;
    if (fingers.size === 2) {
      const both = [...fingers.values()];
      later('mousemove', middle(both));
      scroll(Math.log(between(both) / distance) / Math.log(kNotch));
      distance = between(both);
      return;
    }
    if (begun !== null && Math.hypot(at.x - begun.x, at.y - begun.y) > kStill_px) clearTimeout(timer);
    if (pressed !== null) later('mousemove', at);
  }

  const listen = (kind, handle) => canvas.addEventListener(kind, (event) => {
    if (event.pointerType !== 'touch' && event.pointerType !== 'pen') return;
    event.preventDefault();  // no mouse events of the browser's own
    handle(event, {x: event.clientX, y: event.clientY});
  });
  listen('pointerdown', (event, at) => {
    fingers.set(event.pointerId, at);
    comes(event, at);
  });
  listen('pointermove', (event, at) => {
    if (!fingers.has(event.pointerId)) return;
    fingers.set(event.pointerId, at);
    moves(at);
  });
  // After two fingers the last one does nothing.
  for (const kind of ['pointerup', 'pointercancel'])
    listen(kind, (event, at) => {
      if (!fingers.delete(event.pointerId)) return;
      release(at);
    });
  // The program's own handlers know no fingers.
  for (const kind of ['touchstart', 'touchmove', 'touchend', 'touchcancel'])
    canvas.addEventListener(kind, (event) => {
      event.preventDefault();
      event.stopImmediatePropagation();
    }, {capture: true, passive: false});
}
