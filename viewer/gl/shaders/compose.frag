#version 330 core
// Composes the eyes' pictures into one: averages the samples of each pixel and, if SHADED, applies eye-dome lighting.
// The renderer defines MODE (a StereoMode), SAMPLES and SHADED (0, 1) before it compiles this text: a software renderer
// executes both sides of each branch.
uniform sampler2D left_eye, right_eye, left_depth, right_depth;
const int samples = SAMPLES;
uniform ivec2 whole, eye;  // pixels
uniform vec2 depth_map;    // of the projection matrix: [2][2], [2][3]
uniform float shade_um;

out vec4 drawn;

float away_um(float depth) { return depth_map.y / (2.0 * depth - 1.0 + depth_map.x); }

const ivec2 kFarther[4] = ivec2[4](ivec2(2, 0), ivec2(-2, 0), ivec2(0, 2), ivec2(0, -2));

#if SHADED
// Eye-dome lighting: darkens a pixel beside nearer ones (Boucheny 2009).
float lit(sampler2D depths, ivec2 at) {
  ivec2 first = at * samples, last = eye * samples - 1;
  float nearest = 1.0;
  for (int y = 0; y < samples; ++y)
    for (int x = 0; x < samples; ++x) nearest = min(nearest, texelFetch(depths, first + ivec2(x, y), 0).r);
  if (nearest == 1.0) return 1.0;
  float here_um = away_um(nearest), behind = 0.0;
  ivec2 middle = first + samples / 2;
  for (int i = 0; i < 8; ++i) {
    ivec2 way = i < 4 ? ivec2((i & 1) * 2 - 1, (i & 2) - 1) : kFarther[i - 4];
    float other = texelFetch(depths, clamp(middle + way * samples, ivec2(0), last), 0).r;
    behind += clamp((here_um - away_um(other)) / shade_um, 0.0, 1.0);
  }
  return exp(-2.0 * behind / 8.0);
}
#else
float lit(sampler2D depths, ivec2 at) { return 1.0; }
#endif

vec3 meanOf(sampler2D picture, sampler2D depths, ivec2 at) {
  vec3 sum = vec3(0.0);
  for (int y = 0; y < samples; ++y)
    for (int x = 0; x < samples; ++x) sum += texelFetch(picture, at * samples + ivec2(x, y), 0).rgb;
  return sum * lit(depths, at) / float(samples * samples);
}

vec3 left(ivec2 at) { return meanOf(left_eye, left_depth, at); }
vec3 right(ivec2 at) { return meanOf(right_eye, right_depth, at); }

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  int from_top = whole.y - 1 - at.y;
  vec3 shown = vec3(0.0);
#if MODE == 0
  shown = left(at);
#elif MODE == 1
  // Half as pure as the scene: a pure colour would be bright for one eye and dark for the other.
  vec3 other = right(at);
  const vec3 kLuminance = vec3(0.299, 0.587, 0.114);
  shown = vec3(dot(left(at), kLuminance), mix(vec2(dot(other, kLuminance)), other.gb, 0.5));
#elif MODE == 2
  if (at.x < eye.x) shown = left(at);
  else if (at.x >= whole.x - eye.x) shown = right(at - ivec2(whole.x - eye.x, 0));
#elif MODE == 3
  if (from_top < eye.y) shown = left(at - ivec2(0, whole.y - eye.y));
  else if (at.y < eye.y) shown = right(at);
#else
  if ((from_top & 1) == 0) shown = left(at);
  else shown = right(at);
#endif
  drawn = vec4(shown, 1.0);
}
