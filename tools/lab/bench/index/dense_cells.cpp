#include "tools/lab/bench/index/dense_cells.h"

#include "index/errors.h"
#include "index/input/input.h"
#include "index/text.h"
#include "tools/synthetic/synthetic.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <Eigen/Geometry>

namespace filiform::tools {

namespace {

bool plausible(const Cell& cell) {
  if (cell.isGraph()) return false;
  std::vector<double> lengths;
  for (std::size_t i = 0; i < cell.samples(); ++i)
    if (cell.parents[i] != kNoParent)
      lengths.push_back((cell.positions_um[i] - cell.positions_um[cell.parents[i]]).norm());
  if (lengths.size() < 500 || lengths.size() > 50000) return false;
  double sum = 0, longest = 0;
  for (const double length : lengths) sum += length, longest = std::max(longest, length);
  const double mean = sum / static_cast<double>(lengths.size());
  return mean > 0.3 && mean < 3 && longest < 100;
}

}  // namespace

std::vector<Cell> morphologyLibrary(const std::string& folder, std::size_t most, std::uint64_t seed) {
  std::vector<Cell> all;
  if (folder.empty()) {
    SyntheticOptions options;
    options.cells = static_cast<std::uint32_t>(most);
    options.seed = seed;
    SyntheticCells cells(options);
    for (Cell cell; cells.next(cell);) all.push_back(std::move(cell));
    return all;
  }
  Input input({folder});
  for (Cell cell; input.next(cell);)
    if (plausible(cell)) all.push_back(std::move(cell));
  if (all.empty())
    throw UsageError("--corpus " + escaped(folder) +
                     ": no reconstruction in it has 500 to 50 000 segments of 0.3 to 3 um on average; give a folder of "
                     "whole neurons in um (filiform check says what it holds)");
  if (all.size() <= most) return all;
  std::vector<Cell> some;
  for (std::size_t i = 0; i < most; ++i) some.push_back(std::move(all[i * all.size() / most]));
  return some;
}

DenseCells::DenseCells(const std::vector<Cell>& library, std::uint64_t segments, double per_um3, std::uint64_t seed)
    : library_(library), left_(segments), side_um_(std::cbrt(static_cast<double>(segments) / per_um3)), random_(seed) {}

bool DenseCells::next(Cell& cell) {
  if (left_ == 0) return false;
  std::normal_distribution<double> normal;
  const Cell& model = library_[random_() % library_.size()];
  const Eigen::Quaterniond turn =
      Eigen::Quaterniond(normal(random_), normal(random_), normal(random_), normal(random_)).normalized();
  std::uniform_real_distribution<double> place(0, side_um_);
  const Vector3d x = Vector3d(place(random_), place(random_), place(random_)) - turn * model.positions_um.front();

  cell = Cell{};
  cell.source = "placed/" + std::to_string(placed_) + ".swc";
  cell.digest = placed_++;
  using Shift = std::array<double, 3>;
  std::vector<Shift> shifts(model.samples());
  std::vector<std::uint32_t> rank(model.samples(), kNoParent);
  const auto add = [&](const Vector3d& p_W, std::uint32_t parent, std::size_t of) {
    cell.sample_ids.push_back(static_cast<std::int64_t>(cell.sample_ids.size()) + 1);
    cell.positions_um.push_back(p_W);
    cell.parents.push_back(parent);
    cell.radii_um.push_back(model.radii_um[of]);
    cell.types.push_back(model.types[of]);
    return static_cast<std::uint32_t>(cell.samples() - 1);
  };
  for (std::size_t i = 0; i < model.samples() && left_ > 0; ++i) {
    const Vector3d p = turn * model.positions_um[i] + x;
    Vector3d wrapped;
    for (int axis = 0; axis < 3; ++axis) {
      shifts[i][static_cast<std::size_t>(axis)] = std::floor(p[axis] / side_um_);
      wrapped[axis] = p[axis] - side_um_ * std::floor(p[axis] / side_um_);
    }
    const std::uint32_t parent = model.parents[i];
    std::uint32_t at = kNoParent;
    if (parent != kNoParent && rank[parent] != kNoParent) {
      at = rank[parent];
      if (shifts[parent] != shifts[i]) {  // repeat the parent, where this piece begins
        Vector3d before = turn * model.positions_um[parent] + x;
        for (int axis = 0; axis < 3; ++axis) before[axis] -= side_um_ * shifts[i][static_cast<std::size_t>(axis)];
        at = add(before, kNoParent, parent);
      }
      --left_;
    }
    rank[i] = add(wrapped, at, i);
  }
  return true;
}

}  // namespace filiform::tools
