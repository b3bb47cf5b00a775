#include "index/query/tile_finder.h"

#include "index/tile/internal/box_tree.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <mutex>
#include <queue>
#include <utility>

namespace filiform {
namespace {

void extend(WorldBox& box, const WorldBox& other) {
  box.lo_W = box.lo_W.cwiseMin(other.lo_W);
  box.hi_W = box.hi_W.cwiseMax(other.hi_W);
}

WorldBox emptyBox() {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  return {Vector3d::Constant(kInf), Vector3d::Constant(-kInf)};
}

}  // namespace

struct TileFinder::Impl {
  struct Page {
    std::unique_ptr<const internal::BoxTree> tree;
    std::vector<TileId> tiles;  // tile of each item
  };
  struct Root {
    WorldBox bounds = emptyBox();
    bool scanned = false;
    std::vector<std::pair<TileId, WorldBox>> boxes;  // scanned sets only
    std::unique_ptr<const internal::BoxTree> pages;
    std::vector<std::uint32_t> page_of_item;
  };
  // A value created when first needed. It is completed elsewhere and then stored, so that a failure leaves nothing
  // behind. Several threads may create it at once; the first one is kept.
  template <typename T>
  struct Made {
    std::atomic<const T*> known{nullptr};
    std::unique_ptr<const T> owned;
  };

  const TileStore& store;
  const Grid grid;
  const TileId page_tiles;
  std::mutex mutex;  // for storing values
  Made<Root> root;
  std::unique_ptr<Made<Page>[]> page;

  explicit Impl(const TileStore& s)
      : store(s), grid(s.grid()), page_tiles(s.page_tiles()), page(new Made<Page>[pageCount()]) {}

  std::uint32_t pageCount() const { return (store.tile_count() + page_tiles - 1) / page_tiles; }
  TileId pageEnd(std::uint32_t number) const {
    return static_cast<TileId>(std::min<std::uint64_t>(store.tile_count(), (std::uint64_t{number} + 1) * page_tiles));
  }
  bool listed(TileId tile) const { return tile != store.long_tile() && !store.entry(tile).content.empty(); }

  // Blocks are closed sets of grid points: points between two neighbouring blocks are within a quantum of both.
  WorldBox box(TileId tile) const { return box(store.entry(tile).content); }
  WorldBox box(const GridBox& content) const {
    const Vector3d quantum = Vector3d::Constant(grid.quantum_um());
    return {grid.toWorld(content.lo) - quantum, grid.toWorld(content.hi) + quantum};
  }

  template <typename T, typename Make>
  const T& get(Made<T>& made, Make make) {
    if (const T* const known = made.known.load(std::memory_order_acquire)) return *known;
    std::unique_ptr<const T> here = make();
    const std::lock_guard lock(mutex);
    if (made.owned == nullptr) {
      made.owned = std::move(here);
      made.known.store(made.owned.get(), std::memory_order_release);
    }
    return *made.owned;
  }

  const Root& open() {
    return get(root, [this] {
      auto r = std::make_unique<Root>();
      r->scanned = store.tile_count() <= kScanTiles;
      if (r->scanned) {
        for (TileId tile = 0; tile < store.tile_count(); ++tile) {
          if (!listed(tile)) continue;
          r->boxes.emplace_back(tile, box(tile));
          extend(r->bounds, r->boxes.back().second);
        }
        return r;
      }
      std::vector<WorldBox> page_boxes;
      for (std::uint32_t number = 0; number < pageCount(); ++number) {
        const GridBox content = store.pageContent(number);
        if (content.empty()) continue;
        page_boxes.push_back(box(content));
        r->page_of_item.push_back(number);
        extend(r->bounds, page_boxes.back());
      }
      r->pages = std::make_unique<internal::BoxTree>(page_boxes);
      return r;
    });
  }

