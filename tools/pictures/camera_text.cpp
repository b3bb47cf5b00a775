#include "tools/pictures/camera_text.h"

#include "index/errors.h"
#include "index/text.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

namespace filiform::tools {

std::vector<double> parseNumberList(const std::string& what, const std::string& text, std::size_t count) {
  std::vector<double> values;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    values.push_back(parseNumber(what, text.substr(begin, end - begin)));
    begin = end + 1;
  }
  if (values.size() != count)
    throw UsageError(what + " " + inShort(text) + ": give " + std::to_string(count) + " numbers, separated by commas");
  return values;
}

Vector3d parsePoint(const std::string& what, const std::string& text) {
  const std::vector<double> v = parseNumberList(what, text, 3);
  return {v[0], v[1], v[2]};
}

CameraText parseCamera(const std::string& what, const std::string& text) {
  constexpr double kRight = std::numbers::pi / 2;
  constexpr std::array<std::pair<const char*, std::pair<double, double>>, 7> kAngles{{{"", {0, 0}},
                                                                                      {"front", {0, 0}},
                                                                                      {"back", {2 * kRight, 0}},
                                                                                      {"right", {kRight, 0}},
                                                                                      {"left", {-kRight, 0}},
                                                                                      {"top", {0, kRight}},
                                                                                      {"bottom", {0, -kRight}}}};
  CameraText camera;
  for (const auto& [name, angles] : kAngles) {
    if (text != name) continue;
    std::tie(camera.yaw_rad, camera.pitch_rad) = angles;
    return camera;
  }
  if (text == "follow") {
    camera.kind = CameraText::Kind::follow;
  } else if (const std::size_t colon = text.find(':'); colon != std::string::npos) {
    camera.kind = CameraText::Kind::places;
    camera.eye_W = parsePoint(what, text.substr(0, colon));
    camera.target_W = parsePoint(what, text.substr(colon + 1));
  } else if (text.find(',') != std::string::npos) {
    const std::vector<double> degrees = parseNumberList(what, text, 2);
    camera.yaw_rad = degrees[0] * std::numbers::pi / 180;
    camera.pitch_rad = degrees[1] * std::numbers::pi / 180;
  } else {
    throw UsageError(what + " " + inShort(text) +
                     ": give front, back, left, right, top, bottom, follow, YAW,PITCH in degrees, or X,Y,Z:X,Y,Z");
  }
  return camera;
}

PictureSize parseSize(const std::string& what, const std::string& text, int most) {
  const std::size_t cross = text.find('x');
  if (cross == std::string::npos)
    throw UsageError(what + " " + inShort(text) + ": give WIDTHxHEIGHT, such as 1280x800");
  const double width = parseNumber(what, text.substr(0, cross)), height = parseNumber(what, text.substr(cross + 1));
  for (const double side : {width, height})
    if (side != std::floor(side) || side < 1 || side > most)
      throw UsageError(what + " " + inShort(text) + ": each side is a whole number from 1 to " + std::to_string(most));
  return {static_cast<int>(width), static_cast<int>(height)};
}

}  // namespace filiform::tools
