#include "index/query/tile_finder.h"

#include "index/file/internal/read_once.h"
#include "index/query/internal/box_levels.h"
#include "index/set/reads_at_once.h"
#include "index/workers.h"

#include <algorithm>
#include <array>
#include <limits>
#include <memory>
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
  enum class Kind : std::uint8_t { groups, pages, tiles };
  // The hierarchy of the boxes of some groups, pages or tiles.
  struct Node {
    Kind items = Kind::tiles;
    std::unique_ptr<const internal::BoxLevels> boxes;
    std::vector<std::uint32_t> ids;        // of the items
    const WorldBox* tile_boxes = nullptr;  // of the items; null: those of the directory
  };
  struct Root {
    WorldBox bounds = emptyBox();
    bool scanned = false;
    std::vector<std::pair<TileId, WorldBox>> boxes;  // scanned sets only
    std::vector<WorldBox> tile_boxes;                // of given tiles only
    Node node;                                       // of the groups; of the pages if there is one group
  };

  const TileStore& store;
  const Grid grid;
  const std::uint32_t page_tiles, group_pages, page_count, group_count;
  internal::ReadOnce<Root> root;
  std::unique_ptr<internal::ReadOnce<Node>[]> group, page;

  explicit Impl(const TileStore& s)
      : store(s),
        grid(s.grid()),
        page_tiles(s.page_tiles()),
        group_pages(s.group_pages()),
        page_count(parts(s.tile_count(), page_tiles)),
        group_count(parts(page_count, group_pages)),
        group(new internal::ReadOnce<Node>[group_count]),
        page(new internal::ReadOnce<Node>[page_count]) {}

  static std::uint32_t parts(std::uint64_t items, std::uint32_t of_part) {
    return static_cast<std::uint32_t>((items + of_part - 1) / of_part);
  }
  bool listed(TileId tile) const { return tile != store.long_tile() && !store.entry(tile).content.empty(); }

  // Blocks are closed sets of grid points: points between two neighbouring blocks are within a quantum of both.
  WorldBox box(TileId tile) const { return box(store.entry(tile).content); }
  WorldBox box(const Node& tiles, std::uint32_t item) const {
    return tiles.tile_boxes != nullptr ? tiles.tile_boxes[item] : box(tiles.ids[item]);
  }
  WorldBox box(const GridBox& content) const {
    const Vector3d quantum = Vector3d::Constant(grid.quantum_um());
    return {grid.toWorld(content.lo) - quantum, grid.toWorld(content.hi) + quantum};
  }

  const Root& open() {
    return root.get([this] {
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
      // A group of one page has the boxes of its page.
      r->node = group_count == 1 ? nodeOfPages(0)
                                 : node(group_pages == 1 ? Kind::pages : Kind::groups, 0, group_count,
                                        [this](std::uint32_t g) { return store.groupBoxes(g); });
      for (std::uint32_t g = 0; g < group_count; ++g)
        if (const GridBox content = store.groupContent(g); !content.empty()) extend(r->bounds, box(content));
      return r;
    });
  }

  // An item with several boxes comes once for each.
  template <typename Boxes>
  Node node(Kind items, std::uint64_t begin, std::uint64_t end, Boxes boxesOf) const {
    Node made{items, nullptr, {}};
    std::vector<WorldBox> boxes;
    for (auto id = static_cast<std::uint32_t>(begin); id < end; ++id) {
      for (const GridBox& content : boxesOf(id)) {
        if (content.empty()) continue;
        made.ids.push_back(id);
        boxes.push_back(box(content));
      }
    }
    made.boxes = std::make_unique<internal::BoxLevels>(boxes);
    return made;
  }
  Node nodeOfPages(std::uint64_t number) const {
    return node(Kind::pages, number * group_pages, std::min<std::uint64_t>(page_count, (number + 1) * group_pages),
                [this](std::uint32_t p) { return store.pageBoxes(p); });
  }
  Node nodeOfTiles(std::uint64_t number) const {
    const std::uint64_t end = std::min<std::uint64_t>(store.tile_count(), (number + 1) * page_tiles);
    return node(Kind::tiles, number * page_tiles, end,
                [this](TileId tile) { return std::array{listed(tile) ? store.entry(tile).content : GridBox{}}; });
  }

  const Node& groupNode(std::uint32_t number) {
    return group[number].get([&] { return std::make_unique<Node>(nodeOfPages(number)); });
  }
  const Node& pageNode(std::uint32_t number) {
    return page[number].get([&] { return std::make_unique<Node>(nodeOfTiles(number)); });
  }
  // The node of a group or page that `parent` lists.
  const Node& enter(const Node& parent, std::size_t item) {
    return parent.items == Kind::groups ? groupNode(parent.ids[item]) : pageNode(parent.ids[item]);
  }

  // Calls use(tile, box) for the tiles whose box may meet the region.
  template <typename Use>
  void meeting(const Node& from, const Region& region, const Use& use) {
    std::uint32_t entered = kNoTile;
    std::vector<std::uint32_t> items;
    from.boxes->meeting(region, [&](std::uint32_t item) { items.push_back(item); });
    std::sort(items.begin(), items.end());  // the boxes of a group or page follow each other
    for (const std::uint32_t item : items) {
      const std::uint32_t id = from.ids[item];
      if (from.items != Kind::tiles) {
        if (id != std::exchange(entered, id)) meeting(enter(from, item), region, use);
      } else if (const WorldBox tile_box = box(from, item); region.mayMeet(tile_box)) {
        use(id, tile_box);
      }
    }
  }
};