  const Page& enter(const Root& r, std::size_t item) {
    const std::uint32_t number = r.page_of_item[item];
    return get(page[number], [&] {
      auto p = std::make_unique<Page>();
      std::vector<WorldBox> tile_boxes;
      for (TileId tile = number * page_tiles; tile < pageEnd(number); ++tile) {
        if (!listed(tile)) continue;
        p->tiles.push_back(tile);
        tile_boxes.push_back(box(tile));
      }
      p->tree = std::make_unique<internal::BoxTree>(tile_boxes);
      return p;
    });
  }
};

TileFinder::TileFinder(const TileStore& store) : impl_(std::make_unique<Impl>(store)) {}
TileFinder::~TileFinder() = default;

std::vector<TileFinder::Hit> TileFinder::within(const Vector3d& h_W, double squared_bound) const {
  const Impl::Root& root = impl_->open();
  std::vector<Hit> hits;
  const auto bound = [=] { return squared_bound; };
  if (root.scanned) {
    for (const auto& [tile, box] : root.boxes) {
      const double d2 = box.squaredDistanceBelow(h_W);
      if (d2 <= squared_bound) hits.push_back({tile, d2});
    }
  } else {
    root.pages->descend(h_W, bound, [&](std::uint32_t item, double) {
      const Impl::Page& page = impl_->enter(root, item);
      page.tree->descend(h_W, bound, [&](std::uint32_t i, double d2) { hits.push_back({page.tiles[i], d2}); });
    });
  }
  std::sort(hits.begin(), hits.end());
  return hits;
}

std::vector<std::pair<TileId, WorldBox>> TileFinder::meeting(const Region& region) const {
  const Impl::Root& root = impl_->open();
  std::vector<std::pair<TileId, WorldBox>> hits;
  if (root.scanned) {
    for (const auto& [tile, box] : root.boxes)
      if (region.mayMeet(box)) hits.emplace_back(tile, box);
  } else {
    root.pages->collect(region, [&](std::uint32_t item) {
      const Impl::Page& page = impl_->enter(root, item);
      page.tree->collect(region, [&](std::uint32_t i) { hits.emplace_back(page.tiles[i], impl_->box(page.tiles[i])); });
    });
  }
  std::sort(hits.begin(), hits.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return hits;
}

bool TileFinder::isOutside(const Vector3d& h_W) const {
  const WorldBox& bounds = impl_->open().bounds;
  return !((h_W.array() >= bounds.lo_W.array()).all() && (h_W.array() <= bounds.hi_W.array()).all());
}

struct TileFinder::Walk::State {
  enum class Level : std::uint8_t { pages, page, tile };
  struct Entry {
    internal::BoxTree::Place place;
    Level level;
    const Impl::Page* page;
    TileId tile;

    // At equal distance, pages are opened before a tile is returned, so that ties come in the order of ids.
    bool operator<(const Entry& other) const {  // order of a max-heap: "comes later"
      if (place.squared_distance != other.place.squared_distance)
        return place.squared_distance > other.place.squared_distance;
      if (level != other.level) return level > other.level;
      return tile > other.tile;
    }
  };

  Impl& finder;
  const Impl::Root& root;
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

TileFinder::Walk::Walk(std::unique_ptr<State> state) : state_(std::move(state)) {}
TileFinder::Walk::~Walk() = default;
TileFinder::Walk::Walk(Walk&&) noexcept = default;

TileFinder::Walk TileFinder::walk(const Vector3d& h_W) const {
  const Impl::Root& root = impl_->open();
  auto state = std::make_unique<Walk::State>(Walk::State{*impl_, root, h_W, {}});
  if (root.scanned) {
    for (const auto& [tile, box] : root.boxes)
      state->queue.push({{box.squaredDistanceBelow(h_W), nullptr, 0}, Walk::State::Level::tile, nullptr, tile});
  } else {
    root.pages->root(h_W, [&](const auto& place) { state->push(place, nullptr); });
  }
  return Walk(std::move(state));
}

std::optional<TileFinder::Hit> TileFinder::Walk::next() {
  State& s = *state_;
  while (!s.queue.empty()) {
    const State::Entry top = s.queue.top();
    s.queue.pop();
    if (top.level == State::Level::tile) return Hit{top.tile, top.place.squared_distance};
    const internal::BoxTree* tree = top.page != nullptr ? top.page->tree.get() : s.root.pages.get();
    if (top.place.node != nullptr) {
      tree->expand(top.place, s.h_W, [&](const auto& place) { s.push(place, top.page); });
    } else {
      const Impl::Page& page = s.finder.enter(s.root, top.place.size_or_id);
      page.tree->root(s.h_W, [&](const auto& place) { s.push(place, &page); });
    }
  }
  return std::nullopt;
}

}  // namespace filiform
