#version 330 core
// The eyes' pictures as one, their samples averaged.
uniform sampler2D left_eye, right_eye;
uniform int mode;  // as StereoMode
uniform int samples;
uniform ivec2 whole, eye;  // pixels

out vec4 drawn;

vec3 average(sampler2D picture, ivec2 at) {
  vec3 sum = vec3(0.0);
  for (int y = 0; y < samples; ++y)
    for (int x = 0; x < samples; ++x) sum += texelFetch(picture, at * samples + ivec2(x, y), 0).rgb;
  return sum / float(samples * samples);
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  int from_top = whole.y - 1 - at.y;
  vec3 shown = vec3(0.0);
  if (mode == 0) {
    shown = average(left_eye, at);
  } else if (mode == 1) {
    shown = vec3(dot(average(left_eye, at), vec3(0.299, 0.587, 0.114)), average(right_eye, at).gb);
  } else if (mode == 2) {
    if (at.x < eye.x) shown = average(left_eye, at);
    else if (at.x >= whole.x - eye.x) shown = average(right_eye, at - ivec2(whole.x - eye.x, 0));
  } else if (mode == 3) {
    if (from_top < eye.y) shown = average(left_eye, at - ivec2(0, whole.y - eye.y));
    else if (at.y < eye.y) shown = average(right_eye, at);
  } else {
    shown = (from_top & 1) == 0 ? average(left_eye, at) : average(right_eye, at);
  }
  drawn = vec4(shown, 1.0);
}
