#include "index/formats/internal/neurolucida.h"

#include "index/file/internal/byte_stream.h"
#include "index/formats/internal/graph_builder.h"
#include "index/formats/internal/soma_link.h"
#include "index/formats/internal/tree_joins.h"
#include "index/formats/swc/internal/swc_fields.h"
#include "index/text.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace filiform {
namespace {

using internal::RealKind;

constexpr std::int64_t kNoPoint = -1;
constexpr std::size_t kPointNumbers = 4;

struct AscToken {
  enum class Kind : std::uint8_t { kOpen, kClose, kBar, kSpine, kSpineEnd, kText, kWord, kEnd } kind = Kind::kEnd;
  std::string_view word;  // of kWord and kText; valid until the next token
  std::uint64_t line = 0;
};
using AscKind = AscToken::Kind;

class AscLexer {
 public:
  explicit AscLexer(internal::ByteStream& in) : in_(in) {}

  AscToken next() {
    if (std::exchange(again_, false)) return last_;
    return last_ = read();
  }
  // next() returns the last token once more.
  void putBack() { again_ = true; }

 private:
  AscToken read() {
    for (;;) {
      const int c = in_.peek();
      if (c == internal::ByteStream::kEnd) return {AscKind::kEnd, {}, in_.line()};
      if (c == ';') {
        while (in_.peek() != internal::ByteStream::kEnd && in_.peek() != '\n' && in_.peek() != '\r') in_.get();
      } else if (c <= ' ' || c == ',') {
        in_.get();
      } else {
        return readAt(c);
      }
    }
  }

  AscToken readAt(int c) {
    const std::uint64_t line = in_.line();
    switch (c) {
      case '(':
        return single(AscKind::kOpen, line);
      case ')':
        return single(AscKind::kClose, line);
      case '|':
        return single(AscKind::kBar, line);
      case '<':
        return single(AscKind::kSpine, line);
      case '>':
        return single(AscKind::kSpineEnd, line);
      case '"':
        in_.get();
        word_.clear();
        while ((c = in_.get()) != '"' && c != internal::ByteStream::kEnd)
          if (word_.size() < internal::ByteStream::kMaxToken) word_ += static_cast<char>(c);
        return {c == '"' ? AscKind::kText : AscKind::kEnd, word_, line};
      default:
        word_.clear();
        for (; c > ' ' && std::string_view("()|<>\";,").find(static_cast<char>(c)) == std::string_view::npos;
             c = in_.peek()) {
          if (word_.size() < internal::ByteStream::kMaxToken) word_ += static_cast<char>(c);
          in_.get();
        }
        return {AscKind::kWord, word_, line};
    }
  }

  AscToken single(AscKind kind, std::uint64_t line) {
    in_.get();
    return {kind, {}, line};
  }

  internal::ByteStream& in_;
  std::string word_;
  AscToken last_;
  bool again_ = false;
};

// A number as it may begin a point; words such as Color are not.
bool looksLikeNumber(std::string_view word) {
  double value = 0;
  return internal::readReal(word, value) != RealKind::kText;
}

// Whether a contour with this name is a soma: "Soma", "Cell Body 2".
bool namesSoma(std::string_view text) {
  std::string name = lowerCase(text);
  std::erase(name, ' ');
  for (const std::string_view soma : {"soma", "cellbody"})
    if (name.starts_with(soma) && (name.size() == soma.size() || name[soma.size()] < 'a' || name[soma.size()] > 'z'))
      return true;
  return false;
}

class AscReader {
 public:
  AscReader(internal::ByteStream& in, bool soma_links, internal::GraphBuilder& graph)
      : lexer_(in), soma_links_(soma_links), graph_(graph) {}

  void read() {
    bool any_list = false;
    for (;;) {
      const AscToken token = lexer_.next();
      if (token.kind == AscKind::kEnd) break;
      if (token.kind == AscKind::kOpen) {
        any_list = true;
        if (!readList(token.line)) return;
      } else if (token.kind == AscKind::kClose) {
        return fail(token.line, "this ')' closes nothing");
      } else if (!any_list) {
        return fail(token.line, "not Neurolucida: '(' must come first");
      }
    }
    if (!any_list) return fail(0, "not Neurolucida: holds no list");
    emit();
  }

