#include "index/query/cell_graph.h"

#include "index/file/internal/decimals.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <ostream>

namespace filiform {
namespace {

std::string hexEscaped(const std::string& bytes) {
  std::string text;
  for (unsigned char c : bytes) {
    if (c >= 0x20 && c != 0x7F) {
      text += static_cast<char>(c);
      continue;
    }
    char code[8];
    std::snprintf(code, sizeof code, "\\x%02X", static_cast<unsigned>(c));
    text += code;
  }
  return text;
}

class Line {
 public:
  void number(auto value) {
    blank();
    at_ = std::to_chars(at_, text_ + sizeof text_, value).ptr;
  }
  void coordinate(double um, const Grid& grid) {
    blank();
    at_ = internal::putCoordinate(at_, um, grid);
  }
  void radius(const CellGraph& cell, std::uint32_t rank) {
    blank();
    const double odd_um = cell.oddRadius_um(rank);
    at_ = std::isnan(odd_um) ? internal::putRadius(at_, cell.radii_um[rank]) : internal::putRadius(at_, odd_um);
  }
  void writeTo(std::ostream& out) {
    *at_++ = '\n';
    out.write(text_, at_ - text_);
    at_ = text_;
  }

 private:
  void blank() {
    if (at_ != text_) *at_++ = ' ';
  }
  char text_[512];
  char* at_ = text_;
};

}  // namespace

std::vector<std::array<std::uint32_t, 2>> parentLinks(const CellGraph& cell) {
  std::vector<std::array<std::uint32_t, 2>> links;
  for (const auto& [child, parent] : cell.links)
    if (child != parent) links.push_back({parent, child});
  for (std::uint32_t i = 0; !cell.isGraph() && i < cell.samples(); ++i)
    if (cell.parents[i] != kNoParent) links.push_back({cell.parents[i], i});
  return links;
}

std::vector<std::int64_t> distinctIds(const CellGraph& cell) { return distinctIds(cell.sample_ids, cell.block_starts); }

void writeHeader(std::ostream& out, const CellGraph& cell, const std::vector<std::string>& lines) {
  const std::string between = '\n' + cell.header + '\n';
  if (!cell.header.empty()) out << cell.header << '\n';
  for (const std::string& line : lines)
    if (between.find('\n' + line + '\n') == std::string::npos) out << line << '\n';
}

void writeSwc(std::ostream& out, const CellGraph& cell) {
  if (cell.isGraph())
    throw InputError("'" + hexEscaped(cell.name) +
                     "' has loops, which SWC cannot hold; write an edge list instead, such as " + "-o cell.edges");
  writeHeader(
      out, cell,
      {"# " + hexEscaped(cell.name), "# source: " + hexEscaped(cell.source), "# id type x y z radius parent, um"});
  const std::vector<std::int64_t> ids = distinctIds(cell);
  if (ids != cell.sample_ids)
    out << "# ids began again in the source at " << cell.block_starts.size()
        << " place(s); from there on they are renumbered past the highest before\n";
  Line line;
  for (std::uint32_t i = 0; i < cell.samples(); ++i) {
    const Vector3d p_W = cell.position_W(i);
    line.number(ids[i]);
    line.number(cell.types[i]);
    for (int axis = 0; axis < 3; ++axis) line.coordinate(p_W[axis], cell.grid);
    if (std::isnan(cell.radii_um[i])) {
      line.number(0);
    } else {
      line.radius(cell, i);
    }
    line.number(cell.parents[i] == kNoParent ? std::int64_t{-1} : ids[cell.parents[i]]);
    line.writeTo(out);
  }
}

}  // namespace filiform
