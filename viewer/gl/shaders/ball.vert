#version 330 core
// A small ball, or its halo, as a quad on the screen. It lies at one depth, so the driver tests depths before it shades:
// most balls of dense tissue are hidden. The renderer defines DRAWN as for ball.frag.
layout(location = 0) in vec4 a;  // centre from the batch's origin and radius, um

uniform mat3 rotation_VW;
uniform vec3 origin_V;
uniform vec4 lens;  // of the projection matrix: [0][0], [0][2], [1][1], [1][2]
uniform vec2 half_px;
uniform vec2 depth_map;  // of the projection matrix: [2][2], [2][3]
uniform float near_um;
uniform float least_px;
uniform float halo_px;
uniform vec2 halo_radii;  // px: no halo below the first radius, a full one above the second
uniform vec3 fog;         // begin um, end um, most
uniform float dim;        // mixes with the background at any depth, 0 .. 1
uniform vec2 clearing;    // um: balls get smaller from the second depth to nothing at the first

flat out vec4 own_colour;
flat out float reach_px, radius_px, left_over, away;
out vec2 off_px;  // from the centre

void main() {
  vec3 p = rotation_VW * a.xyz + origin_V;
  float centre_um = -p.z, px_um = lens.z * half_px.y / centre_um;
  left_over = smoothstep(clearing.x, clearing.y, centre_um);
  radius_px = max(a.w * px_um, least_px) * left_over;
  const bool is_halo = DRAWN == 1;
  float rim_px = is_halo ? halo_px * smoothstep(halo_radii.x, halo_radii.y, radius_px) : 0.0;
  float recedes = dim;
  if (centre_um < near_um || left_over <= 0.0 || (is_halo && rim_px <= 0.0) || !isPainted(a, own_colour, recedes)) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  reach_px = max(radius_px, 0.5) + rim_px;
  away = max(recedes, fog.z * smoothstep(fog.x, fog.y, centre_um));

  off_px = (reach_px + 1.0) * vec2((gl_VertexID & 1) * 2 - 1, (gl_VertexID & 2) - 1);
  vec2 centre_px = vec2(lens.x * p.x + lens.y * p.z, lens.z * p.y + lens.w * p.z) / centre_um * half_px;
  // The halo lies behind the ball: it hides only neurites that lie well behind.
  float radius_um = radius_px / px_um;
  float depth_um = max(centre_um + (is_halo ? 2.0 : -1.0) * radius_um, 1e-6 * centre_um);
  float depth = clamp((depth_map.y - depth_map.x * depth_um) / depth_um, -1.0, 1.0);
  gl_Position = vec4((centre_px + off_px) / half_px, depth, 1.0);
}
