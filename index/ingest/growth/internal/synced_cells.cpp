#include "index/ingest/growth/internal/synced_cells.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <unordered_set>
#include <utility>

namespace filiform {

std::string_view name(SyncFate fate) {
  static constexpr std::string_view kNames[] = {"new", "changed", "equal", "removed", "gone", "held"};
  return kNames[static_cast<std::size_t>(fate)];
}

}  // namespace filiform

namespace filiform::internal {
namespace {

std::uint64_t linksOf(const Cell& cell) {
  std::uint64_t links = 0;
  if (cell.isGraph())
    for (const auto& [child, parent] : cell.links) links += child != parent ? 1 : 0;
  else
    for (const std::uint32_t parent : cell.parents) links += parent != kNoParent ? 1 : 0;
  return links;
}

// True if one of the names is that of the source, or of an archive around it.
bool isIn(const std::unordered_set<std::string>& names, const std::string& source) {
  if (names.contains(source)) return true;
  for (std::size_t slash = source.find('/'); slash != std::string::npos; slash = source.find('/', slash + 1))
    if (names.contains(source.substr(0, slash))) return true;
  return false;
}

}  // namespace

SyncedCells::SyncedCells(CellStream& cells, const TileSet& base)
    : cells_(cells), base_(base), equal_(base.cell_count(), false), removed_(base.cell_count(), false) {
  for (std::uint32_t c = 0; c < base.cell_count(); ++c)
    if (!base.cell(c).removed) open_[base.cell(c).source].push_back(c);
}

bool SyncedCells::any() {
  if (waiting_) return true;
  Cell cell;
  if (!next(cell)) return false;
  waiting_ = std::move(cell);
  return true;
}

bool SyncedCells::next(Cell& cell) {
  if (waiting_) {
    cell = std::move(*waiting_);
    waiting_.reset();
    return true;
  }
  while (cells_.next(cell)) {
    const auto known = open_.find(cell.source);
    const auto [fate, is_first] =
        fates_.try_emplace(cell.source, known == open_.end() ? SyncFate::kNew : SyncFate::kEqual);
    if (const auto id = takeEqual(cell)) {
      equal_[*id] = true;
      ++counts_.equal;
      if (!cell.name.empty()) given_[*id] = cell.name;
      if (!cell.attributes.empty()) attributes_[*id] = std::move(cell.attributes);
      continue;
    }
    if (known != open_.end()) fate->second = SyncFate::kChanged;
    passed_.push_back({cell.source, cell.name, cell.digest, kNoCell});
    return true;
  }
  return false;
}

std::optional<std::uint32_t> SyncedCells::takeEqual(const Cell& cell) {
  const auto found = open_.find(cell.source);
  if (found == open_.end()) return std::nullopt;
  std::vector<std::uint32_t>& ids = found->second;
  const auto same = std::find_if(ids.begin(), ids.end(), [&](std::uint32_t id) { return isEqual(id, cell); });
  if (same == ids.end()) return std::nullopt;
  const std::uint32_t id = *same;
  ids.erase(same);
  return id;
}

bool SyncedCells::isEqual(std::uint32_t id, const Cell& cell) const {
  const CellRecord& record = base_.cell(id);
  if (base_.cellDigest(id) != cell.digest || record.samples != cell.samples() || record.segments != linksOf(cell))
    return false;
  GridBox bounds;
  for (const Vector3d& p_W : cell.positions_um) bounds.extend(base_.grid().snap(p_W));
  return bounds.lo == record.bounds.lo && bounds.hi == record.bounds.hi;
}

void SyncedCells::finish(const std::vector<std::string>& unusable, bool remove) {
  const std::unordered_set<std::string> held_names(unusable.begin(), unusable.end());
  for (Passed& passed : passed_) {  // replaces the cells of its source in the order of ids
    const auto found = open_.find(passed.source);
    if (found == open_.end() || found->second.empty()) {
      ++counts_.added;
      continue;
    }
    passed.replaces = found->second.front();
    removed_[passed.replaces] = true;
    found->second.erase(found->second.begin());
    ++counts_.changed;
  }
  for (const auto& [source, ids] : open_) {
    if (ids.empty()) continue;
    const SyncFate fate = isIn(held_names, source)  ? SyncFate::kHeld
                          : fates_.contains(source) ? SyncFate::kChanged
                          : remove                  ? SyncFate::kRemoved
                                                    : SyncFate::kGone;
    fates_[source] = fate;
    for (const std::uint32_t id : ids) {
      removed_[id] = fate == SyncFate::kChanged || fate == SyncFate::kRemoved;
      ++(removed_[id] ? counts_.removed : fate == SyncFate::kHeld ? counts_.held : counts_.gone);
      if (!removed_[id]) staying_.push_back(id);
    }
  }
  std::sort(staying_.begin(), staying_.end());
  const std::vector<std::string> now = names();
  for (std::uint32_t c = 0; c < base_.cell_count(); ++c)
    counts_.renamed += !removed_[c] && !base_.cell(c).removed && now[c] != base_.cell(c).name ? 1 : 0;
}

std::map<std::string, SyncFate> SyncedCells::fates() const { return fates_; }

std::vector<std::string> SyncedCells::names() const {
  const std::uint32_t first = base_.cell_count();
  std::vector<std::uint32_t> order;
  for (std::uint32_t c = 0; c < first; ++c)
    if (!removed_[c] && !base_.cell(c).removed) order.push_back(c);
  for (std::uint32_t i = 0; i < passed_.size(); ++i) order.push_back(first + i);
  const auto source = [&](std::uint32_t id) -> const std::string& {
    return id < first ? base_.cell(id).source : passed_[id - first].source;
  };
  const auto digest = [&](std::uint32_t id) { return id < first ? base_.cellDigest(id) : passed_[id - first].digest; };
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const int sources = source(a).compare(source(b));
    return sources != 0 ? sources < 0 : digest(a) < digest(b);
  });
  std::vector<std::string> sources, given;
  for (const std::uint32_t id : order) {
    sources.push_back(source(id));
    const auto stated = given_.find(id);
    if (id >= first)
      given.push_back(passed_[id - first].name);
    else if (equal_[id])
      given.push_back(stated != given_.end() ? stated->second : std::string());
    else
      given.push_back(mayBeNamedAfter(base_.cell(id).name, source(id)) ? std::string() : base_.cell(id).name);
  }
  std::vector<std::string> found = cellNames(sources, given), names(first + passed_.size());
  for (std::size_t i = 0; i < order.size(); ++i) names[order[i]] = std::move(found[i]);
  return names;
}

std::vector<CellAttribute> SyncedCells::attributes(std::uint32_t id, const CellAttributes& base,
                                                   const CellAttributes* added) const {
  const std::uint32_t first = base_.cell_count();
  std::vector<CellAttribute> all, before;
  if (id >= first) {
    all = added->of(id - first);
    if (const std::uint32_t old = passed_[id - first].replaces; old != kNoCell) before = base.of(old);
  } else {
    if (const auto stated = attributes_.find(id); stated != attributes_.end()) all = stated->second;
    before = base.of(id);
  }
  for (CellAttribute& attribute : before)
    if (std::none_of(all.begin(), all.end(), [&](const CellAttribute& a) { return a.name == attribute.name; }))
      all.push_back(std::move(attribute));
  return all;
}

}  // namespace filiform::internal
