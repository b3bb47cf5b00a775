#include "index/formats/internal/catmaid_table.h"

#include "index/file/internal/byte_stream.h"
#include "index/formats/internal/catmaid_columns.h"
#include "index/formats/internal/graph_builder.h"
#include "index/formats/swc/internal/swc_fields.h"
#include "index/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace filiform {
namespace {

using internal::CatmaidColumns;
using internal::IntegerKind;
using internal::RealKind;

constexpr std::string_view kLineMark = "#line ";

bool isNoParent(std::string_view value) {
  const std::string word = lowerCase(value);
  return word.empty() || word == "null" || word == "none" || word == "nan" || word == "\\n";
}

class TableReader {
 public:
  TableReader(const CatmaidColumns& columns, internal::GraphBuilder& graph) : columns_(columns), graph_(graph) {
    for (const std::size_t column : {columns.skeleton, columns.node, columns.parent, columns.x, columns.y, columns.z})
      fewest_ = std::max(fewest_, column + 1);
  }

  void row(std::string_view text, std::uint64_t line) {
    internal::splitRow(text, columns_.separator, values_);
    if (values_.size() < fewest_) return graph_.dropNode(InputCode::W_SHORT_LINE, line, text);
    if (values_[columns_.skeleton].empty()) return graph_.dropNode(InputCode::W_BAD_LINE, line, "no skeleton_id");
    std::int64_t id = 0;
    const IntegerKind kind = internal::readInteger(values_[columns_.node], id);
    if (kind == IntegerKind::kText) return graph_.dropNode(InputCode::W_BAD_LINE, line, values_[columns_.node]);
    if ((kind != IntegerKind::kInteger && kind != IntegerKind::kIntegral) || id < 0)
      return graph_.dropNode(InputCode::W_BAD_ID, line, values_[columns_.node]);
    Vector3d position;
    const std::array<std::size_t, 3> places = {columns_.x, columns_.y, columns_.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double& value = position[static_cast<Eigen::Index>(axis)];
      const RealKind real = internal::readReal(values_[places[axis]], value);
      if (real == RealKind::kText) return graph_.dropNode(InputCode::W_BAD_LINE, line, values_[places[axis]]);
      if (real == RealKind::kNonfinite) value = std::nan("");  // node() drops it
    }
    if (!graph_.node(id, position, radius(line), 0, line, values_[columns_.node])) return;
    if (kind == IntegerKind::kIntegral) graph_.remark(InputCode::W_FLOAT_ID, line, values_[columns_.node]);
    link(id, line);
  }

 private:
  double radius(std::uint64_t line) {
    if (columns_.radius >= values_.size() || isNoParent(values_[columns_.radius])) return std::nan("");
    double radius = 0;
    if (internal::readReal(values_[columns_.radius], radius) == RealKind::kFinite) return radius;
    graph_.remark(InputCode::W_BAD_RADIUS, line, values_[columns_.radius]);
    return std::nan("");
  }

  void link(std::int64_t id, std::uint64_t line) {
    const std::string_view value = values_[columns_.parent];
    if (isNoParent(value)) return;
    std::int64_t parent = 0;
    const IntegerKind kind = internal::readInteger(value, parent);
    if (kind != IntegerKind::kInteger && kind != IntegerKind::kIntegral)
      return graph_.cutLink(InputCode::W_BAD_PARENT, line, value);
    if (parent >= 0) return graph_.link(id, parent, line);
    if (parent != -1) graph_.remark(InputCode::W_ROOT_CODE, line, value);
  }

  const CatmaidColumns columns_;
  internal::GraphBuilder& graph_;
  std::size_t fewest_ = 0;
  std::vector<std::string_view> values_;
};

}  // namespace

void readCatmaid(internal::ByteStream& in, internal::GraphBuilder& graph) {
  std::string_view text;
  bool too_long = false;
  if (!in.readLine(text, SwcReader::kMaxDataLine, too_long)) return;
  const CatmaidColumns columns = CatmaidColumns::of(text);
  if (!columns.isWhole())
    return graph.refuse(InputCode::E_FORMAT, 1, "a table of CATMAID without the columns " + columns.missing());
  TableReader rows(columns, graph);
  for (std::uint64_t line = 2; in.readLine(text, SwcReader::kMaxDataLine, too_long); ++line) {
    if (text.starts_with(kLineMark)) {
      std::from_chars(text.data() + kLineMark.size(), text.data() + text.size(), line);
      --line;
    } else if (too_long) {
      graph.dropNode(InputCode::W_LONG_LINE, line, text);
    } else if (in.hasNul()) {
      graph.dropNode(InputCode::W_NUL, line, text);
    } else if (text.find_first_not_of(" \t\r") != std::string_view::npos && !text.starts_with('#')) {
      rows.row(text, line);
    }
  }
}

}  // namespace filiform
