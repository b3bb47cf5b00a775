#include "viewer/gl/internal/card_tiles.h"

#include <algorithm>
#include <chrono>
#include <set>
#include <string>
#include <utility>

namespace filiform::internal {

namespace {

using Clock = std::chrono::steady_clock;

// A tile that cannot be read is tried again after this time.
constexpr double kRetry_s = 5;
// Cells that are not hidden are drawn whole instead of the tiles if they have no more segments together.
constexpr std::uint64_t kMostLone = 100'000;
// Boxes of more cells are not compared with the tiles.
constexpr std::size_t kMostBoxes = 4096;

double elapsed_ms(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

std::string reasonOf(const std::exception_ptr& error) {
  try {
    std::rethrow_exception(error);
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {
    return "unknown reason";
  }
}

}  // namespace

CardTiles::CardTiles(const TileStore& store, const Levels* levels, Renderer& renderer, double shallow_um,
                     double deep_um)
    : store_(store),
      levels_(levels),
      renderer_(renderer),
      first_tile_(levels != nullptr ? levels->size() : 0),
      shallow_um_(shallow_um),
      deep_um_(deep_um) {
  loader_ = std::make_unique<BatchLoader>(store, levels);
}

CardTiles::Node CardTiles::above(Node node) const {
  if (levels_ == nullptr) return kNone;
  const LevelId level = levels_->above({isLevel(node), isLevel(node) ? node : node - first_tile_, 0, 0});
  return level == Levels::kRoots ? kNone : level;
}

bool CardTiles::setAppearance(const SceneFrame& f) {
  ++frame_;
  bool changed = false;
  if (palettes_ == 0 || f.colour != colour_ || f.cell_colours != cell_colours_ || f.states != states_ ||
      f.hidden_types != hidden_types_) {
    colour_ = f.colour;
    cell_colours_ = f.cell_colours;
    states_ = f.states;
    hidden_types_ = f.hidden_types;
    CellPalette palette = makePalette(store_.cell_count(), colour_, cell_colours_.get(), states_.get());
    palette.shallow_um = shallow_um_;
    palette.deep_um = deep_um_;
    palette.hidden_types = hidden_types_;
    renderer_.paint(palette);
    ++palettes_;
    findLone();
    changed = true;
  }
  const bool other_cells = (changed || f.cells != highlighted_) && setWhole(f);
  highlighted_ = f.cells;
  shown_changed_ |= other_cells;
  request_again_ |= other_cells;
  return changed || other_cells;
}

void CardTiles::findLone() {
  lone_.clear();
  boxes_.clear();
  if (states_ == nullptr) return;
  const auto isHidden = [&](CellState state) { return state == CellState::hidden; };
  const auto hidden = static_cast<std::size_t>(std::count_if(states_->begin(), states_->end(), isHidden));
  if (hidden == 0 || store_.cell_count() - hidden > kMostBoxes) return;
  std::uint64_t segments = 0;
  for (std::uint32_t cell = 0; cell < store_.cell_count(); ++cell) {
    if (cell < states_->size() && isHidden((*states_)[cell])) continue;
    const CellRecord& record = store_.cell(cell);
    if (record.removed || record.segments == 0) continue;
    segments += record.segments;
    lone_.push_back(cell);
    boxes_.push_back(record.bounds);
  }
  if (segments > kMostLone) lone_.clear();
}

bool CardTiles::setWhole(const SceneFrame& f) {
  std::map<std::uint32_t, Layer> wanted;
  for (const std::uint32_t cell : lone_) wanted[cell] = Layer::neurites;
  for (const std::uint32_t cell : f.cells) wanted[cell] = Layer::highlight;
  bool changed = false;
  std::erase_if(cells_, [&](const auto& cell) {
    if (wanted.contains(cell.first)) return false;
    renderer_.remove(kFirstCell + cell.first);
    return changed = true;
  });
  for (const auto& [cell, layer] : wanted) {
    const auto [at, is_new] = cells_.try_emplace(cell);
    changed |= is_new || at->second.layer != layer;
    at->second.layer = layer;
    renderer_.place(kFirstCell + cell, layer);
  }
  return changed;
}

bool CardTiles::hasLone() const {
  return std::all_of(lone_.begin(), lone_.end(), [this](std::uint32_t cell) { return cells_.at(cell).uploaded; });
}

void CardTiles::leaveHidden(std::vector<LevelPart>& parts) const {
  if (boxes_.empty()) return;
  std::erase_if(parts, [this](const LevelPart& part) {
    const GridBox& content = part.level ? levels_->entry(part.tile).content : store_.entry(part.tile).content;
    return std::none_of(boxes_.begin(), boxes_.end(), [&](const GridBox& box) {
      return (box.lo.array() <= content.hi.array()).all() && (content.lo.array() <= box.hi.array()).all();
    });
  });
}

bool CardTiles::choose(const LevelView& view, const Vector3d& focus_W, std::uint64_t most_segments, double enough_px,
                       bool with_stand_ins, double now_s) {
  Signature choice;
  choice.add(view.eye_W);
  for (const LevelView::Plane& plane : view.planes) choice.add(plane.n), choice.add(plane.d);
  choice.add(view.pixels_per_rad);
  choice.add(focus_W);
  choice.add(static_cast<double>(most_segments));
  choice.add(enough_px);
  choice.add(with_stand_ins ? 1 : 0);
  choice.add(lone_.empty() ? 0 : hasLone() ? 2 : 1);
  choice.add(static_cast<double>(boxes_.empty() ? 0 : palettes_));
  chosen_frame_ = frame_;
  if (choice == last_choice_ && !choose_again_) return false;
  // No frame waits for the directory; a whole picture does.
  if (lone_.empty()) {
    chosen_ = chooseTiles(store_, levels_, view, focus_W, most_segments, enough_px,
                          with_stand_ins ? UnreadTiles::leave : UnreadTiles::read);
    leaveHidden(chosen_.parts);
  } else if (hasLone() || !with_stand_ins) {
    chosen_ = {};  // until then what is there is shown
  }
  last_choice_ = std::move(choice);
  choose_again_ = false;
  chosen_view_ = view;
  request(with_stand_ins, now_s);
  return true;
}

void CardTiles::requestIfDue(bool with_stand_ins, double now_s) {
  if (request_again_ || now_s >= next_retry_s_) request(with_stand_ins, now_s);
}

void CardTiles::request(bool with_stand_ins, double now_s) {
  struct Wish {
    double error_px;  // of what is shown without it
    Node node;
  };
  std::vector<Wish> wishes;
  std::set<Node> met;
  request_again_ = false;
  next_retry_s_ = INFINITY;
  const auto isDue = [&](const Slot& slot) {
    if (!slot.error || slot.retry_s <= now_s) return true;
    next_retry_s_ = std::min(next_retry_s_, slot.retry_s);
    return false;
  };
  const auto wish = [&](Node node) {
    Slot& tile = slots_[node];
    tile.used = frame_;
    if (tile.uploaded || !isDue(tile)) return;
    const Node coarser = above(node);
    const double error_px = coarser == kNone ? INFINITY : levels_->errorOnScreen(coarser, chosen_view_);
    wishes.push_back({error_px, node});
  };
  for (const LevelPart& part : chosen_.parts) {
    if (!lone_.empty()) break;
    wish(nodeOf(part));
    if (!with_stand_ins) continue;
    for (Node coarser = above(nodeOf(part)); coarser != kNone && met.insert(coarser).second; coarser = above(coarser))
      wish(coarser);
  }
  // At equal errors: level tiles before the tiles inside them. Without levels the nearest are first already.
  std::stable_sort(wishes.begin(), wishes.end(), [&](const Wish& a, const Wish& b) {
    if (a.error_px != b.error_px) return a.error_px > b.error_px;
    return std::min(a.node, first_tile_) < std::min(b.node, first_tile_);
  });
  std::vector<TileJob> jobs;
  jobs.reserve(wishes.size() + cells_.size());
  // After the tiles for which nothing stands in: a cell may lie in many tiles.
  auto after_first =
      std::find_if(wishes.begin(), wishes.end(), [](const Wish& w) { return std::isfinite(w.error_px); });
  for (auto w = wishes.begin();; ++w) {
    if (w == after_first)
      for (const auto& [cell, slot] : cells_)
        if (!slot.uploaded && isDue(slot)) jobs.push_back({.key = kNone, .whole_cell = cell});
    if (w == wishes.end()) break;
    const bool level = isLevel(w->node);
    jobs.push_back({.key = w->node, .level = level, .tile = level ? w->node : w->node - first_tile_});
  }
  for (const LevelId level : chosen_.unread) {
    const auto failed = unread_.find(level);
    if (failed == unread_.end() || isDue(failed->second))
      jobs.push_back({.key = level, .level = true, .tile = level, .only_below = true});
  }
  loader_->want(std::move(jobs));
}

bool CardTiles::upload(const SceneBudget& budget, bool all, double now_s, SceneFigures& figures) {
  const Clock::time_point start = Clock::now();
  bool came = false;
  LoadedTile loaded;
  figures.uploads = 0;
  figures.upload_bytes = 0;
  while (figures.uploads == 0 || all ||
         (figures.upload_bytes < budget.upload_bytes && elapsed_ms(start) < budget.upload_ms)) {
    if (!loader_->take(loaded)) break;
    if (loaded.job.only_below) {
      came |= tookDirectory(loaded, now_s);
      continue;
    }
    const std::uint32_t cell = loaded.job.whole_cell;
    const bool is_cell = cell != UINT32_MAX;
    const auto found = slots_.find(loaded.job.key);
    if (is_cell ? !cells_.contains(cell) : found == slots_.end()) continue;
    Slot& tile = is_cell ? static_cast<Slot&>(cells_[cell]) : found->second;
    came = true;
    const bool shown = is_cell || std::binary_search(shown_.begin(), shown_.end(), loaded.job.key);
    shown_changed_ |= shown;
    tile.error = loaded.error;
    if (loaded.error) {
      tile.retry_s = now_s + kRetry_s;
      next_retry_s_ = std::min(next_retry_s_, tile.retry_s);
      continue;
    }
    if (is_cell) {
      renderer_.put(kFirstCell + cell, loaded.batch, cells_[cell].layer);
    } else {
      renderer_.put(loaded.job.key, loaded.batch);
      renderer_.show(loaded.job.key, shown);
    }
    tile.uploaded = true;
    tile.implausible = loaded.batch.implausible_radii;
    ++figures.uploads;
    figures.upload_bytes += loaded.batch.segments.size() * sizeof(DrawnSegment);
  }
  figures.upload_ms = figures.uploads > 0 ? elapsed_ms(start) : 0;
  return came;
}

bool CardTiles::tookDirectory(const LoadedTile& loaded, double now_s) {
  if (!loaded.error) {
    unread_.erase(loaded.job.tile);
    choose_again_ = true;
    return true;
  }
  Slot& slot = unread_[loaded.job.tile];
  slot.error = loaded.error;
  slot.retry_s = now_s + kRetry_s;
  next_retry_s_ = std::min(next_retry_s_, slot.retry_s);
  return true;
}

void CardTiles::selectShown() {
  std::set<Node> now;
  std::vector<Node> missing;
  for (const LevelPart& part : chosen_.parts) {
    const Node node = nodeOf(part);
    if (isUploaded(node)) {
      now.insert(node);
      continue;
    }
    // A coarser tile would also replace the neighbours. For a tile that cannot be read that is too high a price.
    Node coarser = slots_[node].error ? kNone : above(node);
    while (coarser != kNone && !isUploaded(coarser)) coarser = above(coarser);
    if (coarser != kNone)
      now.insert(coarser);
    else
      missing.push_back(node);
  }
  for (const Node node : missing) {
    if (!isLevel(node)) continue;
    for (const auto& [below, tile] : slots_) {
      if (!tile.uploaded) continue;
      Node coarser = above(below);
      while (coarser != kNone && coarser != node) coarser = above(coarser);
      if (coarser == node) now.insert(below);
    }
  }
  // Show each place once: no tile below another shown one.
  std::vector<Node> next;
  for (const Node node : now) {
    Node coarser = above(node);
    while (coarser != kNone && !now.contains(coarser)) coarser = above(coarser);
    if (coarser == kNone) next.push_back(node);
  }
  for (const Node node : next) slots_[node].used = frame_;
  if (next == shown_) return;
  shown_changed_ = true;
  for (const Node node : shown_)
    if (!std::binary_search(next.begin(), next.end(), node)) renderer_.show(node, false);
  for (const Node node : next)
    if (!std::binary_search(shown_.begin(), shown_.end(), node)) renderer_.show(node, true);
  shown_ = std::move(next);
}

void CardTiles::evict(std::uint64_t most_bytes) {
  if (renderer_.bytes() <= most_bytes) return;
  std::set<Node> kept(shown_.begin(), shown_.end()), stand_ins;
  for (const LevelPart& part : chosen_.parts) {
    kept.insert(nodeOf(part));
    for (Node node = above(nodeOf(part)); node != kNone && stand_ins.insert(node).second;) node = above(node);
  }
  kept.merge(stand_ins);
  std::vector<std::pair<std::uint64_t, Node>> others;
  for (const auto& [node, tile] : slots_)
    if (!kept.contains(node)) others.emplace_back(tile.used, node);
  std::sort(others.begin(), others.end());
  for (const auto& [used, node] : others) {
    if (renderer_.bytes() <= most_bytes) return;
    renderer_.remove(node);
    slots_.erase(node);
  }
}

// Counts what is missing of the chosen tiles, and what no shown tile represents.
void CardTiles::countChosen(SceneFigures& figures) {
  for (const LevelPart& part : chosen_.parts) {
    const Node node = nodeOf(part);
    const Slot& tile = slots_[node];
    if (tile.error)
      figures.failed.push_back(reasonOf(tile.error));
    else if (!tile.uploaded)
      ++figures.pending;
    bool represented = false;
    for (Node over = node; over != kNone && !represented; over = above(over))
      represented = std::binary_search(shown_.begin(), shown_.end(), over);
    if (represented) continue;
    figures.has_gaps = true;
    if (!part.level) {
      figures.left_out += store_.entry(part.tile).owned;
    } else {
      const LevelEntry& entry = levels_->entry(part.tile);
      figures.left_out += entry.represented + entry.hidden;
    }
  }
}

void CardTiles::count(SceneFigures& figures) {
  figures.segments = figures.implausible_radii = 0;
  figures.error_px = 0;
  figures.wanted_error_px = chosen_.error_px;
  figures.tiles = static_cast<std::uint32_t>(shown_.size());
  figures.stand_ins = figures.pending = 0;
  figures.left_out = chosen_.left_out;
  figures.tiles_left_out = chosen_.tiles_left_out;
  figures.hidden = 0;
  figures.limited = chosen_.limited;
  figures.failed.clear();
  figures.has_gaps = false;
  if (lone_.empty()) countChosen(figures);
  // While the choice is frozen, nothing more is chosen.
  for (const LevelId level : chosen_.unread)
    if (const auto failed = unread_.find(level); failed != unread_.end())
      figures.failed.push_back(reasonOf(failed->second.error));
    else if (chosen_frame_ == frame_)
      ++figures.pending;
  std::set<Node> wanted;
  for (const LevelPart& part : chosen_.parts) wanted.insert(nodeOf(part));
  for (const Node node : shown_) {
    const Slot& tile = slots_[node];
    figures.segments += isLevel(node) ? levels_->entry(node).segments : store_.entry(node - first_tile_).owned;
    figures.implausible_radii += tile.implausible;
    if (!wanted.contains(node)) ++figures.stand_ins;
    if (!isLevel(node)) continue;
    figures.hidden += levels_->entry(node).hidden;
    figures.error_px = std::max(figures.error_px, levels_->errorOnScreen(node, chosen_view_));
  }
  for (const std::uint32_t cell : lone_) {
    figures.segments += cells_[cell].uploaded ? store_.cell(cell).segments : 0;
    figures.implausible_radii += cells_[cell].implausible;
  }
  for (const auto& [cell, slot] : cells_) {
    if (slot.error) figures.failed.push_back("cell " + store_.cell(cell).name + ": " + reasonOf(slot.error));
    if (!slot.error && !slot.uploaded) ++figures.pending;
  }
  figures.complete = figures.pending == 0 && figures.stand_ins == 0 && figures.failed.empty();
  figures.card_bytes = renderer_.bytes();
}

std::size_t CardTiles::wholeDone() {
  const auto isDone = [](const Slot& tile) {
    if (tile.error) std::rethrow_exception(tile.error);
    return tile.uploaded;
  };
  std::size_t done = 0;
  for (const auto& [cell, slot] : cells_) done += isDone(slot) ? 1 : 0;
  for (const LevelPart& part : chosen_.parts) done += isDone(slots_[nodeOf(part)]) ? 1 : 0;
  return done;
}

void CardTiles::removeAll() {
  for (const auto& [node, tile] : slots_) renderer_.remove(node);
  for (const auto& [cell, slot] : cells_) renderer_.remove(kFirstCell + cell);
  slots_.clear();
}

std::shared_ptr<void> CardTiles::end() {
  removeAll();
  loader_->stop();
  return std::shared_ptr<BatchLoader>(std::move(loader_));
}

}  // namespace filiform::internal
