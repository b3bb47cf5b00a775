// A thread that plans the legs of a tour ahead of the haptic thread, and frees legs that were travelled.
//
// Thread rule: take() and giveBack() belong to the haptic thread and are haptic-safe. All other members belong to the
// thread that owns the planner.
#pragma once

#include "index/spsc_ring.h"
#include "solver/travel/run/internal/itinerary.h"

#include <atomic>
#include <cstddef>
#include <exception>
#include <thread>

namespace filiform::internal {

class LegPlanner {
 public:
  // Starts the thread. The itinerary must outlive the planner; meanwhile only the planner's thread may use it.
  explicit LegPlanner(Itinerary& itinerary);
  // Stops planning, waits for the loads of tiles under way; frees all legs that the planner has.
  ~LegPlanner();
  LegPlanner(const LegPlanner&) = delete;
  LegPlanner& operator=(const LegPlanner&) = delete;

  // The next leg, which the caller then owns; nullptr: no leg is ready.
  Leg* take() noexcept;
  // Passes on a leg to be freed. Returns false if there is no room: the caller keeps the leg and tries again after a
  // tick.
  bool giveBack(Leg* leg) noexcept { return travelled_.push(leg); }

  bool failed() const { return failed_.load(std::memory_order_acquire); }
  // Rethrows the itinerary's exception. Requires failed().
  void rethrow() const { std::rethrow_exception(error_); }

 private:
  static constexpr std::size_t kLegsAhead = 4;
  void plan();

  Itinerary& itinerary_;
  SpscRing<Leg*> planned_{kLegsAhead}, travelled_{2 * kLegsAhead};
  std::atomic<bool> stopping_{false}, failed_{false};
  std::exception_ptr error_;
  std::thread thread_;
};

}  // namespace filiform::internal
