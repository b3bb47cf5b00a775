#include "tools/lab/bench/tick_times.h"

#include "tools/lab/bench/bench.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <numeric>

namespace filiform::tools {

namespace {

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

double wallNow_ns() {
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double threadNow_ns() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e9 * static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec);
}

double clockCost_ns(double (*now_ns)()) {
  std::vector<double> costs;
  for (int i = 0; i < 10001; ++i) {
    const double start_ns = now_ns();
    costs.push_back(now_ns() - start_ns);
  }
  std::sort(costs.begin(), costs.end());
  return mean({costs.begin(), costs.end() - 100});
}

void TickTimes::add(std::size_t tick, double ns) { ticks_[tick].push_back(ns - clock_ns_); }

TickTimes::Single TickTimes::single() const {
  std::vector<double> all;
  for (const std::vector<double>& of_tick : ticks_) all.insert(all.end(), of_tick.begin(), of_tick.end());
  return {percentile(all, 0.5), percentile(all, 0.99), percentile(all, 0.999), percentile(all, 1.0)};
}

TickTimes::OfMedians TickTimes::ofMedians() const {
  std::vector<double> each;
  for (const std::vector<double>& of_tick : ticks_) each.push_back(median(of_tick));
  return {mean(each), percentile(each, 0.99), percentile(each, 0.999)};
}

std::vector<double> TickTimes::passes_ns() const {
  std::vector<double> passes;
  for (std::size_t pass = 0; pass < ticks_.front().size(); ++pass) {
    std::vector<double> of_pass;
    for (const std::vector<double>& of_tick : ticks_) of_pass.push_back(of_tick[pass]);
    std::sort(of_pass.begin(), of_pass.end());
    of_pass.resize(of_pass.size() - of_pass.size() / 1000);
    passes.push_back(mean(of_pass));
  }
  return passes;
}

}  // namespace filiform::tools
