// Your own device: the program gives the position of a hand and gets the force on it, once a millisecond.
//
//   device SET.fil
#include <filiform/index/query/nearest.h>
#include <filiform/index/set/tile_set.h>
#include <filiform/solver/travel/session/stepped_travel.h>

#include <exception>
#include <iostream>

int main(int count, char** arguments) try {
  if (count != 2) return std::cerr << "usage: device SET.fil\n", 2;
  const auto set = filiform::TileSet::open(arguments[1]);
  const auto start = filiform::Nearest(*set).find({0, 700, 0}).at(0);
  filiform::SteppedTravel travel(*set, {.realtime = true});  // a tick never waits for the disk
  travel.jump(start.tile, start.segment, start.t);
  filiform::Vector3d hand_m(0, 0, 0), force_N(0, 0, 0);
  for (int tick = 0; tick < 1000; ++tick) {               // your loop
    hand_m.x() += 1e-5 + 1e-6 * force_N.x();              // read your device here
    force_N = travel.tick(hand_m, 0.001).wrench.force_N;  // command it here: at most 8 N
  }
  std::cout << "after 1000 ticks: " << force_N.norm() << " N\n";
} catch (const std::exception& error) {
  std::cerr << "device: " << error.what() << '\n';
  return 1;
}
