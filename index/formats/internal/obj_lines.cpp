#include "index/formats/internal/obj_lines.h"

#include "index/file/internal/byte_stream.h"
#include "index/formats/internal/graph_builder.h"
#include "index/formats/swc/internal/swc_fields.h"

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>

namespace filiform {
namespace {

using internal::RealKind;

constexpr std::array<std::string_view, 10> kElements = {"f",    "p",   "curv", "curv2", "surf",
                                                        "call", "bzp", "cdc",  "cdp",   "fo"};
constexpr std::size_t kMaxObjLine = SwcReader::kMaxDataLine;

class ObjReader {
 public:
  ObjReader(internal::ByteStream& in, internal::GraphBuilder& graph) : in_(in), graph_(graph) {}

  void read() {
    std::string_view token;
    while (in_.readToken(token, true)) {
      line_ = in_.line();
      if (token == "v") {
        readNode();
      } else if (token == "l") {
        readLinks();
      } else {
        for (const std::string_view element : kElements)
          if (token == element) graph_.remark(InputCode::W_ELEMENT, line_, element);
      }
      skipLine();
    }
  }

 private:
  // Skips the rest of the line and of its continuation lines.
  void skipLine() {
    std::string_view rest;
    bool too_long = false;
    while (in_.readLine(rest, kMaxObjLine, too_long) && rest.ends_with('\\') && !too_long) {
    }
  }

  // Reads the next word of the line; a `\` at its end continues the line.
  bool word(std::string_view& token) {
    while (in_.readToken(token, false)) {
      if (token.starts_with('#')) return false;
      if (token != "\\") return true;
      skipEnd();
    }
    return false;
  }
  void skipEnd() {
    while (in_.peek() == ' ' || in_.peek() == '\t') in_.get();
    if (in_.peek() == '\r') in_.get();
    if (in_.peek() == '\n') in_.get();
  }

  void readNode() {
    const std::int64_t id = ++nodes_;
    Vector3d position;
    for (int axis = 0; axis < 3; ++axis) {
      std::string_view token;
      if (!word(token)) return graph_.dropNode(InputCode::W_SHORT_LINE, line_, "v");
      if (in_.hasNul()) return graph_.dropNode(InputCode::W_NUL, line_, token);
      double value = 0;
      const RealKind kind = internal::readReal(token, value);
      if (kind == RealKind::kText) return graph_.dropNode(InputCode::W_BAD_LINE, line_, token);
      position[axis] = kind == RealKind::kFinite ? value : HUGE_VAL;
    }
    graph_.node(id, position, std::nan(""), 0, line_, "v " + std::to_string(id));
  }

  // The node's id; nullopt if the word names no node.
  std::optional<std::int64_t> nodeOf(std::string_view token) const {
    token = token.substr(0, token.find('/'));
    std::int64_t number = 0;
    const char* const end = token.data() + token.size();
    const auto [stop, error] = std::from_chars(token.data(), end, number);
    if (error != std::errc() || stop != end || number == 0) return std::nullopt;
    if (number > 0) return number;
    return number >= -nodes_ ? std::optional(nodes_ + 1 + number) : std::nullopt;
  }

  void readLinks() {
    std::string_view token;
    std::optional<std::int64_t> before;
    std::uint64_t ends = 0;
    for (; word(token); ++ends) {
      const std::optional<std::int64_t> here = nodeOf(token);
      if (ends > 0) {
        if (before && here) {
          graph_.link(*before, *here, line_);
        } else {
          graph_.cutLink(InputCode::W_BAD_PARENT, line_, token);
        }
      }
      before = here;
    }
    if (ends < 2) graph_.cutLink(InputCode::W_SHORT_LINE, line_, "l");
  }

  internal::ByteStream& in_;
  internal::GraphBuilder& graph_;
  std::int64_t nodes_ = 0;
  std::uint64_t line_ = 0;
};

}  // namespace

void readObjLines(internal::ByteStream& in, internal::GraphBuilder& graph) { ObjReader(in, graph).read(); }

}  // namespace filiform
