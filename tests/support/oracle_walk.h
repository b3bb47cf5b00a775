// Walks of a solver of the product beside the literal oracle of its method: the same walks for every method.
#pragma once

#include "tests/support/proxy_walk.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <vector>

namespace filiform::test {

// One tick, or its undo, and a failure if it allocates, locks or calls the system.
void watchedTick(ProxySolver& solver, const GraphView& view, const ProbeState& probe, SolverStep& step);
void watchedUndo(ProxySolver& solver);

inline constexpr std::uint32_t kUnbounded = 8000;  // more than any walk of the tests tests in a tick

class Oracle {
 public:
  virtual ~Oracle() = default;
  virtual ProxyPlace place() const = 0;  // without a tile
  virtual void setPlace(const ProxyPlace& place) = 0;
  virtual std::uint32_t advance(const ProbeState& probe) = 0;  // the number of segments tested
};

// What the walks need to know of a method. Variants are sets of parameters, 0 and 1, which may be the same.
struct WalkedMethod {
  std::function<std::unique_ptr<ProxySolver>(std::uint64_t variant, std::uint32_t max_visited)> solver;
  std::function<std::unique_ptr<Oracle>(std::uint64_t variant, const WholeGraph& whole)> oracle;  // without a cap
  std::function<std::vector<ProbeState>(const WholeGraph& whole, std::mt19937_64& random)> probes;
  std::uint32_t unbounded;  // more than any walk here tests in a tick
};

struct Walked {                    // so that a test can say that its walks did walk
  std::uint64_t moved = 0;         // ticks that moved the oracle
  std::uint64_t farthest = 0;      // segments tested in a tick, at most
  std::uint64_t frontiers = 0;     // met and taken back
  std::uint64_t started_long = 0;  // starts in a long-segment tile
};

// Place, t, position and number of tests equal the oracle's, to the last bit at every tick, on random graphs (loops,
// lengths of zero, at 1e9 um) cut into tiles of 4, 16 and 2048 segments.
void walkInEveryTiling(const WalkedMethod& method, std::uint64_t seeds, Walked& walked);
// The same on the worst cases and a column, in the tiles that the product cuts.
void walkOnTilesOfTheProduct(const WalkedMethod& method, Walked& walked);
// Tiles come and go at random; undo, load what was absent, and the same tick again give the answer of the whole graph,
// for each cap in turn. What is reported absent is absent, and the first of it needed.
void walkThroughAbsentTiles(const WalkedMethod& method, std::uint64_t seeds, const std::vector<std::uint32_t>& caps,
                            Walked& walked);

}  // namespace filiform::test