TileFinder::TileFinder(const TileStore& store) : impl_(std::make_unique<Impl>(store)) {}
TileFinder::TileFinder(const TileStore& store, std::vector<std::pair<TileId, WorldBox>> tiles) : TileFinder(store) {
  auto root = std::make_unique<Impl::Root>();
  for (const auto& [tile, box] : tiles) {
    extend(root->bounds, box);
    root->node.ids.push_back(tile);
    root->tile_boxes.push_back(box);
  }
  root->scanned = tiles.size() <= kScanTiles;
  root->node.boxes = std::make_unique<internal::BoxLevels>(root->tile_boxes);
  root->node.tile_boxes = root->tile_boxes.data();
  if (root->scanned) root->boxes = std::move(tiles);
  impl_->root.get([&] { return std::move(root); });
}
TileFinder::~TileFinder() = default;

std::vector<TileFinder::Hit> TileFinder::within(const Vector3d& h_W, double squared_bound) const {
  std::vector<Hit> hits;
  Walk steps = walk(h_W);
  while (const auto hit = steps.next(squared_bound)) hits.push_back(*hit);
  return hits;
}

void TileFinder::readPages(const Region& region) const {
  const TileStore& store = impl_->store;
  if (!store.isRemote() || impl_->open().scanned || impl_->open().node.tile_boxes != nullptr) return;
  const auto meets = [&](const GridBox& content) { return !content.empty() && region.mayMeet(impl_->box(content)); };
  std::vector<std::uint32_t> groups, new_groups, pages;
  for (std::uint32_t group = 0; group < impl_->group_count; ++group) {
    if (!meets(store.groupContent(group))) continue;
    groups.push_back(group);
    if (impl_->group_count > 1 && impl_->group[group].known() == nullptr) new_groups.push_back(group);
  }
  runItems(new_groups.size(), readsAtOnce(store), [&](std::size_t i) { impl_->groupNode(new_groups[i]); });
  for (const std::uint32_t group : groups) {
    const std::uint32_t first = group * impl_->group_pages;
    for (std::uint32_t page = first; page < std::min(impl_->page_count, first + impl_->group_pages); ++page)
      if (impl_->page[page].known() == nullptr && meets(store.pageContent(page))) pages.push_back(page);
  }
  runItems(pages.size(), readsAtOnce(store), [&](std::size_t i) { impl_->pageNode(pages[i]); });
}

