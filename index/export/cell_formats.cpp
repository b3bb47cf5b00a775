#include "index/export/cell_formats.h"

#include "index/file/internal/decimals.h"
#include "index/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <concepts>
#include <ostream>
#include <string_view>
#include <vector>

namespace filiform {

namespace {

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
  for (const auto& [parent, child] : parentLinks(cell)) lines.word("edge").whole(ids[parent]).whole(ids[child]).end();
}

void writeObj(std::ostream& out, const CellGraph& cell) {
  out << "# " << escaped(cell.name) << ", um\n";
  TextLines lines(out);
  for (std::uint32_t i = 0; i < cell.samples(); ++i) lines.word("v").point(cell, i).end();
  for (const auto& [parent, child] : parentLinks(cell))
    lines.word("l").whole(std::uint64_t{parent} + 1).whole(std::uint64_t{child} + 1).end();
}

void writeVtk(std::ostream& out, const CellGraph& cell) {
  constexpr std::size_t kLongestTitle = 200;  // the format allows 256; escaping adds the rest
  const std::vector<std::array<std::uint32_t, 2>> links = parentLinks(cell);
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

}  // namespace filiform
