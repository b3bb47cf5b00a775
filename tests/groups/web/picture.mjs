// Pictures of browsers and of `filiform render`, as pngjs reads them: counts the pixels that show neurites.
import assert from 'node:assert/strict';

const kChannels = 4;  // of a pixel: red, green, blue, opacity

// The part of the pixels that are scene.
export function coverage({width, height, data}) {
  let scene = 0;
  for (let at = 0; at < data.length; at += kChannels) if (isColourful(data[at], data[at + 1], data[at + 2])) ++scene;
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
  const shows = ({data}, pixel) =>
    isColourful(data[pixel * kChannels], data[pixel * kChannels + 1], data[pixel * kChannels + 2]);
  for (let y = 0; y < a.height; ++y)
    for (let x = 0; x < a.width; ++x) {
      if (!counts(x, y)) continue;
      const pixel = y * a.width + x, first = shows(a, pixel), second = shows(b, pixel);
      both += first && second;
      either += first || second;
    }
  return both / either;
}