 private:
  struct Point {
    Vector3d position;
    double diameter = 0;
    std::int64_t parent = kNoPoint;  // index in points_
    std::uint64_t line = 0;
    std::uint32_t bad = 0;  // 0: good; else one more than the index in bad_
    std::uint16_t type = 0;
  };
  struct BadPoint {
    InputCode code;
    std::string token;
  };
  struct Contour {
    std::uint64_t line = 0;
    std::int64_t id = 0;
    std::vector<Vector3d> points;
    double diameter = 0;  // of the first point
    internal::SomaSphere sphere;
  };
  // An open parenthesis of a tree.
  struct Branch {
    std::int64_t fork = kNoPoint, last = kNoPoint;  // points
    bool begins = true;                             // no point since the fork
  };
  // The outermost list that is open.
  struct TopList {
    std::uint64_t line = 0;
    std::size_t first_point = 0, first_bad = 0;
    std::optional<std::uint16_t> type = std::nullopt;  // 1: contour of a soma
    bool named = false, closed = false;
    bool soma_by_name = false;
    bool any_diameter = false;  // a point has four numbers
    std::vector<Branch> branches;
  };

  void fail(std::uint64_t line, std::string_view what) { graph_.refuse(InputCode::E_FORMAT, line, what); }

  // Reads a list from behind its '('. Returns false if the input is refused.
  bool readList(std::uint64_t line) {
    TopList list{.line = line, .first_point = points_.size(), .first_bad = bad_.size(), .branches = {{}}};
    while (!list.branches.empty()) {
      const AscToken token = lexer_.next();
      Branch& branch = list.branches.back();
      switch (token.kind) {
        case AscKind::kOpen:
          if (!readInner(list)) return false;
          break;
        case AscKind::kClose:
          list.branches.pop_back();
          break;
        case AscKind::kBar:
          if (list.branches.size() == 1) return fail(token.line, "'|' outside of branches"), false;
          branch.last = branch.fork;
          branch.begins = true;
          break;
        case AscKind::kSpine:
          graph_.remark(InputCode::W_ELEMENT, token.line, "spine");
          if (!skipTo(AscKind::kSpineEnd)) return fail(token.line, "this '<' is never closed"), false;
          break;
        case AscKind::kText:  // a name, or the text of a label, before or behind its place
          if (list.branches.size() == 1) {
            list.soma_by_name = list.soma_by_name || (!list.named && namesSoma(token.word));
            list.named = true;
          }
          break;
        case AscKind::kEnd:
          return fail(line, "this '(' is never closed"), false;
        default:  // a marker begins with a word; Normal, Incomplete, High ... follow points
          list.named = list.named || (list.branches.size() == 1 && points_.size() == list.first_point);
          break;
      }
    }
    close(list);
    return true;
  }

  // Reads what follows a '(' inside a list: a point, branches, a property or a marker.
  bool readInner(TopList& list) {
    const AscToken token = lexer_.next();
    if (token.kind == AscKind::kClose) return true;
    if (token.kind == AscKind::kWord && looksLikeNumber(token.word)) return readPoint(token, list);
    if (token.kind == AscKind::kWord || token.kind == AscKind::kText) return readProperty(token, list);
    if (token.kind == AscKind::kEnd) return fail(list.line, "this '(' is never closed"), false;
    const std::int64_t fork = list.branches.back().last;
    list.branches.push_back({fork, fork, true});
    lexer_.putBack();
    return true;
  }

