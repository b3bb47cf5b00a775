#version 330 core
flat in vec4 ends_px;
flat in vec4 radii;
flat in vec2 depths;
flat in vec3 axis_V;
flat in vec4 own_colour;
in vec2 at_px;

uniform vec4 lens;
uniform vec2 half_px;
uniform vec2 depth_map;  // of the projection matrix: [2][2], [2][3]
uniform float halo_px;
uniform vec2 halo_radii;
uniform vec3 background;
uniform vec3 fog;       // begin um, end um, most
uniform float dim;      // mixes with the background at any depth, 0 .. 1
uniform vec2 clearing;  // um: neurites get thinner from the second depth to nothing at the first
uniform float opacity;

out vec4 drawn;

float hash(vec2 p) { return fract(52.9829189 * fract(dot(p, vec2(0.06711056, 0.00583715)))); }

void main() {
  vec2 way = ends_px.zw - ends_px.xy;
  float squared = dot(way, way);
  float t = squared > 1e-8 ? clamp(dot(at_px - ends_px.xy, way) / squared, 0.0, 1.0) : 0.0;
  vec2 off = at_px - ends_px.xy - t * way;
  // 1/w is linear over the picture.
  float w = 1.0 / mix(1.0 / depths.x, 1.0 / depths.y, t);
  float left_over = smoothstep(clearing.x, clearing.y, w);
  float r = mix(radii.x, radii.y, t) * left_over, distance_px = length(off);
  // Below the size of a sample, fading drops pixels at random.
  if (r < 0.5 && left_over < 1.0 && hash(gl_FragCoord.xy) >= 2.0 * r) discard;
  float halo = halo_px * smoothstep(halo_radii.x, halo_radii.y, r);
  if (distance_px > max(r, 0.5) + halo) discard;
  float um_px = w / (lens.z * half_px.y);
  float radius_um = r * um_px;
  vec3 light = normalize(vec3(-0.35, 0.55, 0.75));
  float surface;
  vec3 shown;
  if (distance_px <= max(r, 0.5)) {
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
    shown = own_colour.rgb * (0.38 + 0.68 * diffuse) + bright;
    float away = max(dim, fog.z * smoothstep(fog.x, fog.y, w));
    shown = mix(shown, background, away);
    surface = w - radius_um * front;
  } else {
    // The halo lies behind the segment, deeper towards its rim: it hides only neurites that lie well behind.
    shown = background;
    surface = w + radius_um * (2.0 + 3.0 * (distance_px - r) / halo);
  }
  surface = max(surface, 1e-6 * w);
  gl_FragDepth = clamp(0.5 + 0.5 * (depth_map.y - depth_map.x * surface) / surface, 0.0, 1.0);
  drawn = vec4(shown, opacity);
}
