// What a desk shows to pages: where its proxy, its hand and its view are. One JSON text each. Thread rule: a value.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Geometry>

namespace filiform::tools {

// World frame, um. Without Eigen's alignment and without allocations, for TripleBuffer.
struct DeskPlace {
  using Point = std::array<double, 3>;
  Point proxy_W{}, hand_W{}, centre_W{};          // centre_W: of the workspace
  std::array<double, 4> rotation_WD{1, 0, 0, 0};  // w, x, y, z; from the device's frame to the world
  double zoom_um = 300, force_N = 0;              // tissue across the workspace; magnitude
  bool constrained = true;                        // false: the proxy is free

  static constexpr std::size_t kMostBytes = 1024;  // of a text
};

// One line.
std::string toJson(const DeskPlace& place);
// nullopt if the text is longer than kMostBytes, is no JSON object with exactly these fields, or has a number that is
// not finite or out of range.
std::optional<DeskPlace> parseDeskPlace(std::string_view text);

}  // namespace filiform::tools
