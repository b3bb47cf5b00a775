#version 330 core
in vec3 shown;
in float left_over;
uniform float opacity;
out vec4 drawn;
float hash(vec2 p) { return fract(52.9829189 * fract(dot(p, vec2(0.06711056, 0.00583715)))); }

void main() {
  if (left_over < 1.0 && hash(gl_FragCoord.xy) >= left_over) discard;
  drawn = vec4(shown, opacity);
}
