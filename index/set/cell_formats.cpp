#include "index/set/cell_formats.h"

#include "index/errors.h"
#include "index/file/internal/decimals.h"
#include "index/text.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <concepts>
#include <limits>
#include <ostream>
#include <string_view>

#include <nlohmann/json.hpp>

namespace filiform {

namespace {

using Links = std::vector<std::array<std::uint32_t, 2>>;

// {parent, child} by rank, without isolated samples.
Links linksOf(const CellGraph& cell) {
  Links links;
  for (const auto& [child, parent] : cell.links)
    if (child != parent) links.push_back({parent, child});
  for (std::uint32_t i = 0; !cell.isGraph() && i < cell.samples(); ++i)
    if (cell.parents[i] != kNoParent) links.push_back({cell.parents[i], i});
  return links;
}

// Builds one line of text at a time.
class TextLines {
 public:
  explicit TextLines(std::ostream& out) : out_(out) {}

  TextLines& word(std::string_view text) {
    blank();
    at_ = std::copy(text.begin(), text.end(), at_);
    return *this;
  }
  template <std::integral Number>
  TextLines& whole(Number number) {
    blank();
    at_ = std::to_chars(at_, line_.data() + line_.size(), number).ptr;
    return *this;
  }
  TextLines& point(const CellGraph& cell, std::uint32_t rank) {
    const Vector3d p_W = cell.position_W(rank);
    for (int axis = 0; axis < 3; ++axis) {
      blank();
      at_ = internal::putCoordinate(at_, p_W[axis], cell.grid);
    }
    return *this;
  }
  TextLines& radius(float um, double odd_um = kUnknownRadius) {
    if (std::isnan(um)) return word("nan");
    blank();
    at_ = std::isnan(odd_um) ? internal::putRadius(at_, um) : internal::putRadius(at_, odd_um);
    return *this;
  }
  void end() {
    *at_++ = '\n';
    out_.write(line_.data(), at_ - line_.data());
    at_ = line_.data();
  }

