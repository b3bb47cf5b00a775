#include "index/directory.h"

#include "index/internal/box_tree.h"

#include <algorithm>
#include <limits>
#include <mutex>
#include <queue>
#include <utility>

namespace filiform {
namespace {

constexpr TileId kScanTiles = 64;

void extend(WorldBox& box, const WorldBox& other) {
  box.lo_W = box.lo_W.cwiseMin(other.lo_W);
  box.hi_W = box.hi_W.cwiseMax(other.hi_W);
}

WorldBox emptyBox() {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  return {Vector3d::Constant(kInf), Vector3d::Constant(-kInf)};
}

}  // namespace

struct Directory::Impl {
  struct Page {
    std::once_flag built;
    std::unique_ptr<const internal::BoxTree> tree;
    std::vector<TileId> tiles;  // by item
  };

  const TileStore& store;
  const Grid grid;
  const TileId page_tiles;
  std::once_flag opened;
  WorldBox bounds = emptyBox();
  bool scanned = false;
  std::vector<std::pair<TileId, WorldBox>> boxes;  // scanned sets only
  std::unique_ptr<const internal::BoxTree> pages;
  std::vector<std::uint32_t> page_of_item;
  std::unique_ptr<Page[]> page;

  explicit Impl(const TileStore& s) : store(s), grid(s.grid()), page_tiles(s.page_tiles()) {}

  std::uint32_t pageCount() const { return (store.tile_count() + page_tiles - 1) / page_tiles; }
  TileId pageEnd(std::uint32_t number) const {
    return static_cast<TileId>(std::min<std::uint64_t>(store.tile_count(), (std::uint64_t{number} + 1) * page_tiles));
  }
  bool listed(TileId tile) const { return tile != store.long_tile() && !store.entry(tile).content.empty(); }

  // Cells are closed sets of grid points: what lies between two neighbouring cells is within a quantum of both.
  WorldBox box(TileId tile) const { return box(store.entry(tile).content); }
  WorldBox box(const GridBox& content) const {
    const Vector3d quantum = Vector3d::Constant(grid.quantum_um());
    return {grid.toWorld(content.lo) - quantum, grid.toWorld(content.hi) + quantum};
  }

  void open() {
    std::call_once(opened, [this] {
      scanned = store.tile_count() <= kScanTiles;
      if (scanned) {
        for (TileId tile = 0; tile < store.tile_count(); ++tile) {
          if (!listed(tile)) continue;
          boxes.emplace_back(tile, box(tile));
          extend(bounds, boxes.back().second);
        }
        return;
      }
      std::vector<WorldBox> page_boxes;
      for (std::uint32_t number = 0; number < pageCount(); ++number) {
        const GridBox content = store.pageContent(number);
        if (content.empty()) continue;
        page_boxes.push_back(box(content));
        page_of_item.push_back(number);
        extend(bounds, page_boxes.back());
      }
      pages = std::make_unique<internal::BoxTree>(page_boxes);
      page = std::make_unique<Page[]>(pageCount());
    });
  }

