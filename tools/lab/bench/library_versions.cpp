#include "tools/lab/bench/bench.h"

#include <gnu/libc-version.h>
#include <hwy/highway.h>
#include <lz4.h>

#include <CGAL/version.h>
#include <CLI/Version.hpp>
#include <Eigen/Core>
#include <flann/config.h>
#include <nlohmann/json.hpp>
#include <png.h>
#include <xxhash.h>
#include <zip.h>

namespace filiform::tools {

std::vector<std::pair<std::string, std::string>> libraryVersions() {
  const auto dotted = [](int a, int b, int c) {
    std::string text = std::to_string(a);
    text += "." + std::to_string(b);
    text += "." + std::to_string(c);
    return text;
  };
  const auto hash = static_cast<int>(XXH_versionNumber());
  return {
      {"CGAL", CGAL_VERSION_STR},
      {"CLI11", CLI11_VERSION},
      {"Eigen", dotted(EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
      {"FLANN", FLANN_VERSION_},
      {"Highway", dotted(HWY_MAJOR, HWY_MINOR, HWY_PATCH)},
      {"glibc", gnu_get_libc_version()},
      {"libpng", PNG_LIBPNG_VER_STRING},
      {"libzip", zip_libzip_version()},
      {"lz4", LZ4_versionString()},
      {"nlohmann json", dotted(NLOHMANN_JSON_VERSION_MAJOR, NLOHMANN_JSON_VERSION_MINOR, NLOHMANN_JSON_VERSION_PATCH)},
      {"xxHash", dotted(hash / 10000, hash / 100 % 100, hash % 100)}};
}

}  // namespace filiform::tools
