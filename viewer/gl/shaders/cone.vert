#version 330 core
// A round cone as a quad on the screen that encloses both ends, their radii and the halo. A halo alone is a flat quad
// behind the cone, so the driver tests depths before it shades. The renderer defines DRAWN as for cone.frag.
layout(location = 0) in vec4 a;  // position from the batch's origin and radius, um
layout(location = 1) in vec4 b;

uniform mat3 rotation_VW;
uniform vec3 origin_V;
uniform vec4 lens;  // of the projection matrix: [0][0], [0][2], [1][1], [1][2]
uniform vec2 half_px;
uniform vec2 depth_map;  // of the projection matrix: [2][2], [2][3]
uniform float near_um;
uniform float least_px;
uniform float halo_px;
uniform vec2 halo_radii;  // px: no halo below the first radius, a full one above the second
uniform float dim;
uniform vec2 clearing;    // um: neurites get thinner from the second depth to nothing at the first

flat out vec4 ends_px;   // of a and b, from the middle of the picture
flat out vec4 radii;     // of a and b in pixels as drawn, then in um as given
flat out vec2 depths;    // um
flat out vec3 axis_V;    // unit vector; 0 for a sphere
flat out vec4 own_colour;
flat out float recedes;  // mixes with the background at any depth, 0 .. 1
out vec2 at_px;

vec2 pixel(vec3 p) { return vec2(lens.x * p.x + lens.y * p.z, lens.z * p.y + lens.w * p.z) / -p.z * half_px; }

void main() {
  vec3 p = rotation_VW * a.xyz + origin_V, q = rotation_VW * b.xyz + origin_V;
  vec2 radius_um = vec2(a.w, b.w);
  float begin_um = max(near_um, clearing.x);
  recedes = dim;
  if ((-p.z < begin_um && -q.z < begin_um) || !isPainted(a, own_colour, recedes)) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  axis_V = q == p ? vec3(0.0) : normalize(q - p);
  if (-p.z < begin_um) {
    float t = (-begin_um - p.z) / (q.z - p.z);
    p = mix(p, q, t);
    radius_um.x = mix(radius_um.x, radius_um.y, t);
  } else if (-q.z < begin_um) {
    float t = (-begin_um - q.z) / (p.z - q.z);
    q = mix(q, p, t);
    radius_um.y = mix(radius_um.y, radius_um.x, t);
  }
  depths = vec2(-p.z, -q.z);
  vec2 a_px = pixel(p), b_px = pixel(q);
  vec2 r_px = max(radius_um * lens.z * half_px.y / depths, vec2(least_px));
  ends_px = vec4(a_px, b_px);
  radii = vec4(r_px, radius_um);

  vec2 along = b_px - a_px;
  float length_px = length(along);
  along = length_px > 1e-4 ? along / length_px : vec2(1.0, 0.0);
  float thickest_px = max(r_px.x, r_px.y) * smoothstep(clearing.x, clearing.y, max(depths.x, depths.y));
  float room = thickest_px + halo_px * smoothstep(halo_radii.x, halo_radii.y, thickest_px) + 1.0;
  vec2 corner = ((gl_VertexID & 1) == 0 ? a_px - room * along : b_px + room * along) +
                ((gl_VertexID & 2) == 0 ? -room : room) * vec2(-along.y, along.x);
  at_px = corner;
#if DRAWN == 1
  bool at_a = (gl_VertexID & 1) == 0;
  float end_um = at_a ? depths.x : depths.y, radius_px = at_a ? r_px.x : r_px.y;
  float depth_um = end_um * (1.0 + 3.0 * radius_px / (lens.z * half_px.y));
  // Behind the cone: it hides only neurites that lie well behind.
  gl_Position = vec4(corner / half_px, clamp((depth_map.y - depth_map.x * depth_um) / depth_um, -1.0, 1.0), 1.0);
#else
  gl_Position = vec4(corner / half_px, 0.0, 1.0);
#endif
}
