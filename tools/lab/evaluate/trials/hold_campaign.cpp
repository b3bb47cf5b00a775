#include "tools/lab/evaluate/trials/hold_campaign.h"

#include "tools/lab/shared/parallel.h"
#include "tools/program/interruption.h"

#include <algorithm>
#include <random>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::size_t kPullsACell = 20;

struct Pull {
  std::uint32_t child;
  double t;
  Vector3d pull_m;
};

Pull drawPull(const TrialCell& cell, std::mt19937_64& random) {
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  Pull pull;
  do pull.child = static_cast<std::uint32_t>(random() % cell.graph().samples());
  while (cell.graph().parents[pull.child] == kNoParent);
  pull.t = uniform();
  do {  // named variables fix the order of the draws
    const double z = uniform() - 0.5, y = uniform() - 0.5, x = uniform() - 0.5;
    pull.pull_m = Vector3d(x, y, z);
  } while (pull.pull_m.norm() > 0.5 || pull.pull_m.isZero(0));
  pull.pull_m *= 0.03 * uniform() / pull.pull_m.norm();  // up to 30 mm, the largest pull of a person
  return pull;
}

}  // namespace

std::vector<HoldSeries> runHolds(const std::vector<CorpusCell>& cells, const HoldOptions& options) {
  const std::size_t pulls = options.quick ? 4 : 300;
  std::vector<HoldSeries> series;
  for (const auto& [hand, stiffness] : {std::pair<const char*, double>{"medium", 200}, {"medium", 500}, {"loose", 50}})
    for (const double zoom : {300.0, 1000.0})
      for (const std::string& method : options.methods)
        series.push_back({method, hand, stiffness, zoom, std::vector<HoldResult>(pulls)});
  const std::size_t groups = (pulls + kPullsACell - 1) / kPullsACell;
  const auto holdGroup = [&](std::size_t group) {
    TrialCell cell(cells[group * cells.size() / groups].cell);
    std::mt19937_64 random(options.seed * 0x9e3779b97f4a7c15u + group);
    for (std::size_t i = group * kPullsACell; i < std::min(pulls, (group + 1) * kPullsACell); ++i) {
      throwIfInterrupted();
      const Pull pull = drawPull(cell, random);
      for (HoldSeries& one : series) {
        TrialSetup setup;
        setup.method = one.method;
        setup.hand = one.hand;
        setup.stiffness_N_m = one.stiffness_N_m;
        setup.zoom_um = one.zoom_um;
        one.results[i] = runHold(cell, pull.child, pull.t, pull.pull_m, setup);
      }
    }
  };
  parallelFor(groups, options.threads, holdGroup, [&] {
    if (options.progress) options.progress(groups);
  });
  return series;
}

}  // namespace filiform::tools
