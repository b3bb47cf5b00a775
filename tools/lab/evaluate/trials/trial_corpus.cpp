#include "tools/lab/evaluate/trials/trial_corpus.h"

#include "index/geometry/grid.h"
#include "solver/travel/routes/route.h"
#include "tools/lab/evaluate/trials/trial_cell.h"

#include <algorithm>
#include <optional>
#include <random>
#include <tuple>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
  x = (x ^ x >> 27) * 0x94d049bb133111ebu;
  return x ^ x >> 31;
}

// Nearly uniform below n, and the same with every library.
std::uint32_t below(std::mt19937_64& random, std::size_t n) { return static_cast<std::uint32_t>(random() % n); }

class Drawing {
 public:
  Drawing(const Cell& cell, const RouteDraw& draw) : cell_(cell), draw_(draw) {
    const std::size_t samples = cell.samples();
    root_.resize(samples);
    level_.resize(samples);
    depth_um_.resize(samples);
    std::vector<bool> has_child(samples, false);
    const Grid grid;
    for (const std::uint32_t rank : parentsFirst(cell.parents)) {
      const std::uint32_t parent = cell.parents[rank];
      if (parent == kNoParent) {
        root_[rank] = rank;
        continue;
      }
      has_child[parent] = true;
      root_[rank] = root_[parent];
      level_[rank] = level_[parent] + 1;
      const GridPoint d = grid.snap(cell.positions_um[rank]) - grid.snap(cell.positions_um[parent]);
      depth_um_[rank] = depth_um_[parent] + grid.toWorld(d).norm();
    }
    for (std::uint32_t rank = 0; rank < samples; ++rank)
      if (cell.parents[rank] != kNoParent && !has_child[rank]) tips_.push_back(rank);
  }

  std::vector<DrawnRoute> operator()() const {
    std::vector<DrawnRoute> routes;
    const auto add = [&](std::uint32_t first, std::uint32_t last, bool tip_to_tip) {
      if (const auto route = between(first, last, tip_to_tip)) routes.push_back(*route);
    };
    for (const std::uint32_t tip : tips_) add(root_[tip], tip, false);
    if (tips_.size() > 1) {
      std::mt19937_64 random(mixed(cell_.digest ^ mixed(draw_.seed)));
      for (int i = 0; i < draw_.tip_to_tip; ++i) {
        const std::uint32_t first = tips_[below(random, tips_.size())], last = tips_[below(random, tips_.size())];
        if (first != last && root_[first] == root_[last]) add(first, last, true);
      }
    }
    std::sort(routes.begin(), routes.end(), [](const DrawnRoute& a, const DrawnRoute& b) {
      return std::tie(a.key, a.last, a.first) < std::tie(b.key, b.last, b.first);
    });
    const auto same = [](const DrawnRoute& a, const DrawnRoute& b) { return a.first == b.first && a.last == b.last; };
    routes.erase(std::unique(routes.begin(), routes.end(), same), routes.end());
    return routes;
  }

 private:
  std::optional<DrawnRoute> between(std::uint32_t first, std::uint32_t last, bool tip_to_tip) const {
    DrawnRoute route;
    route.tip_to_tip = tip_to_tip;
    // Depends only on the file's text about the two nodes: the order of reading and tiling does not matter.
    route.key =
        mixed(cell_.digest ^ mixed(static_cast<std::uint64_t>(cell_.sample_ids[first]) ^
                                   mixed(static_cast<std::uint64_t>(cell_.sample_ids[last]) ^ mixed(draw_.seed))));
    const std::vector<std::uint32_t>& parents = cell_.parents;
    std::uint32_t meeting = first;
    for (std::uint32_t other = last; meeting != other;) {
      const bool climb = level_[meeting] >= level_[other], climb_other = level_[other] >= level_[meeting];
      if (climb) meeting = parents[meeting];
      if (climb_other) other = parents[other];
    }
    // The route goes up from `first` to the meeting and down to `last`. A cut shortens its beginning.
    const double down_um = depth_um_[last] - depth_um_[meeting];
    const auto length_um = [&](std::uint32_t from) { return depth_um_[from] - depth_um_[meeting] + down_um; };
    route.length_um = length_um(first);
    route.cut = route.length_um > draw_.longest_um;
    while (first != meeting && length_um(first) > draw_.longest_um) first = parents[first];
    if (route.cut) route.length_um = length_um(first);
    if (route.length_um > draw_.longest_um) {
      first = last;
      while (depth_um_[last] - depth_um_[parents[first]] <= draw_.longest_um) first = parents[first];
      route.length_um = depth_um_[last] - depth_um_[first];
    }
    route.first = first;
    route.last = last;
    if (!(route.length_um >= draw_.shortest_um)) return std::nullopt;
    return route;
  }

  const Cell& cell_;
  const RouteDraw& draw_;
  std::vector<std::uint32_t> root_, level_, tips_;
  std::vector<double> depth_um_;
};

}  // namespace

std::vector<DrawnRoute> drawRoutes(const Cell& cell, const RouteDraw& draw) {
  if (cell.isGraph()) return {};
  return Drawing(cell, draw)();
}

TrialCorpus drawCorpus(CellStream& stream, std::uint64_t routes, const RouteDraw& draw) {
  TrialCorpus corpus;
  std::vector<CorpusCell> all;
  for (Cell cell; stream.next(cell);) {
    ++corpus.listed;
    CorpusCell one;
    corpus.graphs += cell.isGraph();
    one.routes = drawRoutes(cell, draw);
    one.cell = std::move(cell);
    all.push_back(std::move(one));
  }
  std::sort(all.begin(), all.end(), [](const CorpusCell& a, const CorpusCell& b) {
    return std::tie(a.cell.digest, a.cell.source) < std::tie(b.cell.digest, b.cell.source);
  });
  const auto same = [](const CorpusCell& a, const CorpusCell& b) { return a.cell.digest == b.cell.digest; };
  const auto end = std::unique(all.begin(), all.end(), same);
  corpus.duplicates = static_cast<std::uint64_t>(all.end() - end);
  all.erase(end, all.end());
  corpus.unsuitable = std::erase_if(all, [](const CorpusCell& one) { return one.routes.empty(); });

  for (std::size_t i = 0; i < all.size(); ++i) all[i].held_out = 3 * i >= 2 * all.size();
  std::vector<std::size_t> taken(all.size(), 0);
  while (corpus.routes < routes) {
    std::vector<std::size_t> left;  // cells that have more routes
    for (std::size_t i = 0; i < all.size(); ++i)
      if (all[i].routes.size() > taken[i]) left.push_back(i);
    if (left.empty()) break;
    // The last round takes only a part of the cells, spread evenly.
    const std::uint64_t wanted = std::min<std::uint64_t>(left.size(), routes - corpus.routes);
    for (std::uint64_t k = 0; k < wanted; ++k) ++taken[left[k * left.size() / wanted]];
    corpus.routes += wanted;
  }
  for (std::size_t i = 0; i < all.size(); ++i) all[i].routes.resize(taken[i]);
  std::erase_if(all, [](const CorpusCell& one) { return one.routes.empty(); });
  corpus.cells = std::move(all);
  return corpus;
}

}  // namespace filiform::tools
