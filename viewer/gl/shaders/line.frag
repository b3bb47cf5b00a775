#version 330 core
// The renderer defines FADES (0, 1) before it compiles this text: without `discard` a driver writes depths before it
// shades.
in vec3 shown;
in float left_over;
uniform float opacity;
out vec4 drawn;
float hash(vec2 p) { return fract(52.9829189 * fract(dot(p, vec2(0.06711056, 0.00583715)))); }

void main() {
#if FADES
  if (left_over < 1.0 && hash(gl_FragCoord.xy) >= left_over) discard;
#endif
  drawn = vec4(shown, opacity);
}
