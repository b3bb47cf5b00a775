#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

namespace filiform::test {
namespace {

std::string numberedName(const char* stem, std::uint64_t number) {
  char text[64];
  std::snprintf(text, sizeof text, "%s/%06llu.swc", stem, static_cast<unsigned long long>(number));
  return text;
}

Vector3d randomDirection(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const Vector3d d(normal(random), normal(random), normal(random));
  return d.norm() > 1e-9 ? Vector3d(d.normalized()) : Vector3d::UnitX();
}

Cell named(Cell cell, const std::string& source, std::uint64_t digest) {
  cell.source = source;
  cell.digest = digest;
  return cell;
}

Cell moved(Cell cell, const Vector3d& by_W) {
  for (Vector3d& p_W : cell.positions_um) p_W += by_W;
  return cell;
}

Cell scaled(Cell cell, double factor) {
  for (Vector3d& p_W : cell.positions_um) p_W *= factor;
  return cell;
}

Cell zeroLengths(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Cell cell;
  Vector3d p_W = Vector3d::Zero();
  addSample(cell, p_W);
  for (std::uint32_t i = 1; i < 300; ++i) {
    if (random() % 3 != 0) p_W += randomDirection(random);
    addSample(cell, p_W, random() % 20 == 0 ? static_cast<std::uint32_t>(random() % i) : i - 1);
  }
  return cell;
}

// Reverses the file order, so that every parent comes after its children.
Cell reversed(const Cell& cell) {
  Cell r = cell;
  const auto last = static_cast<std::uint32_t>(cell.samples()) - 1;
  for (std::uint32_t i = 0; i <= last; ++i) {
    const std::uint32_t from = last - i;
    r.sample_ids[i] = cell.sample_ids[from];
    r.positions_um[i] = cell.positions_um[from];
    r.parents[i] = cell.parents[from] == kNoParent ? kNoParent : last - cell.parents[from];
    r.radii_um[i] = cell.radii_um[from];
    r.types[i] = cell.types[from];
  }
  return r;
}

}  // namespace

std::uint32_t addSample(Cell& cell, const Vector3d& p_W, std::uint32_t parent, float radius_um, std::uint16_t type) {
  const auto rank = static_cast<std::uint32_t>(cell.samples());
  cell.sample_ids.push_back(rank + 1);
  cell.positions_um.push_back(p_W);
  cell.parents.push_back(parent);
  cell.radii_um.push_back(radius_um);
  cell.types.push_back(type);
  return rank;
}

Cell randomNeuron(std::uint64_t seed, const NeuronShape& shape) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit;
  Cell cell = named({}, numberedName("neuron", seed), seed);
  Vector3d heading = randomDirection(random);
  for (std::uint32_t i = 0; i < shape.samples; ++i) {
    std::uint32_t parent = i == 0 || unit(random) < shape.extra_root ? kNoParent : i - 1;
    if (parent != kNoParent && unit(random) < shape.branching) {
      parent = static_cast<std::uint32_t>(random() % i);
      heading = randomDirection(random);
    }
    heading = (heading + 0.3 * randomDirection(random)).normalized();
    const Vector3d p_W =
        parent == kNoParent
            ? Vector3d(shape.origin_W + 20 * shape.step_um * randomDirection(random))
            : Vector3d(cell.positions_um[parent] + shape.step_um * (0.3 + 1.4 * unit(random)) * heading);
    const float radius_um = random() % 40 == 0 ? kUnknownRadius : static_cast<float>(0.05 + unit(random));
    addSample(cell, p_W, parent, radius_um, static_cast<std::uint16_t>(random() % 50 == 0 ? random() % 65536 : 3));
  }
  if (shape.shuffled_files) {
    std::int64_t id = -5;
    for (std::int64_t& sample_id : cell.sample_ids) sample_id = id += random() % 10 == 0 ? 1 + random() % 1000 : 1;
    if (seed % 2 == 0) return reversed(cell);
  }
  return cell;
}

std::vector<Cell> randomColumn(std::uint64_t seed, std::uint32_t cells, std::uint32_t samples_each, double extent_um) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-extent_um / 2, extent_um / 2);
  std::vector<Cell> column;
  for (std::uint32_t c = 0; c < cells; ++c) {
    NeuronShape shape;
    shape.samples = samples_each;
    shape.shuffled_files = c % 3 == 1;
    shape.origin_W = Vector3d(place(random), place(random), place(random));
    column.push_back(named(randomNeuron(seed * 1000 + c, shape), numberedName("column", c), random()));
  }
  return column;
}

std::vector<Cell> fineAndCoarse() {
  std::vector<Cell> cells{randomNeuron(1, {.samples = 2000, .step_um = 1}),
                          randomNeuron(2, {.samples = 400, .step_um = 12, .origin_W = kCoarse_W})};
  cells[0].source = "a";
  cells[1].source = "b";
  return cells;
}

Cell isolatedNodes(std::uint64_t seed, std::uint32_t n, double extent_um) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-extent_um / 2, extent_um / 2);
  Cell cell = named({}, "isolated.swc", seed);
  for (std::uint32_t i = 0; i < n; ++i) addSample(cell, Vector3d(place(random), place(random), place(random)));
  return cell;
}

