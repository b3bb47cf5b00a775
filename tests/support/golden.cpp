#include "tests/support/golden.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include <png.h>

namespace filiform::test {

namespace {

// The mean over 3 x 3 pixels for each pixel, over fewer at the rim.
std::vector<double> blurred(const Picture& p) {
  std::vector<double> out(p.rgb.size());
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x)
      for (int channel = 0; channel < 3; ++channel) {
        double sum = 0;
        int count = 0;
        for (int v = std::max(0, y - 1); v <= std::min(p.height - 1, y + 1); ++v)
          for (int u = std::max(0, x - 1); u <= std::min(p.width - 1, x + 1); ++u, ++count)
            sum += p.rgb[static_cast<std::size_t>(3 * (v * p.width + u) + channel)];
        out[static_cast<std::size_t>(3 * (y * p.width + x) + channel)] = sum / count;
      }
  return out;
}

}  // namespace

PictureDifference compare(const Picture& a, const Picture& b) {
  PictureDifference difference;
  difference.same_size = a.width == b.width && a.height == b.height;
  if (!difference.same_size || a.rgb.empty()) return difference;
  const std::vector<double> p = blurred(a), q = blurred(b);
  double sum = 0, far_off = 0;
  for (std::size_t i = 0; i < p.size(); i += 3) {
    double most = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      sum += std::abs(p[i + c] - q[i + c]);
      most = std::max(most, std::abs(p[i + c] - q[i + c]));
    }
    far_off += most > PictureDifference::kFarOff;
  }
  difference.mean = sum / static_cast<double>(p.size());
  difference.far_off = far_off / (static_cast<double>(p.size()) / 3);
  return difference;
}

Picture readPng(const std::string& path) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, path.c_str()) == 0) throw std::runtime_error(path + ": " + image.message);
  image.format = PNG_FORMAT_RGB;
  Picture picture{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  picture.rgb.resize(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, picture.rgb.data(), 0, nullptr) == 0)
    throw std::runtime_error(path + ": " + image.message);
  return picture;
}

}  // namespace filiform::test
