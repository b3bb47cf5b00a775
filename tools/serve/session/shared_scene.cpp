#include "tools/serve/session/shared_scene.h"

#include <algorithm>
#include <utility>

namespace filiform::tools {

namespace {

constexpr int kMessagesOfTick = 32;                              // of the loader
constexpr std::uint64_t kSearchBytes = std::uint64_t{16} << 20;  // of tiles kept for searches of places

}  // namespace

SharedScene::SharedScene(std::shared_ptr<const ServedSet> served, std::uint64_t budget_bytes, Ticker& ticker)
    : served_(std::move(served)),
      ticker_(ticker),
      residency_(served_->set(), {.budget_bytes = budget_bytes}),
      reader_(residency_.addReader("sessions")),
      places_(served_->store(), {.budget_bytes = std::max(kSearchBytes, 2 * served_->set().floorBytes())}) {
  residency_.start();
  ticker_.add(*this, true);
}

SharedScene::~SharedScene() {
  ticker_.remove(*this);
  residency_.stop();
}

void SharedScene::tick(std::uint64_t) noexcept { reader_.apply(kMessagesOfTick); }

}  // namespace filiform::tools
