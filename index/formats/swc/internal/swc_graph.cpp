#include "index/formats/swc/internal/swc_graph.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>

namespace filiform::internal {

void RecordBook::add(InputCode code, Effect effect, std::uint64_t line, std::string_view token) {
  const bool room = ++counts_[static_cast<std::size_t>(code)] <= InputReport::kTokensKept;
  if (effect == Effect::kRemark && !room) return;
  records_.add({line, code, effect, room ? escaped(token, kTokenLength) : std::string()});
}

void RecordBook::Unordered::cutLink(InputCode code, std::uint64_t line, std::string_view token) {
  const bool room = ++book_->counts_[static_cast<std::size_t>(code)] <= InputReport::kTokensKept;
  records_.push_back({line, code, Effect::kLinkCut, room ? escaped(token, kTokenLength) : std::string()});
}

void RecordBook::Unordered::add() {
  std::stable_sort(records_.begin(), records_.end(),
                   [](const InputRecord& a, const InputRecord& b) { return a.line < b.line; });
  for (const InputRecord& record : records_) book_->records_.add(record);
}

void RecordBook::clear() {
  counts_.fill(0);
  records_.clear();
}

void RecordBook::moveTo(InputReport& report) {
  for (std::size_t i = 0; i < kInputCodes; ++i) report.codes.add(static_cast<InputCode>(i), counts_[i]);
  report.records = std::move(records_);
  report.records.close();
  records_ = {};
  counts_.fill(0);
}

// A root that repeats the block's first id begins another cell in the same file.
bool SwcGraph::startsBlock(const SwcSample& sample) const {
  if (ids_.size() < 2 || sample.id != block_first_id_) return false;
  switch (sample.parent_kind) {
    case SwcSample::Parent::kRoot:
    case SwcSample::Parent::kUnreadable:
      return true;
    case SwcSample::Parent::kId:
      break;
  }
  return sample.parent < 0 || (sample.parent == 0 && sample.id != 0 && ids_.find(0) == IdTable::kNone);
}

void SwcGraph::startBlock() {
  ids_.clear();
  block_has_first_id_ = false;
  block_dropped_zero_ = false;
}

bool SwcGraph::add(const SwcSample& sample, std::uint64_t line) {
  const std::size_t size = cell_.sample_ids.size();
  if (size >= kNoParent) throw InputError("more than 4294967294 samples in one file; split it");
  const auto rank = static_cast<std::uint32_t>(size);

  if (ids_.find(sample.id) != IdTable::kNone || (block_has_first_id_ && sample.id == block_first_id_)) {
    if (startsBlock(sample)) {
      closeBlock();
      startBlock();
      cell_.block_starts.push_back(rank);
      book_->remark(InputCode::W_ID_RESTART, line, std::to_string(sample.id));
    } else if (ids_.find(sample.id) != IdTable::kNone) {
      book_->dropLine(InputCode::W_DUP_ID, line, std::to_string(sample.id));
      return false;
    }
  }
  if (!block_has_first_id_) {
    block_has_first_id_ = true;
    block_first_id_ = sample.id;
  }
  if (size == room_) growBeyondKept();
  ids_.insert(sample.id, rank);
  cell_.sample_ids.push_back(sample.id);
  cell_.positions_um.push_back(sample.position_um);
  cell_.radii_um.push_back(sample.radius_um);
  if (sample.odd_radius_um > 0) {
    std::vector<OddRadius>& odd = cell_.odd_radii;
    if (odd.size() == odd.capacity() && odd.size() >= kKept) odd.reserve(odd.size() / 4 * 5);
    odd.push_back({rank, sample.odd_radius_um});
  }
  cell_.types.push_back(sample.type);
  cell_.parents.push_back(kNoParent);
  if (cell_.line_runs.empty() || line - cell_.line_runs.back().line != rank - cell_.line_runs.back().rank)
    cell_.line_runs.push_back({rank, line});
  link(sample, rank, line);
  return true;
}

void SwcGraph::growBeyondKept() {
  room_ += room_ / 4;
  cell_.sample_ids.reserve(room_);
  cell_.positions_um.reserve(room_);
  cell_.radii_um.reserve(room_);
  cell_.types.reserve(room_);
  cell_.parents.reserve(room_);
}

std::uint64_t SwcGraph::bytes(double times) const {
  constexpr std::uint64_t kOfSample =
      sizeof(std::int64_t) + sizeof(Vector3d) + sizeof(float) + sizeof(std::uint16_t) + sizeof(std::uint32_t);
  // Arrays have room for a quarter more, and the largest is there twice while it grows.
  const auto per = [times](std::size_t n, std::size_t bytes) {
    return static_cast<std::uint64_t>(static_cast<double>(n * bytes) * times);
  };
  return per(samples(), kOfSample / 4 * 5 + sizeof(Vector3d)) + ids_.bytes(times) +
         per(open_.size(), sizeof(OpenLink) * 9 / 4) + per(cell_.odd_radii.size(), sizeof(OddRadius) * 9 / 4) +
         per(cell_.line_runs.size(), sizeof(Cell::LineRun) * 3);
}

void SwcGraph::link(const SwcSample& sample, std::uint32_t rank, std::uint64_t line) {
  if (sample.parent_kind == SwcSample::Parent::kRoot) return;
  ++links_given_;
  if (sample.parent_kind == SwcSample::Parent::kUnreadable) {
    ++links_cut_;
    book_->cutLink(InputCode::W_BAD_PARENT, line, sample.parent_token);
  } else if (sample.parent < -1) {
    ++links_cut_;
    book_->cutLink(InputCode::W_ROOT_CODE, line, sample.parent_token);
  } else if (sample.parent == sample.id) {
    ++links_cut_;
    book_->cutLink(InputCode::W_SELF_PARENT, line, std::to_string(sample.parent));
  } else if (const std::uint32_t parent = ids_.find(sample.parent); parent != IdTable::kNone) {
    cell_.parents[rank] = parent;
  } else {
    if (open_.size() == open_.capacity() && open_.size() >= kKept) open_.reserve(open_.size() / 4 * 5);
    open_.push_back({rank, sample.parent});
  }
}

void SwcGraph::noteDropped(std::int64_t id) {
  if (!block_has_first_id_) {
    block_has_first_id_ = true;
    block_first_id_ = id;
  }
  if (id == 0) block_dropped_zero_ = true;
}

void SwcGraph::closeBlock() {
  for (const OpenLink& open : open_) {
    const std::uint32_t parent = ids_.find(open.parent);
    if (parent != IdTable::kNone) {
      cell_.parents[open.child] = parent;
      later_parents_ = true;
      continue;
    }
    ++links_cut_;
    const bool root_code = open.parent == 0 && !block_dropped_zero_;
    book_->cutLink(root_code ? InputCode::W_ROOT_CODE : InputCode::W_MISSING_PARENT, cell_.line(open.child),
                   std::to_string(open.parent));
  }
  open_.clear();
  if (open_.capacity() > kKept) open_ = {};
}

// Every sample has at most one parent, so a walk along parents meets each cycle once. Ranks follow the order of lines.
void SwcGraph::cutCycles() {
  std::vector<std::uint32_t>& parents = cell_.parents;
  std::vector<std::uint32_t> walk_of(parents.size(), kNoParent);
  RecordBook::Unordered cut(*book_);
  for (std::uint32_t start = 0; start < parents.size(); ++start) {
    std::uint32_t at = start;
    while (at != kNoParent && walk_of[at] == kNoParent) {
      walk_of[at] = start;
      at = parents[at];
    }
    if (at == kNoParent || walk_of[at] != start) continue;
    std::uint32_t lowest = at;
    for (std::uint32_t member = parents[at]; member != at; member = parents[member]) lowest = std::min(lowest, member);
    ++links_cut_;
    cut.cutLink(InputCode::W_CYCLE, cell_.line(lowest), std::to_string(cell_.sample_ids[parents[lowest]]));
    parents[lowest] = kNoParent;
  }
  cut.add();
}

void SwcGraph::count(InputReport& report) {
  const std::vector<std::uint32_t>& parents = cell_.parents;
  std::vector<bool> has_child(parents.size());
  for (std::uint32_t rank = 0; rank < parents.size(); ++rank) {
    const std::uint32_t parent = parents[rank];
    if (parent == kNoParent) {
      ++report.roots;
      continue;
    }
    ++report.segments;
    has_child[parent] = true;
    if (parent > rank) book_->remark(InputCode::W_ORDER, cell_.line(rank), std::to_string(cell_.sample_ids[parent]));
  }
  for (std::uint32_t rank = 0; rank < parents.size(); ++rank) {
    if (parents[rank] == kNoParent && !has_child[rank]) ++report.isolated;
  }
  report.samples = parents.size();
  report.links_given = links_given_;
  report.links_cut = links_cut_;
}

void SwcGraph::finish(Cell& cell, InputReport& report) {
  closeBlock();
  startBlock();
  if (later_parents_) cutCycles();
  count(report);
  cell.sample_ids.swap(cell_.sample_ids);
  cell.positions_um.swap(cell_.positions_um);
  cell.parents.swap(cell_.parents);
  cell.radii_um.swap(cell_.radii_um);
  cell.types.swap(cell_.types);
  cell.block_starts.swap(cell_.block_starts);
  cell.odd_radii.swap(cell_.odd_radii);
  cell.line_runs.swap(cell_.line_runs);
  if (cell.line_runs.size() > kKept) cell.line_runs = {};
  clear();
}

void SwcGraph::clear() {
  cell_.clearSamples();
  cell_.discardLarge();
  room_ = kKept;
  startBlock();
  open_.clear();
  if (open_.capacity() > kKept) open_ = {};
  links_given_ = links_cut_ = 0;
  later_parents_ = false;
}

}  // namespace filiform::internal
