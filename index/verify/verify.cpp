#include "index/verify/verify.h"

#include "index/attributes/cell_attributes.h"
#include "index/errors.h"
#include "index/levels/levels.h"
#include "index/verify/internal/deep_check.h"
#include "index/verify/set_digest.h"

#include <memory>

namespace filiform {
namespace {

class Checker {
 public:
  Checker(VerifyReport& report, const VerifyOptions& options) : report_(report), options_(options) {}

  void problem(const std::string& what) {
    if (report_.problem_count++ < VerifyReport::kMaxProblems) report_.problems.push_back(what);
  }
  // Runs a check and reports the damage that it throws.
  template <typename Check>
  void attempt(Check check) {
    try {
      check();
    } catch (const CorruptSet& damage) {
      problem(damage.what());
    }
  }
  void step(const char* phase, std::uint64_t done, std::uint64_t total) {
    if (options_.cancel != nullptr && options_.cancel->load(std::memory_order_relaxed))
      throw Interrupted("interrupted");
    if (options_.progress) options_.progress(phase, done, total);
  }

 private:
  VerifyReport& report_;
  const VerifyOptions& options_;
};

}  // namespace

VerifyReport verify(const std::string& path, const VerifyOptions& options) {
  VerifyReport report;
  Checker checker(report, options);
  std::unique_ptr<TileSet> set;
  checker.attempt([&] {
    set = TileSet::open(path, options.remote);
    set->checkDirectory();
  });
  if (!report.sound()) return report;
  for (const SetFile& file : set->files()) {
    checker.step("checking files", report.bytes, set->bytes());
    checker.attempt([&] { set->checkFile(file); });
    report.bytes += file.bytes;
  }
  if (!options.sha256.empty()) {
    checker.attempt([&] {
      const std::string found =
          setDigest(*set, [&](std::uint64_t done) { checker.step("comparing the SHA-256", done, set->bytes()); });
      if (found != options.sha256) checker.problem(path + ": its SHA-256 is " + found + ", not the given one");
    });
  }
  internal::DeepCheck deep(*set, [&](const std::string& what) { checker.problem(what); });
  for (TileId t = 0; t < set->tile_count(); ++t) {
    checker.step("checking tiles", t, set->tile_count());
    checker.attempt([&] {
      const std::shared_ptr<const Tile> tile = set->load(t);
      if (options.deep) deep.midpoints(*tile);
    });
    checker.attempt([&] { set->loadAppearance(t); });
    ++report.tiles;
  }
  checker.attempt([&] {
    set->checkCells();
    for (std::uint32_t c = 0; c < set->cell_count(); ++c) set->loadCellDetail(c);
  });
  checker.attempt([&] { CellAttributes(*set).check(); });
  checker.attempt([&] { set->landmarks(); });
  std::unique_ptr<Levels> levels;
  checker.attempt([&] { levels = Levels::open(*set); });
  for (LevelId l = 0; levels != nullptr && l < levels->size(); ++l) {
    checker.step("checking levels", l, levels->size());
    checker.attempt([&] { levels->load(l); });
    checker.attempt([&] { levels->loadAppearance(l); });
  }
  if (!options.deep || !report.sound()) return report;

  checker.attempt([&] {
    if (!deep.begin()) return;
    for (TileId t = 0; t < set->tile_count(); ++t) {
      checker.step("checking segments", t, set->tile_count());
      deep.tile(*set->load(t), set->loadAppearance(t));
    }
    checker.step("checking cells", 0, 0);
    deep.finish();
    if (levels == nullptr) return;
    for (const std::string& what : checkLevels(*set, *levels)) checker.problem(what);
  });
  return report;
}

}  // namespace filiform
