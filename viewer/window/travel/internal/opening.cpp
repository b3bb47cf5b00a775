#include "viewer/window/travel/internal/opening.h"

#include "index/errors.h"
#include "index/text.h"
#include "viewer/window/travel/internal/started_session.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <future>

namespace filiform::internal {

namespace {

template <class T>
bool isThere(const std::future<T>& future) {
  return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

// The place that the caller wants, else the user's last place, else the soma of the largest cell; from far away, where
// a soma may take hundreds of reads, a neurite near the middle of the scene.
ProxyPlace startOf(Opened& opened, const std::string& place) {
  const TileStore& store = *opened.scene.store;
  if (!place.empty()) {
    try {
      return opened.finder->find(parseCellQuery(place));
    } catch (const Error& error) {
      opened.warnings.emplace_back(error.what());
    }
  }
  if (opened.saved && !opened.saved->history().places().empty())
    return opened.saved->history().places()[opened.saved->history().now()];
  if (store.cell_count() == 0) return {};
  if (store.isRemote()) {
    const GridBox usual = store.usualBox().box;
    if (usual.empty()) return {};
    const Vector3d middle_W = 0.5 * (store.grid().toWorld(usual.lo) + store.grid().toWorld(usual.hi));
    // The nearest neurite may take ten reads, one after the other.
    const auto found = opened.finder->anyNear(middle_W);
    return found ? found->place : ProxyPlace{};
  }
  std::uint32_t largest = 0;
  for (std::uint32_t cell = 1; cell < store.cell_count(); ++cell)
    if (store.cell(cell).segments > store.cell(largest).segments) largest = cell;
  return opened.finder->soma(largest);
}

Opened openScene(const std::vector<std::string>& paths, const std::string& place, const Opening::Open& open) {
  Opened opened;
  opened.scene = open(paths);
  const TileStore& store = *opened.scene.store;
  // From far away, levels and start come at the same time.
  std::future<std::unique_ptr<Levels>> levels;
  if (opened.scene.open_levels)
    levels =
        std::async(store.isRemote() ? std::launch::async : std::launch::deferred, std::ref(opened.scene.open_levels));
  opened.finder = std::make_unique<PlaceFinder>(store);
  try {
    opened.saved = std::make_unique<SavedHistory>(store, SavedHistory::pathFor(paths.front()));
    if (!opened.saved->warning().empty()) opened.warnings.push_back(opened.saved->warning());
  } catch (const Error& error) {
    opened.warnings.emplace_back(error.what());
  }
  opened.start = startOf(opened, place);
  if (levels.valid()) opened.scene.levels = levels.get();
  return opened;
}

}  // namespace

SessionOptions fitTo(const OpenedScene& scene, SessionOptions options) {
  options.in_memory = scene.in_memory;
  if (options.in_memory) options.budget_bytes.reset();
  return options;
}

void Opening::begin(const std::vector<std::string>& paths, const std::string& place, const Open& open,
                    Renderer& renderer, double now_s) {
  name_.clear();
  for (const std::string& path : paths) {
    if (!name_.empty()) name_ += ", ";
    name_ += escaped(path, 80);
  }
  since_s_ = now_s;
  scene_ = std::async(std::launch::async, [paths, place, open, &renderer] {
    Opened opened = openScene(paths, place, open);
    // Make it last: an exception after it would destroy it here, and its destructor uses the renderer.
    opened.picture = std::make_unique<SceneView>(*opened.scene.store, opened.scene.levels.get(), renderer);
    return opened;
  });
}

bool Opening::isSceneReady() const { return isThere(scene_); }
void Opening::takeScene() { opened_ = scene_.get(); }

void Opening::openDevice(const SessionOptions& options) {
  opened_->options = fitTo(opened_->scene, options);
  session_ = startSession(*opened_->scene.store, opened_->options);
}

bool Opening::isReady() const { return isThere(session_); }

Opened Opening::take() {
  Opened opened = std::move(*opened_);
  opened_.reset();
  opened.session = session_.get();
  return opened;
}

}  // namespace filiform::internal
