#include "viewer/internal/opening.h"

#include "index/errors.h"
#include "index/text.h"

#include <chrono>

namespace filiform::internal {

namespace {

Opened openScene(const std::vector<std::string>& paths, const Opening::Open& open) {
  Opened opened;
  opened.scene = open(paths);
  const TileStore& store = *opened.scene.store;
  opened.finder = std::make_unique<PlaceFinder>(store);
  try {
    opened.saved = std::make_unique<SavedHistory>(store, SavedHistory::pathFor(paths.front()));
    if (!opened.saved->warning().empty()) opened.warnings.push_back(opened.saved->warning());
  } catch (const Error& error) {
    opened.warnings.emplace_back(error.what());
  }
  if (opened.saved && !opened.saved->history().places().empty())
    opened.start = opened.saved->history().places()[opened.saved->history().now()];
  if (opened.start.valid() || store.cell_count() == 0) return opened;
  std::uint32_t largest = 0;
  for (std::uint32_t cell = 1; cell < store.cell_count(); ++cell)
    if (store.cell(cell).segments > store.cell(largest).segments) largest = cell;
  opened.start = opened.finder->soma(largest);
  return opened;
}

}  // namespace

void Opening::begin(const std::vector<std::string>& paths, const Open& open, double now_s) {
  name_.clear();
  for (const std::string& path : paths) {
    if (!name_.empty()) name_ += ", ";
    name_ += escaped(path, 80);
  }
  since_s_ = now_s;
  opening_ = std::async(std::launch::async, [paths, open] { return openScene(paths, open); });
}

bool Opening::isReady() const {
  return opening_.valid() && opening_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

Opened Opening::take() { return opening_.get(); }

}  // namespace filiform::internal
