// The texts of viewer/gl/shaders/. The build puts them into the program.
#pragma once

namespace filiform::internal {

extern const char* const kPaintText;  // comes before the vertex shaders of segments
extern const char* const kBallVertexShader;
extern const char* const kBallFragmentShader;
extern const char* const kConeVertexShader;
extern const char* const kConeFragmentShader;
extern const char* const kLineVertexShader;
extern const char* const kLineFragmentShader;
extern const char* const kComposeVertexShader;
extern const char* const kComposeFragmentShader;

}  // namespace filiform::internal
