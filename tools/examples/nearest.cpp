// Opens a tile set and prints the segments nearest to a point.
//
//   nearest SET.fil X Y Z [COUNT]      X Y Z in um
#include <filiform/index/query/nearest.h>
#include <filiform/index/set/tile_set.h>

#include <cstdlib>
#include <exception>
#include <iostream>
#include <memory>

int main(int count, char** arguments) {
  if (count < 5) {
    std::cerr << "usage: nearest SET.fil X Y Z [COUNT]\n";
    return 2;
  }
  try {
    const std::unique_ptr<filiform::TileSet> set = filiform::TileSet::open(arguments[1]);
    const filiform::Vector3d point_W(std::atof(arguments[2]), std::atof(arguments[3]), std::atof(arguments[4]));
    const std::size_t wanted = count > 5 ? std::strtoul(arguments[5], nullptr, 10) : 1;

    const filiform::Nearest nearest(*set);  // reads only the tiles that a query needs
    for (const filiform::NearestResult& found : nearest.find(point_W, {.k = wanted}))
      std::cout << set->cell(found.segment.cell).name << " at " << found.distance_um << " um, nearest point "
                << found.p_W.transpose() << '\n';
    std::cout << nearest.bytes() << " bytes of tiles in memory\n";
  } catch (const std::exception& error) {
    std::cerr << "nearest: " << error.what() << '\n';
    return 1;
  }
}