 private:
  void blank() {
    if (at_ != line_.data()) *at_++ = ' ';
  }
  std::ostream& out_;
  std::array<char, 256> line_;
  char* at_ = line_.data();
};

void put(std::string& bytes, std::uint32_t bits, int count) {
  for (int i = 0; i < count; ++i) bytes += static_cast<char>(bits >> (8 * i) & 0xff);
}

// The nm value that a reader converts back to this radius, if one exists.
float nanometresOf(float um) {
  const auto back = [](float nm) { return static_cast<float>(static_cast<double>(nm) * 1e-3); };
  const float nm = static_cast<float>(static_cast<double>(um) * 1e3);
  const float up = std::nextafter(nm, std::numeric_limits<float>::infinity());
  const float down = std::nextafter(nm, 0.0F);
  for (const float candidate : {nm, up, down})
    if (back(candidate) == um) return candidate;
  return nm;
}

}  // namespace

void writeEdgeList(std::ostream& out, const CellGraph& cell) {
  const std::vector<std::int64_t> ids = distinctIds(cell);
  writeHeader(out, cell, {"# node id x y z radius type, um"});
  TextLines lines(out);
  for (std::uint32_t i = 0; i < cell.samples(); ++i)
    lines.word("node")
        .whole(ids[i])
        .point(cell, i)
        .radius(cell.radii_um[i], cell.oddRadius_um(i))
        .whole(cell.types[i])
        .end();
  for (const auto& [parent, child] : linksOf(cell)) lines.word("edge").whole(ids[parent]).whole(ids[child]).end();
}

void writeObj(std::ostream& out, const CellGraph& cell) {
  out << "# " << escaped(cell.name) << ", um\n";
  TextLines lines(out);
  for (std::uint32_t i = 0; i < cell.samples(); ++i) lines.word("v").point(cell, i).end();
  for (const auto& [parent, child] : linksOf(cell))
    lines.word("l").whole(std::uint64_t{parent} + 1).whole(std::uint64_t{child} + 1).end();
}

void writeVtk(std::ostream& out, const CellGraph& cell) {
  constexpr std::size_t kLongestTitle = 200;  // the format allows 256; escaping adds the rest
  const Links links = linksOf(cell);
  out << "# vtk DataFile Version 3.0\n"
      << escaped(cell.name, kLongestTitle / 4) << ", um\nASCII\nDATASET POLYDATA\nPOINTS " << cell.samples()
      << " double\n";
  TextLines lines(out);
  for (std::uint32_t i = 0; i < cell.samples(); ++i) lines.point(cell, i).end();
  out << "LINES " << links.size() << ' ' << 3 * links.size() << '\n';
  for (const auto& [parent, child] : links) lines.whole(2).whole(parent).whole(child).end();
  out << "POINT_DATA " << cell.samples() << '\n';
  if (!std::all_of(cell.radii_um.begin(), cell.radii_um.end(), [](float r) { return std::isnan(r); })) {
    out << "SCALARS radius float 1\nLOOKUP_TABLE default\n";
    for (const float radius : cell.radii_um) lines.radius(radius).end();
  }
  out << "SCALARS type unsigned_short 1\nLOOKUP_TABLE default\n";
  for (const std::uint16_t type : cell.types) lines.whole(type).end();
}

SkeletonFormat::SkeletonFormat(const Grid& grid, const GridBox& bounds) : grid_(grid), origin_(GridPoint::Zero()) {
  if (bounds.empty()) return;
  constexpr std::int64_t kMostQuanta = std::int64_t{1} << 24;  // whole numbers up to this are exact as 32-bit floats
  origin_ = bounds.lo + (bounds.hi - bounds.lo) / 2;
  if (((bounds.hi - origin_).array() > kMostQuanta).any() || ((origin_ - bounds.lo).array() > kMostQuanta).any())
    throw InputError(
        "these cells are too wide for Neuroglancer's 32-bit floats (2^25 quanta); write .edges or .vtk files "
        "instead");
}

std::string SkeletonFormat::info() const {
  const double quantum_nm = grid_.quantum_um() * 1e3;
  nlohmann::ordered_json transform = nlohmann::ordered_json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) transform.push_back(row == column ? quantum_nm : 0.0);
    transform.push_back(static_cast<double>(origin_[row]) * quantum_nm);
  }
  const nlohmann::ordered_json json{{"@type", "neuroglancer_skeletons"},
                                    {"transform", transform},
                                    {"vertex_attributes",
                                     {{{"id", "radius"}, {"data_type", "float32"}, {"num_components", 1}},
                                      {{"id", "vertex_types"}, {"data_type", "uint16"}, {"num_components", 1}}}},
                                    {"segment_properties", "segment_properties"}};
  return json.dump(1) + "\n";
}

std::string SkeletonFormat::properties(const std::vector<std::uint64_t>& ids, const std::vector<std::string>& names) {
  nlohmann::ordered_json texts = nlohmann::ordered_json::array();
  for (const std::uint64_t id : ids) texts.push_back(std::to_string(id));
  const nlohmann::ordered_json json{{"@type", "neuroglancer_segment_properties"},
                                    {"inline",
                                     {{"ids", texts},
                                      {"properties", nlohmann::ordered_json::array({nlohmann::ordered_json{
                                                         {"id", "label"}, {"type", "label"}, {"values", names}}})}}}};
  return json.dump(1, ' ', true, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

void SkeletonFormat::write(std::ostream& out, const CellGraph& cell) const {
  const Links links = linksOf(cell);
  std::string bytes;
  put(bytes, static_cast<std::uint32_t>(cell.samples()), 4);
  put(bytes, static_cast<std::uint32_t>(links.size()), 4);
  for (const GridPoint& point : cell.positions)
    for (int axis = 0; axis < 3; ++axis)
      put(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(point[axis] - origin_[axis])), 4);
  for (const auto& [parent, child] : links) {
    put(bytes, parent, 4);
    put(bytes, child, 4);
  }
  for (const float radius : cell.radii_um)
    put(bytes, std::bit_cast<std::uint32_t>(std::isnan(radius) ? radius : nanometresOf(radius)), 4);
  for (const std::uint16_t type : cell.types) put(bytes, type, 2);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace filiform
