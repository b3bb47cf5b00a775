// How long single ticks take that are repeated in passes over the same probes. Thread rule: functions without state; a
// TickTimes is for one thread.
#pragma once

#include <cstddef>
#include <vector>

namespace filiform::tools {

double wallNow_ns();
// Of this thread: stands still while others have the processor. Dearer to read.
double threadNow_ns();
// What reading the clock twice takes by itself.
double clockCost_ns(double (*now_ns)());

class TickTimes {
 public:
  TickTimes(std::size_t ticks, double clock_ns) : ticks_(ticks), clock_ns_(clock_ns) {}

  // Of a tick, with the reading of the clock, which is subtracted.
  void add(std::size_t tick, double ns);

  // All passes together; interruptions by other programs are included.
  struct Single {
    double p50_ns, p99_ns, p999_ns, max_ns;
  };
  Single single() const;
  // Each tick counts once, with the median of its passes, which leaves interruptions out.
  struct OfMedians {
    double mean_ns, p99_ns, p999_ns;
  };
  OfMedians ofMedians() const;
  // The mean tick of each pass, without the slowest thousandth.
  std::vector<double> passes_ns() const;

 private:
  std::vector<std::vector<double>> ticks_;
  double clock_ns_;
};

}  // namespace filiform::tools
