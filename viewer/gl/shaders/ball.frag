#version 330 core
// The renderer defines DRAWN before it compiles this text: 0 the ball, 1 the halo. What is smaller than a sample because
// it fades is left out.
flat in vec4 own_colour;
flat in float reach_px, radius_px, left_over, away;
in vec2 off_px;

uniform vec3 background;
uniform sampler2D surfaces;  // alpha: the mark of the cell whose surface is there

out vec4 drawn;

void main() {
  if (dot(off_px, off_px) > reach_px * reach_px) discard;
#if DRAWN == 1
  if (abs(texelFetch(surfaces, ivec2(gl_FragCoord.xy), 0).a - own_colour.a) < 0.002) discard;
  drawn = vec4(background, 1.0);
#else
  if (radius_px < 0.5 && left_over < 1.0) discard;
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
  drawn = vec4(mix(shown, background, away), own_colour.a);
#endif
}
