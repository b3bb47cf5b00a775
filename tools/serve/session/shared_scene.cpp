#include "tools/serve/session/shared_scene.h"

#include <algorithm>
#include <utility>

namespace filiform::tools {

namespace {

constexpr int kMessagesOfTick = 32;                              // of the loader
constexpr std::uint64_t kSearchBytes = std::uint64_t{16} << 20;  // of tiles kept for searches of places

}  // namespace

SharedScene::SharedScene(std::shared_ptr<const ServedSet> served, std::uint64_t budget_bytes,
                         const std::vector<Ticker*>& tickers)
    : served_(std::move(served)),
      residency_(served_->set(), {.budget_bytes = budget_bytes}),
      places_(served_->store(), {.budget_bytes = std::max(kSearchBytes, 2 * served_->set().floorBytes())}) {
  for (Ticker* const ticker : tickers)
    parts_.push_back(std::make_unique<Part>(*ticker, residency_.addReader("sessions")));
  residency_.start();
  for (const auto& part : parts_) part->ticker.add(*part, true);
}

SharedScene::~SharedScene() {
  for (const auto& part : parts_) part->ticker.remove(*part);
  residency_.stop();
}

void SharedScene::Part::tick(std::uint64_t) noexcept { reader.apply(kMessagesOfTick); }

}  // namespace filiform::tools