std::vector<std::pair<TileId, WorldBox>> TileFinder::meeting(const Region& region) const {
  readPages(region);
  const Impl::Root& root = impl_->open();
  std::vector<std::pair<TileId, WorldBox>> hits;
  if (root.scanned) {
    for (const auto& [tile, box] : root.boxes)
      if (region.mayMeet(box)) hits.emplace_back(tile, box);
  } else {
    impl_->meeting(root.node, region, [&](TileId tile, const WorldBox& box) { hits.emplace_back(tile, box); });
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
    const Impl::Node* node;              // in whose hierarchy the place is
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

  Impl* finder;
  const Impl::Root* root;
  Vector3d h_W;
  internal::BoxLevels::Probe root_probe, probe;
  const Impl::Node* probed;  // `probe` is for this node
  std::vector<Opened> opened;
  std::vector<Waiting> heap;    // the first on top
  std::optional<Waiting> next;  // not in the heap

  // The state of the thread's last walk, so that the next one need not allocate.
  static thread_local std::unique_ptr<State> spare;

  void begin(Impl& of, const Vector3d& from_W);
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
  void open(const Impl::Node& node, Place place, double bound);
  void take(std::uint32_t at, double bound);
};

void TileFinder::Walk::State::open(const Impl::Node& node, Place place, double bound) {
  const bool is_root = &node == &root->node;
  if (!is_root && &node != probed) {
    probe = node.boxes->probe(h_W);
    probed = &node;
  }
  Opened& one = opened.emplace_back();
  one.node = &node;
  one.place = place;
  one.left = node.boxes->children(place);
  node.boxes->squaredBelow(is_root ? root_probe : probe, place, one.bounds);
  offerNearest(static_cast<std::uint32_t>(opened.size() - 1), bound);
}

// Takes the nearest child of a node.
void TileFinder::Walk::State::take(std::uint32_t at, double bound) {
  Opened& one = opened[at];
  const Impl::Node& node = *one.node;
  const std::uint32_t child = one.nearest.child();
  const Place place = internal::BoxLevels::child(one.place, child);
  one.bounds[child] = {std::numeric_limits<float>::infinity(), child};
  --one.left;
  offerNearest(at, bound);
  if (place.level >= 0) return open(node, place, bound);
  if (node.items == Impl::Kind::tiles) {
    const TileId tile = node.ids[place.at];
    return offer({finder->box(node, place.at).squaredDistanceBelow(h_W), true, tile});
  }
  const Impl::Node& entered = finder->enter(node, place.at);
  // An item that has another box nearby was entered before.
  const bool again =
      std::any_of(opened.begin(), opened.end(), [&entered](const Opened& before) { return before.node == &entered; });
  if (!again && entered.boxes->items() > 0) open(entered, entered.boxes->root(), bound);
}

thread_local std::unique_ptr<TileFinder::Walk::State> TileFinder::Walk::State::spare;

void TileFinder::Walk::State::begin(Impl& of, const Vector3d& from_W) {
  finder = &of;
  root = &of.open();
  h_W = from_W;
  probed = nullptr;
  opened.clear();
  heap.clear();
  next.reset();
  if (root->scanned) {
    for (const auto& [tile, box] : root->boxes) wait({box.squaredDistanceBelow(h_W), true, tile});
  } else if (const internal::BoxLevels& boxes = *root->node.boxes; boxes.items() > 0) {
    root_probe = boxes.probe(h_W);
    open(root->node, boxes.root(), std::numeric_limits<double>::infinity());
  }
}

TileFinder::Walk::Walk(std::unique_ptr<State> state) : state_(std::move(state)) {}
TileFinder::Walk::~Walk() {
  if (state_ != nullptr) State::spare = std::move(state_);
}
TileFinder::Walk::Walk(Walk&&) noexcept = default;

TileFinder::Walk TileFinder::walk(const Vector3d& h_W) const {
  auto state = std::move(Walk::State::spare);
  if (state == nullptr) state = std::make_unique<Walk::State>();
  state->begin(*impl_, h_W);
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