Cell coincidentNodes(std::uint32_t n) {
  Cell cell = named({}, "coincident.swc", n);
  for (std::uint32_t i = 0; i < n; ++i) addSample(cell, Vector3d(1, 2, 3), i == 0 ? kNoParent : i - 1);
  return cell;
}

Cell hub(std::uint32_t branches, double length_um) {
  std::mt19937_64 random(branches);
  Cell cell = named({}, "hub.swc", branches);
  addSample(cell, Vector3d(5, -7, 11), kNoParent, 4.0f, 1);
  for (std::uint32_t i = 0; i < branches; ++i)
    addSample(cell, cell.positions_um[0] + length_um * randomDirection(random), 0);
  return cell;
}

Cell comb(std::uint32_t teeth) {
  Cell cell = named({}, "comb.swc", teeth);
  std::uint32_t spine = addSample(cell, Vector3d::Zero());
  for (std::uint32_t i = 1; i <= teeth; ++i) {
    addSample(cell, Vector3d(2.0 * (i - 1), 5, 0), spine);
    spine = addSample(cell, Vector3d(2.0 * i, 0, 0), spine);
  }
  return cell;
}

Cell longNeurite(std::uint32_t samples, double step_um) {
  Cell cell = named({}, "thread.swc", samples);
  for (std::uint32_t i = 0; i < samples; ++i)
    addSample(cell, step_um * Vector3d(i, 20 * std::sin(i * 0.05), 20 * std::cos(i * 0.03)),
              i == 0 ? kNoParent : i - 1);
  return cell;
}

std::vector<NamedCells> worstCases() {
  std::vector<NamedCells> all;
  const auto add = [&](const std::string& name, std::vector<Cell> cells) {
    for (std::size_t i = 0; i < cells.size(); ++i)
      cells[i] = named(std::move(cells[i]), numberedName(name.c_str(), i), i);
    all.push_back({name, std::move(cells)});
  };
  Cell one_node, one_segment, restarted = randomNeuron(3);
  addSample(one_node, Vector3d(1.25, -3, 1e6));
  addSample(one_segment, Vector3d(0, 0, 0));
  addSample(one_segment, Vector3d(1e6, 0, 0.1), 0);
  restarted.block_starts = {200, 350};
  for (std::uint32_t i = 200; i < restarted.samples(); ++i) restarted.sample_ids[i] = i - (i < 350 ? 199 : 349);
  for (std::uint32_t i = 200; i < restarted.samples(); ++i) {
    const std::uint32_t block = i < 350 ? 200 : 350;
    if (restarted.parents[i] != kNoParent && restarted.parents[i] < block)
      restarted.parents[i] = i == block ? kNoParent : i - 1;
  }
  std::vector<Cell> crossed = randomColumn(11, 6, 400, 300);
  Cell spear;
  addSample(spear, Vector3d(-2000, -1900, -1950));
  addSample(spear, Vector3d(2000, 1900, 1930), 0);
  addSample(spear, Vector3d(2001, 1900, 1930), 1);
  crossed.push_back(spear);
  Cell rail;  // enough leaves along the spear to make the spear a long segment
  for (std::uint32_t i = 0; i < 4000; ++i)
    addSample(rail, Vector3d(-2000.0 + i, -1900 + 0.95 * i, -1950 + 0.97 * i), i == 0 ? kNoParent : i - 1);
  crossed.push_back(rail);
  std::vector<Cell> outlier = randomColumn(12, 3, 300, 100);
  Cell far;
  addSample(far, Vector3d(1e9, -1e9, 1e9));
  addSample(far, Vector3d(1e9 - 3, -1e9, 1e9), 0);
  outlier.push_back(far);
  Cell bridge;
  addSample(bridge, Vector3d(0, 0, 0));
  addSample(bridge, Vector3d(-1e9, 1e9, 1e9), 0);
  outlier.push_back(bridge);
  std::vector<Cell> edge{moved(randomNeuron(6), Vector3d::Constant(Grid::kMaxCoordinate_um - 2500))};
  addSample(edge[0], Vector3d::Constant(Grid::kMaxCoordinate_um), 0);
  addSample(edge[0], Vector3d::Constant(-Grid::kMaxCoordinate_um), 1);
  std::vector<Cell> voxel = randomColumn(13, 4, 200, 10);
  for (Cell& cell : voxel) cell = scaled(std::move(cell), 1e-5);

  add("nothing", {});
  add("cell without samples", {Cell{}, randomNeuron(1), Cell{}});
  add("one node", {one_node});
  add("one segment", {one_segment});
  add("isolated nodes", {isolatedNodes(2, 500, 200), isolatedNodes(3, 300, 1)});
  add("coincident nodes", {coincidentNodes(700), randomNeuron(4)});
  add("hub", {hub(1200, 30)});
  add("comb", {comb(700)});
  add("thread", {longNeurite(3000, 2.5)});
  add("zero lengths", {zeroLengths(5)});
  add("long segment", crossed);
  add("far away", {moved(randomNeuron(7), Vector3d(1e9 - 5e3, 5e3 - 1e9, 1e9 - 5e3))});
  add("edge of the grid", edge);
  add("outlier", outlier);
  add("one voxel", voxel);
  add("equal cells", {randomNeuron(8), randomNeuron(8)});
  add("restarted block", {restarted});
  return all;
}

}  // namespace filiform::test
