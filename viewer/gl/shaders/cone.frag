#version 330 core
// The renderer defines DRAWN before it compiles this text: 0 the surface, 1 the halo. What is thinner than a sample
// because it fades is left out.
flat in vec4 ends_px;
flat in vec4 radii;
flat in vec2 depths;
flat in vec3 axis_V;
flat in vec4 own_colour;
flat in float recedes;  // mixes with the background at any depth, 0 .. 1
in vec2 at_px;

uniform vec4 lens;
uniform vec2 half_px;
uniform vec2 depth_map;  // of the projection matrix: [2][2], [2][3]
uniform float halo_px;
uniform vec2 halo_radii;
uniform vec3 background;
uniform vec3 fog;       // begin um, end um, most
uniform vec2 clearing;  // um: neurites get thinner from the second depth to nothing at the first
uniform float opacity;  // 1: alpha becomes the mark of the cell
uniform sampler2D surfaces;  // alpha: the mark of the cell whose surface is there

out vec4 drawn;

void main() {
  vec2 way = ends_px.zw - ends_px.xy;
  float squared = dot(way, way);
  float t = squared > 1e-8 ? clamp(dot(at_px - ends_px.xy, way) / squared, 0.0, 1.0) : 0.0;
  vec2 off = at_px - ends_px.xy - t * way;
  // 1/w is linear over the picture.
  float w = 1.0 / mix(1.0 / depths.x, 1.0 / depths.y, t);
  float left_over = smoothstep(clearing.x, clearing.y, w);
  float r = mix(radii.x, radii.y, t) * left_over, distance_px = length(off);
#if DRAWN == 1
  if (distance_px <= r || distance_px > max(r, 0.5) + halo_px * smoothstep(halo_radii.x, halo_radii.y, r)) discard;
  // A cell casts no halo on itself.
  if (abs(texelFetch(surfaces, ivec2(gl_FragCoord.xy), 0).a - own_colour.a) < 0.002) discard;
  drawn = vec4(background, 1.0);
#else
  if (distance_px > max(r, 0.5) || (r < 0.5 && left_over < 1.0)) discard;
  vec3 light = normalize(vec3(-0.35, 0.55, 0.75));
  vec3 n = vec3(off / max(r, 0.5), 0.0);
  float front = sqrt(max(0.0, 1.0 - dot(n.xy, n.xy)));
  n.z = front;
  if (t > 0.0 && t < 1.0) n = normalize(n - dot(n, axis_V) * axis_V);  // normal of a cylinder
  float diffuse = max(0.0, dot(n, light));
  // On segments of a pixel a specular highlight would be noise.
  float mirrored = max(0.0, dot(n, normalize(light + vec3(0.0, 0.0, 1.0))));
  mirrored *= mirrored;
  mirrored *= mirrored;
  mirrored *= mirrored;
  mirrored *= mirrored;
  float bright = 0.25 * smoothstep(1.5, 4.0, r) * mirrored * mirrored;  // its 32nd power
  vec3 shown = own_colour.rgb * (0.38 + 0.68 * diffuse) + bright;
  float away = max(recedes, fog.z * smoothstep(fog.x, fog.y, w));
  float surface = max(w - r * w / (lens.z * half_px.y) * front, 1e-6 * w);
  gl_FragDepth = clamp(0.5 + 0.5 * (depth_map.y - depth_map.x * surface) / surface, 0.0, 1.0);
  drawn = vec4(mix(shown, background, away), opacity < 1.0 ? opacity : own_colour.a);
#endif
}
