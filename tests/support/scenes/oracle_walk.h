// Walks a solver of the product beside the literal oracle of its method: the same walks for every method.
#pragma once

#include "tests/support/scenes/proxy_walk.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <vector>

namespace filiform::test {

// Runs one tick or its undo. Adds a failure if it allocates, locks or calls the system.
void watchedTick(ProxySolver& solver, const GraphView& view, const ProbeState& probe, SolverStep& step);
void watchedUndo(ProxySolver& solver);

inline constexpr std::uint32_t kUnbounded = 8000;  // more segments than any test tests in a tick

class Oracle {
 public:
  virtual ~Oracle() = default;
  virtual ProxyPlace place() const = 0;  // has no tile
  virtual void setPlace(const ProxyPlace& place) = 0;
  virtual std::uint32_t advance(const ProbeState& probe) = 0;  // the number of segments tested
};

// The parts of a method that the walks need. Variants 0 and 1 are two sets of parameters, which may be equal.
struct WalkedMethod {
  std::function<std::unique_ptr<ProxySolver>(std::uint64_t variant, std::uint32_t max_visited)> solver;
  std::function<std::unique_ptr<Oracle>(std::uint64_t variant, const WholeGraph& whole)> oracle;  // without a work cap
  std::function<std::vector<ProbeState>(const WholeGraph& whole, std::mt19937_64& random)> probes;
  std::uint32_t unbounded;        // more segments than any walk tests in a tick
  bool counts_everything = true;  // the solver's `visited` equals the oracle's; false: it is not more
};

struct Walked {                    // counts, so that a test can check that its walks moved
  std::uint64_t moved = 0;         // ticks that moved the oracle
  std::uint64_t farthest = 0;      // largest number of segments tested in a tick
  std::uint64_t frontiers = 0;     // ticks at a frontier, which were undone
  std::uint64_t started_long = 0;  // starts in a long-segment tile
};

// Expects that place, t, position and number of tests (see counts_everything) equal the oracle's, to the last bit at
// every tick, on random graphs (loops, lengths of zero, at 1e9 um) cut into tiles of 4, 16 and 2048 segments.
void walkInEveryTiling(const WalkedMethod& method, std::uint64_t seeds, Walked& walked);
// The same on the worst cases and a column, in the tiles that the product makes.
void walkOnTilesOfTheProduct(const WalkedMethod& method, Walked& walked);
// Tiles appear and disappear at random. After undo and loading the absent tiles, the same tick must give the result of
// the whole graph, for each cap in turn. Every tile reported absent must be absent, and the first one must be needed.
void walkThroughAbsentTiles(const WalkedMethod& method, std::uint64_t seeds, const std::vector<std::uint32_t>& caps,
                            Walked& walked);

}  // namespace filiform::test
