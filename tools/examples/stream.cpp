// Streams the tiles around a point that crosses a tile set in one second, within a memory budget.
//
//   stream SET.fil [BUDGET_BYTES]
#include <filiform/index/set/tile_set.h>
#include <filiform/index/streaming/residency.h>

#include <chrono>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <memory>
#include <thread>

int main(int count, char** arguments) {
  if (count < 2) {
    std::cerr << "usage: stream SET.fil [BUDGET_BYTES]\n";
    return 2;
  }
  try {
    const std::unique_ptr<filiform::TileSet> set = filiform::TileSet::open(arguments[1]);
    filiform::ResidencyOptions options;
    options.prefetch = filiform::PrefetchPolicy::distance;
    options.budget_bytes =
        count > 2 ? std::strtoull(arguments[2], nullptr, 10) : filiform::Residency::floorBytes(*set) * 2;
    filiform::Residency residency(*set, options);
    filiform::TileReader& reader = residency.addReader("example");
    residency.start();  // starts the thread that reads tiles

    const filiform::Vector3d from_W = set->grid().toWorld(set->bounds().lo);
    const filiform::Vector3d to_W = set->grid().toWorld(set->bounds().hi);
    for (int tick = 0; tick <= 1000; ++tick) {
      filiform::ReaderFocus focus;
      focus.p_W = from_W + (to_W - from_W) * (tick / 1000.0);
      focus.v_W = to_W - from_W;  // um/s
      focus.radius_um = 100;
      reader.publishFocus(focus);  // neither call locks, allocates or waits
      reader.apply();
      if (tick % 200 == 0)
        std::cout << tick << " ms: at " << focus.p_W.transpose() << ", " << reader.tiles().size() << " of "
                  << set->tile_count() << " tiles in memory\n";
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    residency.stop();
    const filiform::ResidencyCounters counters = residency.counters();
    std::cout << counters.reads << " reads, " << counters.evictions << " evictions, at most " << counters.peak_bytes
              << " of " << options.budget_bytes << " bytes\n";
  } catch (const std::exception& error) {
    std::cerr << "stream: " << error.what() << '\n';
    return 1;
  }
}
