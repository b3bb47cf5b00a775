#include "index/formats/neuroglancer/internal/spatial_index.h"

#include "index/errors.h"
#include "index/formats/neuroglancer/internal/bounded_json.h"
#include "index/formats/neuroglancer/object_ids.h"
#include "index/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <optional>

namespace filiform {
namespace {

using Json = nlohmann::json;
using Three = std::array<double, 3>;

std::optional<Three> threeOf(const Json& object, const char* key) {
  if (!object.is_object() || !object.contains(key) || !object[key].is_array() || object[key].size() != 3) return {};
  Three three{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (!object[key][i].is_number()) return {};
    three[i] = object[key][i].get<double>();
    if (!std::isfinite(three[i])) return {};
  }
  return three;
}

// With exactly this many decimals.
std::string fixed(double value, int decimals) {
  char text[400];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, decimals);
  return {text, error == std::errc() ? end : text};
}

// Decimals of the shortest text that states the number.
int decimalsOf(double value) {
  char text[400];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed);
  const std::string_view all(text, error == std::errc() ? static_cast<std::size_t>(end - text) : 0);
  const std::size_t point = all.find('.');
  return point == std::string_view::npos ? 0 : static_cast<int>(all.size() - point - 1);
}

bool meet(const Box_nm& a, const Box_nm& b) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (a[0][axis] > b[1][axis] || b[0][axis] > a[1][axis]) return false;
  return true;
}

}  // namespace

SpatialIndex::SpatialIndex(std::string_view skeletons, const std::string& file, std::string_view volume,
                           const std::string& volume_file)
    : file_(file) {
  const Json json = internal::boundedJson(skeletons);
  if (!json.is_object() || !json.contains("spatial_index"))
    throw InputError(inShort(file) + ": names no spatial_index, so a box cannot choose; name the objects with --ids");
  const Json& index = json["spatial_index"];
  const auto chunk = threeOf(index, "chunk_size");
  if (!chunk || *std::min_element(chunk->begin(), chunk->end()) <= 0)
    throw InputError(inShort(file) + ": its spatial_index has no chunk_size of three numbers above 0");
  chunk_nm_ = *chunk;
  const Json whole = internal::boundedJson(volume);
  const Json scales = whole.is_object() && whole.contains("scales") ? whole["scales"] : Json();
  const auto resolution = threeOf(index, "resolution");
  std::size_t at = json.contains("mip") && json["mip"].is_number_unsigned() ? json["mip"].get<std::size_t>() : 0;
  for (std::size_t i = 0; resolution && scales.is_array() && i < scales.size(); ++i)
    if (threeOf(scales[i], "resolution") == resolution) at = i;
  const Json scale = scales.is_array() && at < scales.size() ? scales[at] : Json();
  const auto unit = threeOf(scale, "resolution"), size = threeOf(scale, "size");
  if (!unit || !size || *std::min_element(unit->begin(), unit->end()) <= 0)
    throw InputError(inShort(volume_file) +
                     ": states no scale with a size and a resolution, which the spatial index needs; name the objects "
                     "with --ids");
  const Three begin = threeOf(scale, "voxel_offset").value_or(Three{});
  for (std::size_t axis = 0; axis < 3; ++axis) {
    bounds_[0][axis] = begin[axis] * (*unit)[axis];
    bounds_[1][axis] = (begin[axis] + (*size)[axis]) * (*unit)[axis];
    decimals_ = std::max(decimals_, decimalsOf((*unit)[axis]));
  }
}

std::vector<std::string> SpatialIndex::filesIn(const Box_nm& box) const {
  std::vector<std::string> names{""};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double low = bounds_[0][axis], high = bounds_[1][axis], step = chunk_nm_[axis];
    const double first = std::max(0.0, std::floor((box[0][axis] - low) / step));
    const double last =
        std::floor((std::min(box[1][axis], high) - low) / step);  // a box that ends at a bound meets both
    if (!(last >= first) || box[0][axis] > high) return {};
    if (last - first >= static_cast<double>(kMostFiles))
      throw InputError(inShort(file_) + ": the box meets too many chunks of the spatial index; choose a smaller one");
    std::vector<std::string> longer;
    for (double chunk = first; chunk <= last; ++chunk) {
      const double begin = low + chunk * step;
      if (begin >= high) break;
      const std::string part = fixed(begin, decimals_) + "-" + fixed(std::min(begin + step, high), decimals_);
      for (const std::string& name : names) longer.push_back((name.empty() ? "" : name + "_") + part);
    }
    if (longer.size() > kMostFiles)
      throw InputError(inShort(file_) + ": the box meets too many chunks of the spatial index; choose a smaller one");
    names = std::move(longer);
  }
  for (std::string& name : names) name += ".spatial";
  return names;
}

void SpatialIndex::objectsIn(const Box_nm& box, std::string_view text, const std::string& file,
                             std::vector<std::uint64_t>& ids) {
  const Json json = internal::boundedJson(text);
  if (!json.is_object()) throw InputError(inShort(file) + ": is not a file of a spatial index");
  for (const auto& [key, bounds] : json.items()) {
    Box_nm object{};
    bool good = bounds.is_array() && bounds.size() == 6;
    for (std::size_t i = 0; good && i < 6; ++i) {
      good = bounds[i].is_number();
      if (good) object[i / 3][i % 3] = bounds[i].get<double>();
    }
    std::uint64_t id = 0;
    if (!good || !readObjectId(key, id))
      throw InputError(inShort(file) + ": its object " + escaped(key, 40) + " has no valid id, or not six numbers");
    if (meet(object, box)) ids.push_back(id);
  }
}

}  // namespace filiform