  bool readPoint(AscToken token, TopList& list) {
    const std::uint64_t line = token.line;
    std::array<double, kPointNumbers> numbers{};
    numbers[3] = std::nan("");
    std::size_t count = 0;
    std::optional<BadPoint> bad;
    for (; token.kind == AscKind::kWord; token = lexer_.next()) {
      if (count == kPointNumbers) continue;  // as the `S2` of a section
      double value = 0;
      const RealKind kind = internal::readReal(token.word, value);
      if (count == 3) {
        numbers[count++] = kind == RealKind::kFinite ? value : -1;
      } else {
        if (kind != RealKind::kFinite && !bad)
          bad = {kind == RealKind::kText ? InputCode::W_BAD_LINE : InputCode::W_NONFINITE, std::string(token.word)};
        numbers[count++] = value;
      }
    }
    if (token.kind != AscKind::kClose) return fail(line, "this point has no ')'"), false;
    list.any_diameter = list.any_diameter || count == kPointNumbers;
    if (count < 3 && !bad) bad = {InputCode::W_SHORT_LINE, "point"};
    addPoint({numbers[0], numbers[1], numbers[2]}, numbers[3], line, std::move(bad), list.branches.back());
    return true;
  }

  void addPoint(const Vector3d& position, double diameter, std::uint64_t line, std::optional<BadPoint> bad,
                Branch& branch) {
    const bool first_of_branch = std::exchange(branch.begins, false) && branch.fork != kNoPoint;
    if (first_of_branch && !bad) {
      const Point& fork = points_[static_cast<std::size_t>(branch.fork)];
      if (fork.bad == 0 && fork.position == position) {
        graph_.mergePoint();
        return graph_.remark(InputCode::REPEATED_POINT, line, {});
      }
    }
    Point point{position, diameter, branch.last, line, 0, 0};
    if (bad) {
      bad_.push_back(std::move(*bad));
      point.bad = static_cast<std::uint32_t>(bad_.size());
    }
    branch.last = static_cast<std::int64_t>(points_.size());
    points_.push_back(point);
  }

  // Reads a list that begins with a word or a text, from behind it.
  bool readProperty(const AscToken& token, TopList& list) {
    const std::uint64_t line = token.line;
    const std::string word(token.kind == AscKind::kWord ? token.word : std::string_view());
    if (list.branches.size() == 1) {
      static constexpr std::pair<std::string_view, std::uint16_t> kTypes[] = {
          {"cellbody", 1}, {"soma", 1}, {"axon", 2}, {"dendrite", 3}, {"apical", 4}};
      const std::string lower = lowerCase(word);
      for (const auto& [name, type] : kTypes)
        if (lower == name) list.type = type;
      list.closed = list.closed || lower == "closed";
    }
    bool any_point = false;
    if (!skipTo(AscKind::kClose, &any_point)) return fail(line, "this list is never closed"), false;
    if (any_point) graph_.remark(InputCode::W_ELEMENT, line, word.empty() ? "list" : word);
    return true;
  }

  // Skips to the end of what is open. `any_point`: whether a list of four numbers was among it.
  bool skipTo(AscKind end, bool* any_point = nullptr) {
    std::uint64_t depth = 0;
    std::size_t numbers = 0;
    for (;;) {
      const AscToken token = lexer_.next();
      if (token.kind == AscKind::kEnd) return false;
      if (depth == 0 && token.kind == end) return true;
      if (token.kind == AscKind::kOpen) {
        ++depth;
        numbers = 0;
      } else if (token.kind == AscKind::kClose) {
        if (depth == 0) return false;
        --depth;
        if (any_point != nullptr) *any_point = *any_point || numbers >= kPointNumbers;
        numbers = 0;
      } else if (token.kind == AscKind::kWord) {
        numbers += looksLikeNumber(token.word);
      }
    }
  }

  // Decides what the list was, now that all of it is read.
  void close(const TopList& list) {
    const auto first = points_.begin() + static_cast<std::ptrdiff_t>(list.first_point);
    if (first == points_.end()) return;
    const std::size_t count = points_.size() - list.first_point;
    // A label "Soma" has one point. A tree has diameters.
    const bool contour = list.type == 1 || (!list.type && list.soma_by_name && (list.closed || count > 2));
    const bool element = !contour && !list.type && (list.named || list.closed || !list.any_diameter);
    if (!contour && !element) {
      for (auto point = first; point != points_.end(); ++point) point->type = list.type.value_or(0);
      if (!list.type) graph_.remark(InputCode::W_BAD_TYPE, list.line, "tree without Axon, Dendrite or Apical");
      for (std::size_t i = list.first_point; i < points_.size(); ++i) ids_.push_back(++last_id_);
      return;
    }
    if (element) {
      graph_.remark(InputCode::W_ELEMENT, list.line, count == 1 ? "text" : "contour");
    } else {
      addContour(list);
    }
    points_.resize(list.first_point);
    bad_.resize(list.first_bad);
  }

