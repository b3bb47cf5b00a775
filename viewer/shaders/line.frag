#version 330 core
in vec3 shown;
uniform float opacity;
out vec4 drawn;
void main() { drawn = vec4(shown, opacity); }
