// Pictures of browsers and of `filiform render`: reads PNG files, and counts the pixels that show neurites.
import assert from 'node:assert/strict';
import {inflateSync} from 'node:zlib';

// Reads eight bits a channel, RGB or RGBA, without interlace. Returns {width, height, channels, data}, rows from the top.
export function decodePng(file) {
  assert.equal(file.subarray(1, 4).toString(), 'PNG');
  const parts = [];
  let width = 0, height = 0, channels = 0;
  for (let at = 8; at < file.length;) {
    const bytes = file.readUInt32BE(at), kind = file.subarray(at + 4, at + 8).toString();
    const body = file.subarray(at + 8, at + 8 + bytes);
    if (kind === 'IHDR') {
      [width, height] = [body.readUInt32BE(0), body.readUInt32BE(4)];
      channels = {2: 3, 6: 4}[body[9]];
      assert.ok(body[8] === 8 && channels && body[12] === 0, 'another kind of PNG');
    }
    if (kind === 'IDAT') parts.push(body);
    at += 12 + bytes;
  }
  const raw = inflateSync(Buffer.concat(parts)), row = width * channels;
  const data = new Uint8Array(row * height);
  for (let y = 0; y < height; ++y) {
    const filter = raw[y * (row + 1)];
    for (let x = 0; x < row; ++x) {
      const left = x >= channels ? data[y * row + x - channels] : 0;
      const up = y > 0 ? data[(y - 1) * row + x] : 0;
      const corner = x >= channels && y > 0 ? data[(y - 1) * row + x - channels] : 0;
      const guess = left + up - corner;
      const paeth = [left, up, corner].reduce((a, b) => Math.abs(guess - b) < Math.abs(guess - a) ? b : a);
      data[y * row + x] = raw[y * (row + 1) + 1 + x] + [0, left, up, (left + up) >> 1, paeth][filter];
    }
  }
  return {width, height, channels, data};
}

// The part of the pixels that are scene.
export function coverage({width, height, channels, data}) {
  let scene = 0;
  for (let at = 0; at < data.length; at += channels) if (isColourful(data[at], data[at + 1], data[at + 2])) ++scene;
  return scene / (width * height);
}

// Bright and colourful, as drawn neurites are, and unlike panels.
function isColourful(r, g, b) {
  const most = Math.max(r, g, b);
  return most > 60 && most - Math.min(r, g, b) > 25;
}

// Pixels of two pictures of the same size that are scene in both / in either, where `counts(x, y)`.
export function overlap(a, b, counts = () => true) {
  assert.deepEqual([a.width, a.height], [b.width, b.height]);
  let both = 0, either = 0;
  const shows = ({channels, data}, pixel) =>
    isColourful(data[pixel * channels], data[pixel * channels + 1], data[pixel * channels + 2]);
  for (let y = 0; y < a.height; ++y)
    for (let x = 0; x < a.width; ++x) {
      if (!counts(x, y)) continue;
      const pixel = y * a.width + x, first = shows(a, pixel), second = shows(b, pixel);
      both += first && second;
      either += first || second;
    }
  return both / either;
}
