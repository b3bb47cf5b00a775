#version 330 core
flat in vec4 own_colour;
flat in float reach_px, radius_px, left_over, away, halo;
in vec2 off_px;

uniform vec3 background;
uniform float opacity;

out vec4 drawn;

float hash(vec2 p) { return fract(52.9829189 * fract(dot(p, vec2(0.06711056, 0.00583715)))); }

void main() {
  if (dot(off_px, off_px) > reach_px * reach_px) discard;
  // Below the size of a sample, fading drops pixels at random.
  if (radius_px < 0.5 && left_over < 1.0 && hash(gl_FragCoord.xy) >= 2.0 * radius_px) discard;
  vec3 light = normalize(vec3(-0.35, 0.55, 0.75));
  vec3 n = vec3(off_px / max(radius_px, 0.5), 0.0);
  n.z = sqrt(max(0.0, 1.0 - dot(n.xy, n.xy)));
  // On balls of a pixel a specular highlight would be noise.
  float mirrored = max(0.0, dot(n, normalize(light + vec3(0.0, 0.0, 1.0))));
  mirrored *= mirrored;
  mirrored *= mirrored;
  mirrored *= mirrored;
  mirrored *= mirrored;
  float bright = 0.25 * smoothstep(1.5, 4.0, radius_px) * mirrored * mirrored;  // its 32nd power
  vec3 shown = own_colour.rgb * (0.38 + 0.68 * max(0.0, dot(n, light))) + bright;
  drawn = vec4(mix(shown, background, max(away, halo)), opacity);
}
