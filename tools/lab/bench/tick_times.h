// TickTimes: how long each tick of a walk takes, over several passes of the same walk. Thread rule: thread-compatible;
// the functions hold no state.
#pragma once

#include <cstddef>
#include <vector>

namespace filiform::tools {

double wallNow_ns();
// CPU time of the calling thread. Excludes the time of other threads; slower to read than wallNow_ns().
double threadNow_ns();
// Returns the time between two consecutive reads of the clock: the mean of 10 001, without the slowest 100.
double clockCost_ns(double (*now_ns)());

class TickTimes {
 public:
  TickTimes(std::size_t ticks, double clock_ns) : ticks_(ticks), clock_ns_(clock_ns) {}

  // Adds one time of a tick, measured between two reads of the clock. Their cost is subtracted.
  void add(std::size_t tick, double ns);

  // Over all times of all passes. Includes interruptions by other programs.
  struct Single {
    double p50_ns, p99_ns, p999_ns, max_ns;
  };
  Single single() const;
  // Over the ticks, each with the median of its passes. Excludes most interruptions.
  struct OfMedians {
    double mean_ns, p99_ns, p999_ns;
  };
  OfMedians ofMedians() const;
  // Returns the mean of each pass, without its slowest thousandth. Requires as many passes of each tick.
  std::vector<double> passes_ns() const;

 private:
  std::vector<std::vector<double>> ticks_;
  double clock_ns_;
};

}  // namespace filiform::tools
