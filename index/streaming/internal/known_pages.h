// A view of a store for a caller that must not wait for the disk. What lies in a page of the directory that is not read
// yet is left out, and the page is noted with its urgency. The caller reads noted pages where it may wait, and asks
// again. Thread rule: thread-compatible; the caller's lock guards it.
#pragma once

#include "index/errors.h"
#include "index/set/forwarding_store.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace filiform::internal {

// Not an error: the answer is in a page of the directory that is not read yet. The page is noted.
struct PageAbsent {};

class KnownPages final : public ForwardingStore {
 public:
  // The store must outlive this object. O(pages).
  explicit KnownPages(const TileStore& store)
      : ForwardingStore(store),
        page_tiles_(store.page_tiles()),
        group_pages_(store.group_pages()),
        known_((std::size_t{store.tile_count()} + page_tiles_ - 1) / page_tiles_),
        known_groups_((known_.size() + group_pages_ - 1) / group_pages_) {}

  // While true (initially), all members read pages themselves and wait.
  void mayRead(bool may) { may_read_ = may; }
  // Call it after the page was read: its entries are then available.
  void add(std::uint32_t page) {
    known_[page] = known_groups_[page / group_pages_] = true;
    noted_.erase(page);
  }
  TileId firstTile(std::uint32_t page) const { return page * page_tiles_; }

  // Pages that were needed and not known, each with its urgency: the least `cost` with which it was asked for.
  const std::map<std::uint32_t, double>& noted() const { return noted_; }
  void forgetNoted() { noted_.clear(); }
  // The urgency of what is asked for from now on; lower is more urgent.
  void setCost(double cost) const { cost_ = cost; }

  // The entry; nullptr, with the page noted, if the page is not known.
  const TileEntry* find(TileId tile) const {
    const std::uint32_t page = tile / page_tiles_;
    if (!knows(tile)) return note(page), nullptr;
    try {
      const TileEntry& entry = store_.entry(tile);
      known_[page] = known_groups_[page / group_pages_] = true;
      return &entry;
    } catch (const Error&) {
      if (may_read_) throw;
      return lost(page), nullptr;
    }
  }
  // False: the tile's page is not known, and must be read by somebody first. Notes nothing.
  bool knows(TileId tile) const {
    const std::uint32_t page = tile / page_tiles_;
    if (!may_read_ && !known_.at(page) && store_.leaves().knowsLeaf(tile))
      known_[page] = known_groups_[page / group_pages_] = true;
    return may_read_ || known_[page];
  }
  // As home(); nullopt, with the page noted, if the page of the point is not known.
  std::optional<TileId> findHome(const GridPoint& p) const {
    if (!may_read_) {
      const LeafIndex& leaves = store_.leaves();
      const std::size_t group = leaves.groupOf(p);
      if (group == LeafIndex::kNone) return kNoTile;
      const std::size_t page = leaves.knowsGroup(group) ? leaves.pageOf(p) : leaves.firstPage(group);
      if (page != LeafIndex::kNone && !leaves.knows(page)) return note(static_cast<std::uint32_t>(page)), std::nullopt;
    }
    return store_.home(p);
  }
  // A box around the content of the tile's page if the page is not known and its group is; else nullopt.
  std::optional<GridBox> boxOfUnknown(TileId tile) const {
    const std::uint32_t page = tile / page_tiles_, group = page / group_pages_;
    if (knows(tile) || !known_groups_.at(group)) return std::nullopt;
    return store_.pageContent(page);
  }

  // entry(), home(), pageContent() and pageBoxes() throw PageAbsent and what the store throws.
  const TileEntry& entry(TileId tile) const override {
    if (const TileEntry* const entry = find(tile)) return *entry;
    throw PageAbsent{};
  }
  TileId home(const GridPoint& p) const override {
    if (const std::optional<TileId> home = findHome(p)) return *home;
    throw PageAbsent{};
  }

  std::uint32_t group_pages() const override { return group_pages_; }
  GridBox pageContent(std::uint32_t page) const override {
    return ofGroup(page, [&] { return store_.pageContent(page); });
  }
  std::vector<GridBox> pageBoxes(std::uint32_t page) const override {
    return ofGroup(page, [&] { return store_.pageBoxes(page); });
  }

 private:
  // What the page's group states about the page.
  template <typename Ask>
  std::invoke_result_t<Ask> ofGroup(std::uint32_t page, const Ask& ask) const {
    const std::uint32_t group = page / group_pages_;
    if (!may_read_ && !known_groups_.at(group)) {
      note(group * group_pages_);
      throw PageAbsent{};
    }
    try {
      const auto stated = ask();
      known_groups_[group] = true;
      return stated;
    } catch (const Error&) {
      if (may_read_) throw;
      lost(page);
      throw PageAbsent{};
    }
  }
  // The store does not have the page, against what it said before.
  void lost(std::uint32_t page) const {
    known_[page] = known_groups_[page / group_pages_] = false;
    note(page);
  }
  void note(std::uint32_t page) const {
    const auto [at, first] = noted_.try_emplace(page, cost_);
    if (!first) at->second = std::min(at->second, cost_);
  }

  const TileId page_tiles_;
  const std::uint32_t group_pages_;
  bool may_read_ = true;
  mutable std::vector<bool> known_;         // by page
  mutable std::vector<bool> known_groups_;  // by group: its pages' contents
  mutable std::map<std::uint32_t, double> noted_;
  mutable double cost_ = 0;
};

}  // namespace filiform::internal
