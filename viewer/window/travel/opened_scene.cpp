#include "viewer/window/travel/opened_scene.h"

#include <utility>

namespace filiform {

void OpenedScene::hold(std::unique_ptr<TileSet> set) {
  revision = set->revision();
  open_levels = [&set = *set] {
    std::unique_ptr<Levels> opened = Levels::open(set);
    if (!opened && set.isRemote()) set.readDirectory();
    return opened;
  };
  if (set->isRemote()) network = [&set = *set] { return set.remoteCounters().value_or(RemoteCounters{}); };
  store = std::move(set);
}

}  // namespace filiform
