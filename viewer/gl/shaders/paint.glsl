// The colour of a segment; comes before each vertex shader of segments. A mark has its own colour. A neurite has its
// cell and type, and a palette says how they look: what is on the card stays as it is when colours change.
layout(location = 2) in uint paint;  // a colour, red lowest; or a cell, and from bit 29 on its type

uniform sampler2D palette;  // row 0: a ramp; row 1: types; then cells, whose alpha is 0 hidden, 1/2 dimmed, 1 shown
uniform int colouring;      // 0 by cell, 1 type, 2 depth, 3 radius, 4 tile; -1: paint is a colour
uniform int cells;          // in the palette, at least one
uniform int hidden_types;   // bit n: type n
uniform vec2 depth_ramp;    // the part of the ramp at the batch's origin, and more for each um along y
uniform vec3 tile_colour;
uniform float receding;     // of dimmed cells: mixes with the background

vec4 texel(int i) { return texelFetch(palette, ivec2(i & 2047, i >> 11), 0); }
vec4 onRamp(float part) { return texel(int(clamp(part, 0.0, 1.0) * 2047.0 + 0.5)); }

// `a`: the child's end. Alpha: the mark of the cell. Raises `recedes`. False: the cell or the type is hidden.
bool isPainted(vec4 a, out vec4 colour, inout float recedes) {
  if (colouring < 0) {
    colour = vec4(float(paint & 255u), float((paint >> 8) & 255u), float((paint >> 16) & 255u), float(paint >> 24)) / 255.0;
    return true;
  }
  uint cell = paint & 536870911u;
  vec4 own = texel(4096 + int(cell % uint(cells)));
  int type = int(paint >> 29);
  if (own.a < 0.25 || ((hidden_types >> type) & 1) != 0) return false;
  if (own.a < 0.75) recedes = max(recedes, receding);
  if (colouring == 1) own = texel(2048 + type);
  if (colouring == 2) own = onRamp(depth_ramp.x + depth_ramp.y * a.y);
  if (colouring == 3) own = onRamp(log2(a.w * 20.0) * 0.150514997832);  // half of the decimal logarithm
  if (colouring == 4) own.rgb = tile_colour;
  colour = vec4(own.rgb, float((cell * 2654435761u >> 16) % 255u) / 255.0);
  return true;
}
