#include "solver/travel/run/internal/leg_planner.h"

#include <chrono>
#include <memory>

namespace filiform::internal {

LegPlanner::LegPlanner(Itinerary& itinerary) : itinerary_(itinerary), thread_([this] { plan(); }) {}

LegPlanner::~LegPlanner() {
  stopping_.store(true, std::memory_order_relaxed);
  thread_.join();
  Leg* leg = nullptr;
  while (planned_.pop(leg)) delete leg;
  while (travelled_.pop(leg)) delete leg;
}

Leg* LegPlanner::take() noexcept {
  Leg* leg = nullptr;
  planned_.pop(leg);
  return leg;
}

void LegPlanner::plan() {
  std::unique_ptr<Leg> next;
  try {
    while (!stopping_.load(std::memory_order_relaxed)) {
      Leg* leg = nullptr;
      while (travelled_.pop(leg)) delete leg;
      if (!next) next = itinerary_.next(&stopping_);
      if (planned_.push(next.get()))
        static_cast<void>(next.release());  // the haptic thread owns it
      else
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  } catch (...) {
    error_ = std::current_exception();
    failed_.store(true, std::memory_order_release);
  }
}

}  // namespace filiform::internal
