#include "index/formats/internal/nml.h"

#include "index/file/internal/byte_stream.h"
#include "index/formats/internal/graph_builder.h"
#include "index/formats/swc/internal/swc_fields.h"
#include "index/text.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <pugixml.hpp>
#include <unordered_map>

namespace filiform {
namespace {

using internal::IntegerKind;
using internal::RealKind;

// pugixml expands only character references and the five entities of XML, and resolves nothing outside the text.
constexpr unsigned kParse = pugi::parse_default | pugi::parse_fragment;
constexpr std::uint64_t kNodeBytes = 72, kAttributeBytes = 40, kSlackBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kMostLeftOut = std::uint64_t{1} << 24;  // more than a file of NmlOutline::kMostBytes can have

// Empty, or why the text is not parsed: it would take far more memory than text of this format does.
std::string refusedFor(std::string_view text) {
  std::uint64_t bytes = 0;
  for (const char c : text) bytes += c == '<' ? kNodeBytes : c == '=' ? kAttributeBytes : 0;
  return bytes > 8 * text.size() + kSlackBytes ? "XML of too many elements" : "";
}

pugi::xml_parse_result parseXml(std::string_view text, pugi::xml_document& document) {
  return document.load_buffer(text.data(), text.size(), kParse, pugi::encoding_utf8);
}

bool readXmlId(const pugi::xml_attribute& attribute, std::int64_t& id) {
  const IntegerKind kind = internal::readInteger(attribute.value(), id);
  return kind == IntegerKind::kInteger || kind == IntegerKind::kIntegral;
}

// um of one unit; nullopt for a unit that is not known.
std::optional<double> unitOf(std::string_view unit) {
  struct Unit {
    std::string_view name;
    double um;
  };
  static constexpr Unit kUnits[] = {{"", 1e-3},          {"nm", 1e-3},       {"nanometer", 1e-3}, {"um", 1},
                                    {"micrometer", 1},   {"mm", 1e3},        {"millimeter", 1e3}, {"pm", 1e-6},
                                    {"picometer", 1e-6}, {"angstrom", 1e-4}, {"m", 1e6},          {"meter", 1e6}};
  for (const Unit& known : kUnits)
    if (known.name == unit) return known.um;
  return std::nullopt;
}

// The values x, y and z of an element; nullopt unless all are finite numbers.
std::optional<Vector3d> vectorOf(const pugi::xml_node& element) {
  Vector3d place;
  const char* const names[] = {"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis)
    if (internal::readReal(element.attribute(names[axis]).value(), place[axis]) != RealKind::kFinite)
      return std::nullopt;
  return place;
}

class TreeReader {
 public:
  TreeReader(const pugi::xml_document& document, const SwcOptions& options, internal::GraphBuilder& graph)
      : document_(document), options_(options), graph_(graph) {}

  void read() {
    const pugi::xml_node parameters = document_.child("parameters");
    if (!readScale(parameters.child("scale"))) return;
    if (const auto offset = vectorOf(parameters.child("offset")); offset && *offset != Vector3d::Zero()) {
      if (options_.apply_offset)
        offset_ = *offset;
      else
        graph_.remark(InputCode::W_HEADER_SCALE, 0, "offset");
    }
    std::uint64_t place = 0;
    const pugi::xml_node thing = document_.child("thing");
    for (const pugi::xml_node& nodes : thing.children("nodes"))
      for (const pugi::xml_node& node : nodes.children("node")) readNode(node, ++place);
    place = 0;
    for (const pugi::xml_node& edges : thing.children("edges"))
      for (const pugi::xml_node& edge : edges.children("edge")) readEdge(edge, ++place);
    const pugi::xml_node left_out = document_.child("left_out");
    for (const char* const what : {"comment", "branchpoint"})
      for (std::uint64_t i = std::min<std::uint64_t>(left_out.attribute(what).as_ullong(), kMostLeftOut); i > 0; --i)
        graph_.remark(InputCode::W_ELEMENT, 0, what);
  }

 private:
  bool readScale(const pugi::xml_node& scale) {
    if (!scale) {
      if (options_.isMicrometres()) {
        graph_.refuse(InputCode::E_FORMAT, 0, "no scale; give the voxel size by --unit");
        return false;
      }
      scale_um_ = options_.toMicrometres(Vector3d::Ones());
      radius_um_ = options_.radius_um();
      return true;
    }
    const std::optional<Vector3d> size = vectorOf(scale);
    const std::optional<double> unit = unitOf(scale.attribute("unit").value());
    if (!unit) {
      graph_.refuse(InputCode::E_FORMAT, 0, "unknown unit of scale: " + std::string(scale.attribute("unit").value()));
    } else if (!size || !(size->array() > 0).all()) {
      graph_.refuse(InputCode::E_FORMAT, 0, "NML whose scale is no size of a voxel");
    } else {
      scale_um_ = *size * *unit;
      radius_um_ = scale_um_.x();
    }
    return !graph_.refused();
  }

  void readNode(const pugi::xml_node& node, std::uint64_t place) {
    const pugi::xml_attribute id_text = node.attribute("id");
    std::int64_t id = 0;
    for (const char* const name : {"id", "x", "y", "z"})
      if (!node.attribute(name))
        return graph_.dropNode(InputCode::W_SHORT_LINE, place, "node without " + std::string(name));
    if (!readXmlId(id_text, id) || id < 0) return graph_.dropNode(InputCode::W_BAD_ID, place, id_text.value());
    Vector3d position;
    const char* const names[] = {"x", "y", "z"};
    for (int axis = 0; axis < 3; ++axis) {
      const char* const text = node.attribute(names[axis]).value();
      const RealKind kind = internal::readReal(text, position[axis]);
      if (kind == RealKind::kText) return graph_.dropNode(InputCode::W_BAD_LINE, place, text);
      if (kind == RealKind::kNonfinite) position[axis] = std::nan("");  // node() drops it
    }
    double radius = std::nan("");
    if (const pugi::xml_attribute text = node.attribute("radius")) {
      if (internal::readReal(text.value(), radius) != RealKind::kFinite) {
        radius = std::nan("");
        graph_.remark(InputCode::W_BAD_RADIUS, place, text.value());
      }
    }
    graph_.node(id, (position + offset_).cwiseProduct(scale_um_), radius * radius_um_, 0, place, id_text.value());
  }

  void readEdge(const pugi::xml_node& edge, std::uint64_t place) {
    std::int64_t source = 0, target = 0;
    if (readXmlId(edge.attribute("source"), source) && readXmlId(edge.attribute("target"), target))
      graph_.link(target, source, place);
    else
      graph_.cutLink(InputCode::W_BAD_PARENT, place, "edge");
  }

  const pugi::xml_document& document_;
  const SwcOptions& options_;
  internal::GraphBuilder& graph_;
  Vector3d scale_um_ = Vector3d::Ones(), offset_ = Vector3d::Zero();
  double radius_um_ = 1;
};

// The name of an XML format by its first element.
std::string formatOfXml(const pugi::xml_document& document) {
  std::string_view root = document.document_element().name();
  root = root.substr(root.rfind(':') + 1);  // npos + 1 is 0
  if (root == "neuroml" || root == "networkml") return "NeuroML";
  if (root == "morphml") return "MorphML";
  if (root == "mbf") return "Neurolucida XML";
  if (root == "tracings") return "SNT traces";
  return root.empty() ? "no XML" : "XML of <" + escaped(root, 40) + ">";
}

}  // namespace

internal::NmlOutline internal::outlineOfNml(std::string_view text) {
  NmlOutline outline;
  const std::size_t mark = text.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  outline.wrong = refusedFor(text);
  if (!outline.wrong.empty()) return outline;
  pugi::xml_document document;
  const pugi::xml_parse_result result = parseXml(text.substr(mark), document);
  const pugi::xml_node things = document.child("things");
  if (!things) {
    outline.wrong = formatOfXml(document) +
                    ", not the NML of KNOSSOS or webKnossos; convert the file to SWC with the "
                    "program that wrote it";
    return outline;
  }
  if (!result) {
    outline.wrong = "byte " + std::to_string(static_cast<std::uint64_t>(result.offset) + mark + 1) +
                    ": not valid XML (" + result.description() + "); is the file cut short?";
    return outline;
  }
  const std::size_t end = std::min(text.rfind("</things"), text.size());
  const auto begin = [&](const pugi::xml_node& element) {
    return static_cast<std::uint64_t>(element.offset_debug()) - 1 + mark;
  };
  const auto bytes = [&](const pugi::xml_node& element) {
    pugi::xml_node next = element.next_sibling();
    while (next && next.type() != pugi::node_element) next = next.next_sibling();
    const std::uint64_t from = begin(element), to = next ? begin(next) : end;
    return to > from ? to - from : 0;
  };
  std::unordered_map<std::int64_t, std::uint64_t> comments, branch_points;
  const auto count = [](const pugi::xml_node& list, const char* element, const char* attribute, auto& counts) {
    for (const pugi::xml_node& one : list.children(element)) {
      std::int64_t id = 0;
      if (readXmlId(one.attribute(attribute), id)) ++counts[id];
    }
  };
  for (const pugi::xml_node& list : things.children("comments")) count(list, "comment", "node", comments);
  for (const pugi::xml_node& list : things.children("branchpoints")) count(list, "branchpoint", "id", branch_points);
  if (const pugi::xml_node parameters = things.child("parameters")) {
    outline.parameters_at = begin(parameters);
    outline.parameters_bytes = bytes(parameters);
  }
  for (const pugi::xml_node& thing : things.children("thing")) {
    NmlTree& tree = outline.trees.emplace_back();
    tree.name = thing.attribute("name").value();
    if (tree.name.empty()) tree.name = thing.attribute("id").value();
    if (tree.name.empty()) tree.name = "tree " + std::to_string(outline.trees.size());
    tree.at = begin(thing);
    tree.bytes = bytes(thing);
    if (comments.empty() && branch_points.empty()) continue;
    for (const pugi::xml_node& nodes : thing.children("nodes"))
      for (const pugi::xml_node& node : nodes.children("node")) {
        std::int64_t id = 0;
        if (!readXmlId(node.attribute("id"), id)) continue;
        if (const auto found = comments.find(id); found != comments.end()) tree.comments += found->second;
        if (const auto found = branch_points.find(id); found != branch_points.end())
          tree.branch_points += found->second;
      }
  }
  return outline;
}

std::string internal::leftOutOfNml(const NmlTree& tree) {
  return "<left_out comment=\"" + std::to_string(tree.comments) + "\" branchpoint=\"" +
         std::to_string(tree.branch_points) + "\"/>";
}

void readNml(internal::ByteStream& in, const SwcOptions& options, internal::GraphBuilder& graph) {
  std::string text;
  for (int c = in.get(); c != internal::ByteStream::kEnd; c = in.get()) text += static_cast<char>(c);
  if (const std::string wrong = refusedFor(text); !wrong.empty()) return graph.refuse(InputCode::E_FORMAT, 0, wrong);
  pugi::xml_document document;
  if (!parseXml(text, document) || !document.child("thing"))
    return graph.refuse(InputCode::E_FORMAT, 0, "not the NML of KNOSSOS or webKnossos");
  TreeReader(document, options, graph).read();
}

}  // namespace filiform
