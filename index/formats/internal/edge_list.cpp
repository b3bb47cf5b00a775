#include "index/formats/internal/edge_list.h"

#include "index/file/internal/byte_stream.h"
#include "index/formats/internal/graph_builder.h"
#include "index/formats/swc/internal/swc_fields.h"

#include <array>
#include <cmath>

namespace filiform {
namespace {

using internal::IntegerKind;
using internal::RealKind;

constexpr std::size_t kMaxEdgeLine = SwcReader::kMaxDataLine;
constexpr std::size_t kMaxFields = 8;

struct Fields {
  std::array<std::string_view, kMaxFields> text;
  std::size_t count = 0;  // number of words; may exceed the array
};

Fields lineFields(std::string_view line) {
  Fields fields;
  std::size_t at = 0;
  for (;;) {
    while (at < line.size() && internal::isBlank(line[at])) ++at;
    if (at == line.size() || line[at] == '#') return fields;
    const std::size_t begin = at;
    while (at < line.size() && !internal::isBlank(line[at])) ++at;
    if (fields.count < kMaxFields) fields.text[fields.count] = line.substr(begin, at - begin);
    ++fields.count;
  }
}

// Reads an id. On failure, `why` is the reason.
bool readId(std::string_view token, std::int64_t& id, InputCode& why) {
  const IntegerKind kind = internal::readInteger(token, id);
  why = kind == IntegerKind::kText ? InputCode::W_BAD_LINE : InputCode::W_BAD_ID;
  return (kind == IntegerKind::kInteger || kind == IntegerKind::kIntegral) && id >= 0;
}

void readNode(const Fields& fields, std::uint64_t line, std::string_view text, internal::GraphBuilder& graph) {
  if (fields.count < 5) return graph.dropNode(InputCode::W_SHORT_LINE, line, text);
  std::int64_t id = 0;
  InputCode why{};
  if (!readId(fields.text[1], id, why)) return graph.dropNode(why, line, fields.text[1]);
  Vector3d position;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double value = 0;
    const RealKind kind = internal::readReal(fields.text[2 + axis], value);
    if (kind == RealKind::kText) return graph.dropNode(InputCode::W_BAD_LINE, line, fields.text[2 + axis]);
    position[static_cast<Eigen::Index>(axis)] = kind == RealKind::kFinite ? value : HUGE_VAL;
  }
  double radius = std::nan("");
  if (fields.count > 5) {
    const RealKind kind = internal::readReal(fields.text[5], radius);
    const bool unknown = fields.text[5] == "nan" || fields.text[5] == "NaN";
    if (kind != RealKind::kFinite) radius = unknown ? std::nan("") : -1;
  }
  std::int64_t type = 0;
  if (fields.count > 6) {
    const IntegerKind kind = internal::readInteger(fields.text[6], type);
    if ((kind != IntegerKind::kInteger && kind != IntegerKind::kIntegral) || type < 0 || type > 65535) {
      graph.remark(InputCode::W_BAD_TYPE, line, fields.text[6]);
      type = 0;
    }
  }
  if (fields.count > 7) graph.remark(InputCode::W_EXTRA_COLUMNS, line, {});
  graph.node(id, position, radius, static_cast<std::uint16_t>(type), line, text);
}

void readEdge(const Fields& fields, std::uint64_t line, std::string_view text, internal::GraphBuilder& graph) {
  if (fields.count < 3) return graph.cutLink(InputCode::W_SHORT_LINE, line, text);
  std::array<std::int64_t, 2> ends{};
  for (std::size_t i = 0; i < 2; ++i) {
    InputCode why{};
    if (!readId(fields.text[1 + i], ends[i], why))
      return graph.cutLink(InputCode::W_BAD_PARENT, line, fields.text[1 + i]);
  }
  if (fields.count > 3) graph.remark(InputCode::W_EXTRA_COLUMNS, line, {});
  graph.link(ends[0], ends[1], line);
}

}  // namespace

void readEdgeList(internal::ByteStream& in, internal::GraphBuilder& graph) {
  std::string_view text;
  bool too_long = false;
  // Lone CRs also end lines, so lines are counted here.
  for (std::uint64_t line = 1; in.readLine(text, kMaxEdgeLine, too_long); ++line) {
    const Fields fields = lineFields(text);
    if (fields.count == 0) continue;
    const bool edge = fields.text[0] == "edge";
    if (in.hasNul() || too_long) {
      const InputCode why = too_long ? InputCode::W_LONG_LINE : InputCode::W_NUL;
      edge ? graph.cutLink(why, line, text) : graph.dropNode(why, line, text);
    } else if (edge) {
      readEdge(fields, line, text, graph);
    } else if (fields.text[0] == "node") {
      readNode(fields, line, text, graph);
    } else {
      graph.dropNode(InputCode::W_BAD_LINE, line, fields.text[0]);
    }
  }
}

}  // namespace filiform
