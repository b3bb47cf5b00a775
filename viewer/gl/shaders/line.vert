#version 330 core
// A thin segment: a line or ribbon, lit as a thin cylinder (Zoeckler, Stalling and Hege 1996). It is a quad, because
// OpenGL refuses wide lines in a forward-compatible context. Its width of `width_px` is measured along the picture axis
// in which the line advances less, as for OpenGL's own lines: it covers the same pixels, and joints leave no gap.
layout(location = 0) in vec4 a;
layout(location = 1) in vec4 b;

uniform mat3 rotation_VW;
uniform vec3 origin_V;
uniform vec4 lens;
uniform vec2 half_px;
uniform vec2 depth_map;
uniform float near_um;
uniform float width_px;
uniform float pixel_um;  // the segment stands for hidden ones in pixels of this size: at least as wide, up to twice
uniform vec3 background;
uniform vec3 fog;
uniform float dim;
uniform vec2 clearing;  // um: neurites get thinner from the second depth to nothing at the first

out vec4 shown;  // alpha: of the colour
out float left_over;

vec2 pixel(vec3 p) { return vec2(lens.x * p.x + lens.y * p.z, lens.z * p.y + lens.w * p.z) / -p.z * half_px; }

void main() {
  vec3 way = rotation_VW * (b.xyz - a.xyz), p = rotation_VW * a.xyz + origin_V;
  vec3 q = p + way;
  vec4 colour;
  float recedes = dim;
  if (max(-p.z, -q.z) <= max(clearing.x, near_um) || !isPainted(a, colour, recedes)) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  // Clip at the near plane: a point behind the eye has no place in the picture.
  if (-p.z < near_um) p = mix(p, q, (-near_um - p.z) / (q.z - p.z));
  if (-q.z < near_um) q = mix(q, p, (-near_um - q.z) / (p.z - q.z));
  vec2 a_px = pixel(p), b_px = pixel(q), along = abs(b_px - a_px);
  bool at_b = (gl_VertexID & 1) != 0;
  vec3 here = at_b ? q : p;
  float width = clamp(1.3 * pixel_um * lens.z * half_px.y / -here.z, width_px, 2.0 * width_px);
  vec2 side = along.x >= along.y ? vec2(0.0, 0.5 * width) : vec2(0.5 * width, 0.0);
  vec2 corner = (at_b ? b_px : a_px) + ((gl_VertexID & 2) != 0 ? side : -side);

  left_over = smoothstep(clearing.x, clearing.y, -here.z);
  float squared = dot(way, way);
  float lit = squared > 0.0 ? dot(normalize(vec3(-0.35, 0.55, 0.75)), way * inversesqrt(squared)) : 0.0;
  float diffuse = sqrt(max(0.0, 1.0 - lit * lit));
  float away = max(recedes, fog.z * smoothstep(fog.x, fog.y, -here.z));
  shown = vec4(mix(colour.rgb * (0.38 + 0.62 * diffuse), background, away), colour.a);
  gl_Position = vec4(corner / half_px * -here.z, depth_map.x * here.z + depth_map.y, -here.z);
}
