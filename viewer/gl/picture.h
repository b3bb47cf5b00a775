// A picture in memory. Thread rule: plain data.
#pragma once

#include <cstdint>
#include <vector>

namespace filiform {

struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  // rows from the top
};

}  // namespace filiform
