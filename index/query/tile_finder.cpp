#include "index/query/tile_finder.h"

#include "index/query/internal/box_levels.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <mutex>
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
    std::unique_ptr<const internal::BoxLevels> boxes;
    std::vector<TileId> tiles;  // tile of each item
  };
  struct Root {
    WorldBox bounds = emptyBox();
    bool scanned = false;
    std::vector<std::pair<TileId, WorldBox>> boxes;  // scanned sets only
    std::unique_ptr<const internal::BoxLevels> pages;
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
      r->pages = std::make_unique<internal::BoxLevels>(page_boxes);
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
      p->boxes = std::make_unique<internal::BoxLevels>(tile_boxes);
      return p;
    });
  }
};

TileFinder::TileFinder(const TileStore& store) : impl_(std::make_unique<Impl>(store)) {}
TileFinder::~TileFinder() = default;

std::vector<TileFinder::Hit> TileFinder::within(const Vector3d& h_W, double squared_bound) const {
  std::vector<Hit> hits;
  Walk steps = walk(h_W);
  while (const auto hit = steps.next(squared_bound)) hits.push_back(*hit);
  return hits;
}

std::vector<std::pair<TileId, WorldBox>> TileFinder::meeting(const Region& region) const {
  const Impl::Root& root = impl_->open();
  std::vector<std::pair<TileId, WorldBox>> hits;
  if (root.scanned) {
    for (const auto& [tile, box] : root.boxes)
      if (region.mayMeet(box)) hits.emplace_back(tile, box);
  } else {
    root.pages->meeting(region, [&](std::uint32_t item) {
      const Impl::Page& page = impl_->enter(root, item);
      page.boxes->meeting(region, [&](std::uint32_t i) {
        const WorldBox box = impl_->box(page.tiles[i]);
        if (region.mayMeet(box)) hits.emplace_back(page.tiles[i], box);
      });
    });
  }
  std::sort(hits.begin(), hits.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return hits;
}

bool TileFinder::isOutside(const Vector3d& h_W) const {
  const WorldBox& bounds = impl_->open().bounds;
  return !((h_W.array() >= bounds.lo_W.array()).all() && (h_W.array() <= bounds.hi_W.array()).all());
}

// A best-first search. An opened node waits with the bound of its nearest child that was not taken yet; a tile that is
// taken waits with its distance.
struct TileFinder::Walk::State {
  using Place = internal::BoxLevels::Place;

  struct Opened {
    internal::BoxLevels::Bounds bounds;  // infinite for children that were taken
    const Impl::Page* page;              // null: a node of the hierarchy of pages
    Place place;
    std::uint32_t left;                  // children not taken
    internal::BoxLevels::Bound nearest;  // of these
  };
  struct Waiting {
    double squared;
    bool measured;
    std::uint32_t at;  // a tile if measured, else a position in `opened`

    // At equal distance, opened nodes come first, so that ties come in the order of ids.
    bool before(const Waiting& other) const {
      if (squared != other.squared) return squared < other.squared;
      if (measured != other.measured) return !measured;
      return measured && at < other.at;
    }
  };

  Impl& finder;
  const Impl::Root& root;
  Vector3d h_W;
  internal::BoxLevels::Probe root_probe{}, page_probe{};
  const Impl::Page* probed = nullptr;  // page_probe is for this page
  std::vector<Opened> opened;
  std::vector<Waiting> heap;    // the first on top
  std::optional<Waiting> next;  // not in the heap

  void wait(const Waiting& one) {
    heap.push_back(one);
    std::push_heap(heap.begin(), heap.end(), [](const Waiting& a, const Waiting& b) { return b.before(a); });
  }
  // The first of all. Requires that one waits.
  Waiting first() {
    if (next && (heap.empty() || next->before(heap.front()))) return *std::exchange(next, std::nullopt);
    std::pop_heap(heap.begin(), heap.end(), [](const Waiting& a, const Waiting& b) { return b.before(a); });
    Waiting top = heap.back();
    heap.pop_back();
    return top;
  }
  void offer(const Waiting& one) {
    if (next) wait(*next);
    next = one;
  }
  // Finds the nearest child left; a node without one within the bound is dropped.
  void offerNearest(std::uint32_t at, double bound) {
    Opened& node = opened[at];
    if (node.left == 0) return;
    node.nearest = *std::min_element(node.bounds.begin(), node.bounds.end());
    if (const double squared = node.nearest.squared(); squared <= bound) offer({squared, false, at});
  }
  void open(const Impl::Page* page, Place place, double bound);
  void take(std::uint32_t at, double bound);
};

void TileFinder::Walk::State::open(const Impl::Page* page, Place place, double bound) {
  const internal::BoxLevels& boxes = page != nullptr ? *page->boxes : *root.pages;
  if (page != nullptr && page != probed) {
    page_probe = boxes.probe(h_W);
    probed = page;
  }
  Opened& node = opened.emplace_back();
  node.page = page;
  node.place = place;
  node.left = boxes.children(place);
  boxes.squaredBelow(page != nullptr ? page_probe : root_probe, place, node.bounds);
  offerNearest(static_cast<std::uint32_t>(opened.size() - 1), bound);
}

// Takes the nearest child of a node.
void TileFinder::Walk::State::take(std::uint32_t at, double bound) {
  Opened& node = opened[at];
  const Impl::Page* page = node.page;
  const std::uint32_t child = node.nearest.child();
  const Place place = internal::BoxLevels::child(node.place, child);
  node.bounds[child] = {std::numeric_limits<float>::infinity(), child};
  --node.left;
  offerNearest(at, bound);
  if (place.level >= 0) return open(page, place, bound);
  if (page != nullptr) {
    const TileId tile = page->tiles[place.at];
    return offer({finder.box(tile).squaredDistanceBelow(h_W), true, tile});
  }
  const Impl::Page& entered = finder.enter(root, place.at);
  if (entered.boxes->items() > 0) open(&entered, entered.boxes->root(), bound);
}

TileFinder::Walk::Walk(std::unique_ptr<State> state) : state_(std::move(state)) {}
TileFinder::Walk::~Walk() = default;
TileFinder::Walk::Walk(Walk&&) noexcept = default;

TileFinder::Walk TileFinder::walk(const Vector3d& h_W) const {
  const Impl::Root& root = impl_->open();
  auto state = std::make_unique<Walk::State>(Walk::State{*impl_, root, h_W, {}, {}, nullptr, {}, {}, std::nullopt});
  state->opened.reserve(32);
  state->heap.reserve(64);
  if (root.scanned) {
    for (const auto& [tile, box] : root.boxes) state->wait({box.squaredDistanceBelow(h_W), true, tile});
  } else if (root.pages->items() > 0) {
    state->root_probe = root.pages->probe(h_W);
    state->open(nullptr, root.pages->root(), std::numeric_limits<double>::infinity());
  }
  return Walk(std::move(state));
}

std::optional<TileFinder::Hit> TileFinder::Walk::next(double squared_bound) {
  State& s = *state_;
  while (s.next || !s.heap.empty()) {
    const State::Waiting first = s.first();
    if (first.squared > squared_bound) {
      s.wait(first);
      return std::nullopt;
    }
    if (first.measured) return Hit{first.at, first.squared};
    s.take(first.at, squared_bound);
  }
  return std::nullopt;
}

}  // namespace filiform
