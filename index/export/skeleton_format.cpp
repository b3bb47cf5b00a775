#include "index/export/skeleton_format.h"

#include "index/errors.h"

#include <bit>
#include <cmath>
#include <limits>
#include <ostream>

#include <nlohmann/json.hpp>

namespace filiform {

namespace {

using SkeletonJson = nlohmann::ordered_json;

void putLittleEndian(std::string& bytes, std::uint32_t bits, int count) {
  for (int i = 0; i < count; ++i) bytes += static_cast<char>(bits >> (8 * i) & 0xff);
}

// The radius in quanta that a reader converts back to this radius, if one exists.
float quantaOf(float um, double quantum_nm) {
  const auto back = [&](float quanta) { return static_cast<float>(static_cast<double>(quanta) * quantum_nm * 1e-3); };
  const float quanta = static_cast<float>(static_cast<double>(um) / (quantum_nm * 1e-3));
  const float up = std::nextafter(quanta, std::numeric_limits<float>::infinity());
  const float down = std::nextafter(quanta, 0.0F);
  for (const float candidate : {quanta, up, down})
    if (back(candidate) == um) return candidate;
  return quanta;
}

}  // namespace

SkeletonFormat::SkeletonFormat(const Grid& grid, const GridBox& bounds, WideBounds wide)
    : grid_(grid), origin_(GridPoint::Zero()) {
  if (bounds.empty()) return;
  constexpr std::int64_t kMostQuanta = std::int64_t{1} << 24;  // whole numbers up to this are exact as 32-bit floats
  origin_ = bounds.lo + (bounds.hi - bounds.lo) / 2;
  if (wide == WideBounds::round) return;
  if (((bounds.hi - origin_).array() > kMostQuanta).any() || ((origin_ - bounds.lo).array() > kMostQuanta).any())
    throw InputError(
        "these cells are too wide for Neuroglancer's 32-bit floats (2^25 quanta); write .edges or .vtk files "
        "instead");
}

std::string SkeletonFormat::info(const std::optional<SkeletonSharding>& sharding) const {
  const double quantum_nm = grid_.quantum_um() * 1e3;
  SkeletonJson transform = SkeletonJson::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) transform.push_back(row == column ? quantum_nm : 0.0);
    transform.push_back(static_cast<double>(origin_[row]) * quantum_nm);
  }
  SkeletonJson json{{"@type", "neuroglancer_skeletons"},
                    {"transform", transform},
                    {"vertex_attributes",
                     {{{"id", "radius"}, {"data_type", "float32"}, {"num_components", 1}},
                      {{"id", "vertex_types"}, {"data_type", "float32"}, {"num_components", 1}}}},
                    {"segment_properties", "segment_properties"}};
  if (sharding)
    json["sharding"] = {{"@type", "neuroglancer_uint64_sharded_v1"},
                        {"preshift_bits", 0},
                        {"hash", "murmurhash3_x86_128"},
                        {"minishard_bits", sharding->minishard_bits},
                        {"shard_bits", sharding->shard_bits},
                        {"minishard_index_encoding", "gzip"},
                        {"data_encoding", "gzip"}};
  return json.dump(1) + "\n";
}

void SkeletonFormat::write(std::ostream& out, const CellGraph& cell) const {
  const auto links = parentLinks(cell);
  std::string bytes;
  bytes.reserve(8 + cell.samples() * 20 + links.size() * 8);
  putLittleEndian(bytes, static_cast<std::uint32_t>(cell.samples()), 4);
  putLittleEndian(bytes, static_cast<std::uint32_t>(links.size()), 4);
  for (const GridPoint& point : cell.positions)
    for (int axis = 0; axis < 3; ++axis)
      putLittleEndian(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(point[axis] - origin_[axis])), 4);
  for (const auto& [parent, child] : links) {
    putLittleEndian(bytes, parent, 4);
    putLittleEndian(bytes, child, 4);
  }
  const double quantum_nm = grid_.quantum_um() * 1e3;
  for (const float radius : cell.radii_um)
    putLittleEndian(bytes, std::bit_cast<std::uint32_t>(std::isnan(radius) ? radius : quantaOf(radius, quantum_nm)), 4);
  for (const std::uint16_t type : cell.types)
    putLittleEndian(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(type)), 4);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace filiform
