#include "index/levels/internal/neurites.h"

#include "index/ingest/memory_tiles.h"
#include "index/levels/internal/path_thinner.h"
#include "tests/support/sanitized.h"
#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <tuple>

#include <gtest/gtest.h>

namespace filiform {
namespace {

const Grid kGrid;

double distance(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d way = b - a;
  const double squared = way.squaredNorm();
  const double t = squared > 0 ? std::clamp((p - a).dot(way) / squared, 0.0, 1.0) : 0.0;
  return (p - a - t * way).norm();
}

struct Line {
  std::uint32_t cell;
  Vector3d a, b;
};

std::vector<Line> linesOf(const Neurites& all) {
  std::vector<Line> lines;
  for (const NeuritePath& path : all.paths) {
    const auto at = [&](std::uint32_t k) { return kGrid.toWorld(all.points[path.begin + k].p); };
    if (path.isBall()) lines.push_back({path.cell, at(0), at(0)});
    for (std::uint32_t k = 1; k < path.count; ++k) lines.push_back({path.cell, at(k - 1), at(k)});
  }
  return lines;
}

// The largest distance, cell by cell, from points on some lines to the others.
double farthest(const std::vector<Line>& from, const std::vector<Line>& to) {
  std::map<std::uint32_t, std::vector<Line>> by_cell;
  for (const Line& line : to) by_cell[line.cell].push_back(line);
  double worst = 0;
  for (const Line& line : from)
    for (const double t : {0.0, 0.3, 0.5, 0.8, 1.0}) {
      double nearest = std::numeric_limits<double>::infinity();
      for (const Line& o : by_cell[line.cell])
        nearest = std::min(nearest, distance(line.a + t * (line.b - line.a), o.a, o.b));
      worst = std::max(worst, nearest);
    }
  return worst;
}

Neurites wholeOf(const std::vector<Cell>& cells) {
  CellList stream(cells);
  const auto store = buildTilesInMemory(stream, {.capacity = 1u << 30});
  if (store->tile_count() == 0) return {};
  return neuritesOf(*store->load(0), store->loadAppearance(0));
}

// The neurites of every tile of a store with many.
std::vector<Neurites> partsOf(const std::vector<Cell>& cells, std::uint32_t capacity) {
  CellList stream(cells);
  const auto store = buildTilesInMemory(stream, {.capacity = capacity});
  std::vector<Neurites> parts;
  for (TileId t = 0; t < store->tile_count(); ++t)
    parts.push_back(neuritesOf(*store->load(t), store->loadAppearance(t)));
  return parts;
}

std::uint64_t segmentsOf(const std::vector<Cell>& cells) { return wholeOf(cells).represented; }

// The worst case of each kind of cell, and random cells.
std::vector<test::NamedCells> inputs() {
  std::vector<test::NamedCells> all = test::worstCases();
  for (std::uint64_t seed = 1; seed <= 4; ++seed)
    all.push_back({"column " + std::to_string(seed), test::randomColumn(seed, 4, 300, 100)});
  return all;
}

TEST(Neurites, SimplifyingStaysWithinTheErrorThatItStatesInBothDirections) {
  for (const test::NamedCells& input : inputs()) {
    const Neurites whole = wholeOf(input.cells);
    const std::vector<Line> lines = linesOf(whole);
    if (lines.size() > (test::kSanitized ? 600u : 2000u)) continue;  // compares all with all
    for (const double tolerance : {0.01, 0.5, 3.0, 40.0, 1e4}) {
      SCOPED_TRACE(input.name + ", tolerance " + std::to_string(tolerance));
      Neurites simple = whole;
      simplify(simple, kGrid, tolerance);
      EXPECT_LE(simple.error_um, tolerance * (1 + 1e-9));
      const double slack = 1e-6 + 1e-12 * 2e9;  // for the distances here, at 1e9 um
      EXPECT_LE(farthest(lines, linesOf(simple)), simple.error_um + slack);
      EXPECT_LE(farthest(linesOf(simple), lines), simple.error_um + slack);
      EXPECT_LE(linesOf(simple).size(), lines.size());
      EXPECT_EQ(simple.represented, whole.represented);
      std::uint64_t stand_for = 0;
      for (const NeuritePoint& point : simple.points) stand_for += point.segments;
      EXPECT_LE(stand_for, whole.represented);
    }
  }
}

// thinned() of the tiles of a store; the same segments, joined.
Neurites thinnedOf(const std::vector<Cell>& cells, std::uint32_t capacity, double tolerance_um) {
  CellList stream(cells);
  const auto store = buildTilesInMemory(stream, {.capacity = capacity});
  Neurites all;
  for (TileId t = 0; t < store->tile_count(); ++t) {
    const auto tile = store->load(t);
    std::vector<StoredSegment> segments;
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
      const Tile::Link link = tile->link(s);
      segments.push_back({link.id, link.child_id.sample, link.parent_id.sample, tile->gridPoint(link.child),
                          tile->gridPoint(link.parent), tile->owned(s)});
    }
    append(all, thinned(segments, store->loadAppearance(t), kGrid, tolerance_um));
  }
  return linked(std::move(all));
}

TEST(PathThinner, StaysWithinItsToleranceInBothDirections) {
  for (const test::NamedCells& input : inputs()) {
    const Neurites whole = wholeOf(input.cells);
    const std::vector<Line> lines = linesOf(whole);
    if (lines.size() > 600u) continue;  // compares all with all
    for (const double tolerance : {0.0, 0.5, 3.0, 1e4}) {
      SCOPED_TRACE(input.name + ", tolerance " + std::to_string(tolerance));
      for (const std::uint32_t capacity : {40u, 1u << 30}) {
        const Neurites thin = thinnedOf(input.cells, capacity, tolerance);
        EXPECT_LE(thin.error_um, tolerance);
        const double slack = 1e-6 + 1e-12 * 2e9;  // for the distances here, at 1e9 um
        EXPECT_LE(farthest(lines, linesOf(thin)), thin.error_um + slack);
        EXPECT_LE(farthest(linesOf(thin), lines), thin.error_um + slack);
        EXPECT_EQ(thin.represented, whole.represented);
        std::uint64_t stand_for = 0;
        for (const NeuritePoint& point : thin.points) stand_for += point.segments;
        EXPECT_EQ(stand_for, whole.represented);
      }
    }
  }
}

TEST(PathThinner, LeavesFewSegments) {
  const std::vector<Cell> cells = test::randomColumn(9, 4, 500, 100);
  EXPECT_LT(linesOf(thinnedOf(cells, 1u << 30, 4)).size(), segmentsOf(cells) / 2);
}

TEST(Neurites, SimplifyingMovesNoPoint) {
  const Neurites whole = wholeOf(test::randomColumn(9, 4, 500, 100));
  std::set<std::array<std::int64_t, 3>> at;
  for (const NeuritePoint& point : whole.points) at.insert({point.p.x(), point.p.y(), point.p.z()});
  Neurites simple = whole;
  simplify(simple, kGrid, 4);
  EXPECT_LT(simple.points.size(), whole.points.size() / 2);
  for (const NeuritePoint& point : simple.points) EXPECT_TRUE(at.contains({point.p.x(), point.p.y(), point.p.z()}));
}

TEST(Neurites, JoinedPartsAreTheWhole) {
  for (const test::NamedCells& input : inputs()) {
    SCOPED_TRACE(input.name);
    const Neurites whole = wholeOf(input.cells);
    const Neurites joined = join(partsOf(input.cells, 24));
    EXPECT_EQ(joined.represented, whole.represented);
    const auto ends = [](const Neurites& all) {
      std::multiset<std::array<double, 7>> out;
      for (const Line& l : linesOf(all))
        out.insert({double(l.cell), l.a.x(), l.a.y(), l.a.z(), l.b.x(), l.b.y(), l.b.z()});
      return out;
    };
    EXPECT_EQ(ends(joined), ends(whole));
    EXPECT_LE(joined.paths.size(), 2 * whole.paths.size() + 8);
  }
}

TEST(Neurites, PackedOnesComeBack) {
  for (const test::NamedCells& input : inputs()) {
    const Neurites whole = wholeOf(input.cells);
    const Neurites again = unpacked(packed(whole));
    ASSERT_EQ(again.paths.size(), whole.paths.size());
    ASSERT_EQ(again.points.size(), whole.points.size());
    EXPECT_EQ(again.represented, whole.represented);
    for (std::size_t i = 0; i < whole.points.size(); ++i) {
      EXPECT_EQ(again.points[i].p, whole.points[i].p);
      EXPECT_EQ(again.points[i].segments, whole.points[i].segments);
    }
    for (std::size_t i = 0; i < whole.paths.size(); ++i) {
      EXPECT_EQ(again.paths[i].first_sample, whole.paths[i].first_sample);
      EXPECT_EQ(again.paths[i].count, whole.paths[i].count);
      EXPECT_EQ(again.paths[i].attached, whole.paths[i].attached);
    }
  }
}

TEST(Neurites, PackedOnesOfAnySizeComeBack) {
  for (const int bits : {8, 16, 17, 32, 33, 50}) {
    Neurites whole;
    whole.error_um = 0.5;
    const std::int64_t far = (std::int64_t{1} << bits) - 1;
    whole.points = {{{-far, 3, 0}, 0.25F, 0, 0}, {{0, 0, far}, std::nanf(""), 65535, 4000000000}};
    if (bits <= 16) whole.points[1].type = whole.points[1].segments = bits == 8 ? 255 : 256;
    whole.paths = {{7, kNoSample, 5, 4, 0, 2, true}};
    for (const bool reversed : {false, true}) {
      if (reversed) {  // a ball before the path, behind it in memory
        whole.paths.insert(whole.paths.begin(), {9, 1, 1, kNoSample, 2, 1});
        whole.points.push_back({{1, 2, far}, 1, 1, 1});
      }
      const Neurites again = unpacked(packed(whole));
      EXPECT_EQ(again.error_um, whole.error_um);
      ASSERT_EQ(again.paths.size(), whole.paths.size());
      for (std::size_t i = 0; i < whole.paths.size(); ++i) {
        const NeuritePath &was = whole.paths[i], &is = again.paths[i];
        EXPECT_EQ(std::tie(is.cell, is.first_sample, is.last_sample, is.lowest, is.count, is.attached),
                  std::tie(was.cell, was.first_sample, was.last_sample, was.lowest, was.count, was.attached));
        for (std::uint32_t k = 0; k < was.count; ++k) {
          const NeuritePoint &a = whole.points[was.begin + k], &b = again.points[is.begin + k];
          EXPECT_EQ(b.p, a.p) << bits;
          EXPECT_EQ(std::isnan(b.radius_um), std::isnan(a.radius_um));
          EXPECT_EQ(std::tie(b.type, b.segments), std::tie(a.type, a.segments)) << bits;
        }
      }
    }
  }
}

TEST(Neurites, CutOutKeepsTheSameSegmentsInAnyOrderOfPaths) {
  std::mt19937 random(5);
  for (const test::NamedCells& input : inputs()) {
    Neurites ordered = wholeOf(input.cells), shuffled = ordered;
    std::shuffle(shuffled.paths.begin(), shuffled.paths.end(), random);
    std::vector<std::uint8_t> kept(ordered.points.size());
    for (std::uint8_t& one : kept) one = random() % 3 == 0 ? 1 : 0;
    const auto segments = [&](const Neurites& all, const std::vector<std::uint8_t>* of) {
      std::multiset<std::array<std::int64_t, 6>> out;
      for (const NeuritePath& path : all.paths)
        for (std::uint32_t k = path.isBall() ? 0 : 1; k < path.count; ++k) {
          const std::uint32_t end = path.begin + k;
          const GridPoint &a = all.points[path.isBall() ? end : end - 1].p, &b = all.points[end].p;
          if (of == nullptr || (*of)[end] != 0) out.insert({a.x(), a.y(), a.z(), b.x(), b.y(), b.z()});
        }
      return out;
    };
    const auto wanted = segments(ordered, &kept);
    cutOut(ordered, kept);
    cutOut(shuffled, kept);
    EXPECT_EQ(segments(ordered, nullptr), wanted);
    EXPECT_EQ(segments(shuffled, nullptr), wanted);
  }
}

// The pixels of a picture along an axis, with squares of one pixel_um.
std::set<std::pair<long, long>> pixelsOf(const std::vector<Line>& lines, const Vector3d& right, const Vector3d& up,
                                         double pixel_um) {
  std::set<std::pair<long, long>> pixels;
  for (const Line& line : lines) {
    const int steps = static_cast<int>((line.b - line.a).norm() / pixel_um * 4) + 1;
    for (int i = 0; i <= steps; ++i) {
      const Vector3d p = line.a + (line.b - line.a) * (double(i) / steps);
      pixels.emplace(std::lround(p.dot(right) / pixel_um), std::lround(p.dot(up) / pixel_um));
    }
  }
  return pixels;
}

// A dense ball of neurites, seen from directions along which hide() looks and from others.
TEST(Neurites, HidingLeavesNoPixelUncoveredAndNoCellOut) {
  const std::vector<Cell> cells = test::randomColumn(21, 60, 400, 60);
  const Neurites whole = wholeOf(cells);
  Neurites simple = whole;
  constexpr double kPixel = 8;
  simplify(simple, kGrid, 1);
  const std::vector<Line> before = linesOf(simple);
  hide(simple, kGrid, kPixel);
  const std::vector<Line> after = linesOf(simple);
  EXPECT_LT(after.size(), before.size() / 2);
  EXPECT_GT(simple.hidden, 0u);
  EXPECT_EQ(simple.hidden + simple.represented, segmentsOf(cells));
  EXPECT_EQ(simple.pixel_um, kPixel);
  std::set<std::uint32_t> cells_left;
  for (const Line& line : after) cells_left.insert(line.cell);
  EXPECT_EQ(cells_left.size(), cells.size());
  for (const Vector3d& way : {Vector3d(1, 0, 0), Vector3d(0, 0, 1), Vector3d(1, 1, 1), Vector3d(0.3, -0.8, 0.5),
                              Vector3d(1, 0.2, 0.4), Vector3d(0, 1, 0.6)}) {
    const Vector3d d = way.normalized();
    const Vector3d right = (d.y() * d.y() < 0.5 ? Vector3d(d.z(), 0, -d.x()) : Vector3d(d.y(), -d.x(), 0)).normalized();
    const Vector3d up(d.y() * right.z() - d.z() * right.y(), d.z() * right.x() - d.x() * right.z(),
                      d.x() * right.y() - d.y() * right.x());
    const auto full = pixelsOf(linesOf(whole), right, up, kPixel), left = pixelsOf(after, right, up, kPixel);
    std::size_t far = 0, uncovered = 0;
    for (const auto& [x, y] : full) {
      if (left.contains({x, y})) continue;
      ++uncovered;
      bool near = false;
      for (int dx = -1; dx <= 1; ++dx)
        for (int dy = -1; dy <= 1; ++dy) near = near || left.contains({x + dx, y + dy});
      far += near ? 0 : 1;
    }
    EXPECT_LE(far, full.size() / 500) << d.transpose();
    EXPECT_LE(uncovered, full.size() / 10) << d.transpose();
  }
}

TEST(Neurites, NumberedOnesAreATile) {
  const Neurites whole = wholeOf(test::randomColumn(5, 3, 200, 100));
  TileAppearance appearance;
  const std::vector<StoredSegment> segments = numbered(whole, appearance);
  EXPECT_EQ(segments.size(), whole.represented);
  EXPECT_EQ(appearance.radii_um.size(), segments.size());
  std::set<std::uint64_t> ids;
  for (const StoredSegment& s : segments) ids.insert(s.id.key());
  EXPECT_EQ(ids.size(), segments.size());
  const Tile tile(0, BlockKey{}, true, kGrid, segments);
  EXPECT_EQ(tile.segment_count(), segments.size());
}

}  // namespace
}  // namespace filiform