  const Page& enter(std::size_t item) {
    const std::uint32_t number = page_of_item[item];
    Page& p = page[number];
    std::call_once(p.built, [&] {
      std::vector<WorldBox> tile_boxes;
      for (TileId tile = number * page_tiles; tile < pageEnd(number); ++tile) {
        if (!listed(tile)) continue;
        p.tiles.push_back(tile);
        tile_boxes.push_back(box(tile));
      }
      p.tree = std::make_unique<internal::BoxTree>(tile_boxes);
    });
    return p;
  }
};

Directory::Directory(const TileStore& store) : impl_(std::make_unique<Impl>(store)) {}
Directory::~Directory() = default;

std::vector<Directory::Hit> Directory::within(const Vector3d& h_W, double squared_bound) const {
  impl_->open();
  std::vector<Hit> hits;
  const auto bound = [=] { return squared_bound; };
  if (impl_->scanned) {
    for (const auto& [tile, box] : impl_->boxes) {
      const double d2 = box.squaredDistanceBelow(h_W);
      if (d2 <= squared_bound) hits.push_back({tile, d2});
    }
  } else {
    impl_->pages->descend(h_W, bound, [&](std::uint32_t item, double) {
      const Impl::Page& page = impl_->enter(item);
      page.tree->descend(h_W, bound, [&](std::uint32_t i, double d2) { hits.push_back({page.tiles[i], d2}); });
    });
  }
  std::sort(hits.begin(), hits.end());
  return hits;
}

std::vector<std::pair<TileId, WorldBox>> Directory::meeting(const Region& region) const {
  impl_->open();
  std::vector<std::pair<TileId, WorldBox>> hits;
  if (impl_->scanned) {
    for (const auto& [tile, box] : impl_->boxes)
      if (region.mayMeet(box)) hits.emplace_back(tile, box);
  } else {
    impl_->pages->collect(region, [&](std::uint32_t item) {
      const Impl::Page& page = impl_->enter(item);
      page.tree->collect(region, [&](std::uint32_t i) { hits.emplace_back(page.tiles[i], impl_->box(page.tiles[i])); });
    });
  }
  std::sort(hits.begin(), hits.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return hits;
}

bool Directory::isOutside(const Vector3d& h_W) const {
  impl_->open();
  return !((h_W.array() >= impl_->bounds.lo_W.array()).all() && (h_W.array() <= impl_->bounds.hi_W.array()).all());
}

struct Directory::Walk::State {
  enum class Level : std::uint8_t { pages, page, tile };
  struct Entry {
    internal::BoxTree::Place place;
    Level level;
    const Impl::Page* page;
    TileId tile;

    // At equal distance everything is opened before a tile is given, so that ties come in the order of ids.
    bool operator<(const Entry& other) const {  // as in a max-heap: "comes later"
      if (place.squared_distance != other.place.squared_distance)
        return place.squared_distance > other.place.squared_distance;
      if (level != other.level) return level > other.level;
      return tile > other.tile;
    }
  };

  Impl& directory;
  Vector3d h_W;
  std::priority_queue<Entry> queue;

  void push(const internal::BoxTree::Place& place, const Impl::Page* page) {
    if (page == nullptr)
      queue.push({place, Level::pages, nullptr, 0});
    else if (place.node != nullptr)
      queue.push({place, Level::page, page, 0});
    else
      queue.push({place, Level::tile, page, page->tiles[place.size_or_id]});
  }
};

Directory::Walk::Walk(std::unique_ptr<State> state) : state_(std::move(state)) {}
Directory::Walk::~Walk() = default;
Directory::Walk::Walk(Walk&&) noexcept = default;

Directory::Walk Directory::walk(const Vector3d& h_W) const {
  impl_->open();
  auto state = std::make_unique<Walk::State>(Walk::State{*impl_, h_W, {}});
  if (impl_->scanned) {
    for (const auto& [tile, box] : impl_->boxes)
      state->queue.push({{box.squaredDistanceBelow(h_W), nullptr, 0}, Walk::State::Level::tile, nullptr, tile});
  } else {
    impl_->pages->root(h_W, [&](const auto& place) { state->push(place, nullptr); });
  }
  return Walk(std::move(state));
}

std::optional<Directory::Hit> Directory::Walk::next() {
  State& s = *state_;
  while (!s.queue.empty()) {
    const State::Entry top = s.queue.top();
    s.queue.pop();
    if (top.level == State::Level::tile) return Hit{top.tile, top.place.squared_distance};
    const internal::BoxTree* tree = top.page != nullptr ? top.page->tree.get() : s.directory.pages.get();
    if (top.place.node != nullptr) {
      tree->expand(top.place, s.h_W, [&](const auto& place) { s.push(place, top.page); });
    } else {
      const Impl::Page& page = s.directory.enter(top.place.size_or_id);
      page.tree->root(s.h_W, [&](const auto& place) { s.push(place, &page); });
    }
  }
  return std::nullopt;
}

}  // namespace filiform