  void addContour(const TopList& list) {
    Contour contour{list.line, last_id_ + 1, {}, 0, {}};
    for (std::size_t i = list.first_point; i < points_.size(); ++i) {
      const Point& point = points_[i];
      ++last_id_;
      if (point.bad > 0) {
        const BadPoint& bad = bad_[point.bad - 1];
        graph_.dropNode(bad.code, point.line, bad.token);
        continue;
      }
      if (contour.points.empty()) contour.diameter = point.diameter;
      contour.points.push_back(point.position);
    }
    if (contour.points.empty()) return;
    graph_.remark(InputCode::SOMA_CONTOUR, list.line, {});
    for (std::size_t i = 1; i < contour.points.size(); ++i) graph_.mergePoint();
    contour.sphere = internal::sphereOfContour(contour.points);
    if (!contours_.empty()) {
      Contour& before = contours_.back();
      if ((before.sphere.centre - contour.sphere.centre).norm() <= before.sphere.radius + contour.sphere.radius) {
        graph_.mergePoint();
        if (before.points.size() >= kMostContourPoints) return;
        before.points.insert(before.points.end(), contour.points.begin(), contour.points.end());
        before.sphere = internal::sphereOfContour(before.points);
        return;
      }
    }
    contours_.push_back(std::move(contour));
  }

  internal::TreeJoins joinsOfTrees() const {
    internal::TreeJoins joins;
    std::vector<std::uint32_t> tree(points_.size());
    std::uint32_t trees = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Point& point = points_[i];
      if (point.parent != kNoPoint) {
        tree[i] = tree[static_cast<std::size_t>(point.parent)];
      } else {
        tree[i] = trees++;
        joins.begins(i, point.bad > 0 ? Vector3d::Constant(std::nan("")) : point.position);
      }
    }
    for (std::size_t i = 0; i < points_.size(); ++i)
      if (points_[i].parent != kNoPoint && points_[i].bad == 0) joins.inside(i, points_[i].position, tree[i]);
    return joins;
  }

  // A point that is dropped takes its link to its parent with it. The links of its children are cut.
  void emit() {
    const internal::TreeJoins joins = joinsOfTrees();
    internal::SomaLinks somata(graph_, soma_links_);
    for (const Contour& contour : contours_)
      somata.soma(contour.id, contour.sphere, contour.diameter / 2, contour.line);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Point& point = points_[i];
      if (point.bad > 0) {
        graph_.dropNode(bad_[point.bad - 1].code, point.line, bad_[point.bad - 1].token);
        continue;
      }
      if (joins.at(i) != i) {
        graph_.mergePoint();
        graph_.remark(InputCode::REPEATED_POINT, point.line, {});
        continue;
      }
      if (!graph_.node(ids_[i], point.position, point.diameter / 2, point.type, point.line, "point")) continue;
      if (point.parent != kNoPoint)
        graph_.link(ids_[i], ids_[joins.at(static_cast<std::size_t>(point.parent))], point.line);
      else
        somata.link(ids_[i], point.position, point.line);
    }
  }

  static constexpr std::size_t kMostContourPoints = 10000;  // of one soma; more change nothing that can be seen

  AscLexer lexer_;
  const bool soma_links_;
  internal::GraphBuilder& graph_;
  std::vector<Point> points_;      // of trees, and of the list that is open
  std::vector<std::int64_t> ids_;  // of the points of trees
  std::vector<BadPoint> bad_;
  std::vector<Contour> contours_;
  std::int64_t last_id_ = 0;
};

}  // namespace

void readNeurolucida(internal::ByteStream& in, bool soma_links, internal::GraphBuilder& graph) {
  AscReader(in, soma_links, graph).read();
}

}  // namespace filiform
