// What compare.py compares Python with: the same questions in C++. Prints the seconds for all points at once, and the
// microseconds for one point, each repeated.
//   filiform_python_loop SET POINTS REPEATS     POINTS: raw float64, x y z of each point
//   filiform_python_loop SET REPEATS            decodes all tiles with their radii and types; prints CPU seconds
#include "index/query/nearest.h"
#include "index/set/tile_set.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <vector>

int decodeAll(const char* name, int repeats) {
  const auto set = filiform::TileSet::open(name);
  std::uint64_t segments = 0;
  for (int i = 0; i < repeats; ++i) {
    const std::clock_t begin = std::clock();
    for (filiform::TileId tile = 0; tile < set->tile_count(); ++tile)
      segments += set->load(tile)->segment_count() + set->loadAppearance(tile).types.size();
    std::cout << "decode " << static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC << '\n';
  }
  return segments > 0 ? 0 : 1;
}

int main(int argc, char** argv) {
  if (argc == 3) return decodeAll(argv[1], std::atoi(argv[2]));
  if (argc != 4) return 2;
  using Clock = std::chrono::steady_clock;
  const auto seconds = [](Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  };
  std::vector<filiform::Vector3d> points(std::filesystem::file_size(argv[2]) / sizeof(filiform::Vector3d));
  std::ifstream file(argv[2], std::ios::binary);
  file.read(reinterpret_cast<char*>(points.data()),
            static_cast<std::streamsize>(points.size() * sizeof(filiform::Vector3d)));
  const auto set = filiform::TileSet::open(argv[1]);
  const filiform::Nearest nearest(*set, {.budget_bytes = std::uint64_t{4} << 30});
  double sum = 0;
  for (const auto& results : nearest.findAll(points)) sum += results.front().distance_um;
  const std::size_t some = std::min<std::size_t>(points.size(), 20'000);
  std::cout << "sum " << sum << '\n';
  for (int i = 0; i < std::atoi(argv[3]); ++i) {
    auto begin = Clock::now();
    for (const auto& results : nearest.findAll(points)) sum += results.front().distance_um;
    std::cout << "all " << seconds(begin) << '\n';
    begin = Clock::now();
    for (std::size_t p = 0; p < some; ++p) sum += nearest.find(points[p]).front().distance_um;
    std::cout << "one " << 1e6 * seconds(begin) / static_cast<double>(some) << '\n';
  }
  return sum > 0 ? 0 : 1;
}
