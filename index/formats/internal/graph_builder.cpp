#include "index/formats/internal/graph_builder.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace filiform::internal {

GraphBuilder::GraphBuilder(const SwcOptions& options) : options_(options) { options.check(); }

float GraphBuilder::radiusFrom(double radius, std::uint64_t line, std::string_view token) {
  if (std::isnan(radius)) return kUnknownRadius;
  const float radius_um = storedRadius(radius * options_.radius_um());
  if (!(radius >= 0) || !std::isfinite(radius_um)) {
    book_.remark(InputCode::W_BAD_RADIUS, line, token);
    return kUnknownRadius;
  }
  if (radius == 0) book_.remark(InputCode::W_ZERO_RADIUS, line);
  return radius_um;
}

bool GraphBuilder::node(std::int64_t id, const Vector3d& position, double radius, std::uint16_t type,
                        std::uint64_t line, std::string_view token) {
  ++candidates_;
  const auto drop = [&](InputCode code) {
    book_.dropLine(code, line, token);
    return false;
  };
  if (!position.allFinite()) return drop(InputCode::W_NONFINITE);
  const Vector3d position_um = options_.toMicrometres(position);
  if ((position.array().abs() > Grid::kMaxInput_um).any() ||
      !(position_um.array().abs() <= Grid::kMaxCoordinate_um).all())
    return drop(InputCode::W_RANGE);
  if (ids_.find(id) != IdTable::kNone) return drop(InputCode::W_DUP_ID);
  if (cell_.samples() + links_.size() >= UINT32_MAX - 1)
    throw InputError("more than 2^32-2 nodes and links in one graph");
  ids_.insert(id, static_cast<std::uint32_t>(cell_.samples()));
  cell_.sample_ids.push_back(id);
  cell_.positions_um.push_back(position_um);
  if (const double radius_um = radius * options_.radius_um(); isOddRadius(radius_um))
    cell_.odd_radii.push_back({static_cast<std::uint32_t>(cell_.radii_um.size()), radius_um});
  cell_.radii_um.push_back(radiusFrom(radius, line, token));
  cell_.types.push_back(type);
  return true;
}

void GraphBuilder::dropNode(InputCode code, std::uint64_t line, std::string_view token) {
  ++candidates_;
  ++unreadable_;
  book_.dropLine(code, line, token);
}

void GraphBuilder::link(std::int64_t a, std::int64_t b, std::uint64_t line) {
  if (cell_.samples() + links_.size() >= UINT32_MAX - 1)
    throw InputError("more than 2^32-2 nodes and links in one graph");
  ++links_given_;
  links_.push_back({a, b, line});
}

void GraphBuilder::cutLink(InputCode code, std::uint64_t line, std::string_view token) {
  ++links_given_;
  book_.cutLink(code, line, token);
}

void GraphBuilder::refuse(InputCode code, std::uint64_t line, std::string_view token) {
  if (refused_) return;
  refused_ = true;
  book_.clear();
  book_.refuse(code, line, token);
  cell_.clearSamples();
  ids_.clear();
  links_.clear();
  candidates_ = unreadable_ = links_given_ = merged_ = 0;
}

void GraphBuilder::setRadius(std::int64_t id, double radius, std::uint64_t line) {
  const std::uint32_t rank = ids_.find(id);
  if (rank == IdTable::kNone) return;
  if (std::isnan(radius)) radius = -1;  // stated but unusable
  cell_.radii_um[rank] = radiusFrom(radius, line, {});
}

void GraphBuilder::setType(std::int64_t id, std::uint16_t type) {
  const std::uint32_t rank = ids_.find(id);
  if (rank != IdTable::kNone) cell_.types[rank] = type;
}

InputReport GraphBuilder::finish(std::string_view file, Cell& cell) {
  InputReport report;
  std::vector<std::array<std::uint32_t, 2>> edges;
  edges.reserve(links_.size());
  std::vector<std::uint8_t> linked(cell_.samples(), 0);
  for (const Link& link : links_) {
    const std::uint32_t a = ids_.find(link.a), b = ids_.find(link.b);
    const auto token = [&] { return std::to_string(link.a) + " " + std::to_string(link.b); };
    if (a == IdTable::kNone || b == IdTable::kNone) {
      book_.cutLink(InputCode::W_MISSING_PARENT, link.line, token());
    } else if (a == b) {
      book_.cutLink(InputCode::W_SELF_PARENT, link.line, token());
    } else {
      edges.push_back({a, b});
      linked[a] = linked[b] = 1;
    }
  }
  links_ = {};
  report.samples = cell_.samples();
  report.segments = edges.size();
  report.isolated = static_cast<std::uint64_t>(std::count(linked.begin(), linked.end(), 0));
  connect(cell_, std::move(edges));
  std::vector<std::uint8_t> is_child(cell_.samples(), 0);
  for (std::uint32_t s = 0; s < cell_.segmentRanks(); ++s) {
    const auto [child, parent] = cell_.ends(s);
    if (child != parent) is_child[child] = 1;
  }
  report.roots = static_cast<std::uint64_t>(std::count(is_child.begin(), is_child.end(), 0));

  if (!refused_) {
    if (report.samples == 0) {
      book_.refuse(InputCode::E_NO_SAMPLES);
    } else if (isMostlyBad(candidates_, unreadable_, report.samples + merged_)) {
      book_.refuse(InputCode::E_MOSTLY_BAD);
    }
  }
  report.candidate_lines = candidates_;
  report.links_given = links_given_;
  report.merged_points = merged_;
  book_.moveTo(report);
  report.dropped_lines = report.records.count(Effect::kLineDropped);
  report.links_cut = report.records.count(Effect::kLinkCut);
  if (report.candidate_lines != report.samples + report.dropped_lines + report.merged_points ||
      report.links_given != report.segments + report.links_cut)
    throw ConservationError(inShort(file) +
                            ": nodes or links were lost without a record; please report this with the "
                            "file");
  const bool refuse = report.codes.anyRefusal() || (options_.strict && report.codes.anyWarning());
  report.severity = refuse ? Severity::kRefuse : report.codes.anyWarning() ? Severity::kWarn : Severity::kAccept;
  if (refuse) {
    report.samples = report.segments = report.isolated = report.roots = 0;
    cell_.clearSamples();
  }
  cell.sample_ids = std::move(cell_.sample_ids);
  cell.positions_um = std::move(cell_.positions_um);
  cell.parents = std::move(cell_.parents);
  cell.links = std::move(cell_.links);
  cell.radii_um = std::move(cell_.radii_um);
  cell.types = std::move(cell_.types);
  cell.odd_radii = std::move(cell_.odd_radii);
  cell.block_starts.clear();
  cell.line_runs.clear();
  cell.header.clear();
  cell.name.clear();
  return report;
}

}  // namespace filiform::internal
