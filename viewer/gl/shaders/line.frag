#version 330 core
// The renderer defines DRAWN before it compiles this text: 0 the line, 1 where it does not fade, 2 where it fades.
// Without `discard` a driver writes depths before it shades.
in vec4 shown;
in float left_over;
uniform float opacity;  // 1: alpha becomes the mark of the cell
out vec4 drawn;

void main() {
#if DRAWN == 1
  if (left_over < 1.0) discard;
#elif DRAWN == 2
  if (left_over >= 1.0) discard;
#endif
  drawn = vec4(shown.rgb, DRAWN == 2 ? left_over : opacity < 1.0 ? opacity : shown.a);
}
