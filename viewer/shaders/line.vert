#version 330 core
// A thread of a pixel or less: a line or ribbon, lit as a thin cylinder (Zoeckler, Stalling and Hege 1996).
layout(location = 0) in vec4 a;
layout(location = 1) in vec4 b;
layout(location = 2) in vec4 colour;

uniform mat3 rotation_VW;
uniform vec3 origin_V;
uniform vec4 lens;
uniform vec2 depth_map;
uniform vec3 background;
uniform vec3 fog;
uniform float dim;
uniform vec2 clearing;  // um: threads thin out from the second to nothing at the first

out vec3 shown;
out float left_over;

void main() {
  vec3 way = rotation_VW * (b.xyz - a.xyz), from = rotation_VW * a.xyz + origin_V;
  vec3 p = gl_VertexID == 0 ? from : from + way;
  if (max(-from.z, -from.z - way.z) <= clearing.x) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  left_over = smoothstep(clearing.x, clearing.y, -p.z);
  float squared = dot(way, way);
  float along = squared > 0.0 ? dot(normalize(vec3(-0.35, 0.55, 0.75)), way * inversesqrt(squared)) : 0.0;
  float diffuse = sqrt(max(0.0, 1.0 - along * along));
  shown = mix(colour.rgb * (0.38 + 0.62 * diffuse), background, max(dim, fog.z * smoothstep(fog.x, fog.y, -p.z)));
  gl_Position = vec4(lens.x * p.x + lens.y * p.z, lens.z * p.y + lens.w * p.z, depth_map.x * p.z + depth_map.y, -p.z);
}
