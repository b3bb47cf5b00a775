// checkLevels() against a check that compares every segment with every piece of its cell, on sets with planted faults.
#include "index/cell/soma.h"
#include "index/count_text.h"
#include "index/file/internal/digest.h"
#include "index/ingest/ingest.h"
#include "index/levels/internal/level_files.h"
#include "index/levels/levels.h"
#include "index/set/internal/pack_writer.h"
#include "index/tile/tile_codec.h"
#include "tests/support/scenes/random_cells.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <random>
#include <set>
#include <unordered_set>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;

struct CheckedPiece {
  std::uint32_t cell;
  Vector3d a_W, b_W;
  double radius_um;
  bool is_ball, is_reached;
};

double distance2(const Vector3d& p_W, const Vector3d& a_W, const Vector3d& b_W) {
  const Vector3d way = b_W - a_W, d = p_W - a_W;
  const double squared = way.squaredNorm();
  const double t = squared > 0 ? std::clamp(d.dot(way) / squared, 0.0, 1.0) : 0.0;
  return (d - t * way).squaredNorm();
}

std::array<std::int64_t, 3> pixelOf(const Vector3d& p_W, double pixel_um) {
  std::array<std::int64_t, 3> at{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    at[axis] = static_cast<std::int64_t>(std::floor(p_W[static_cast<int>(axis)] / pixel_um));
  return at;
}

// The level tiles that show the rest together with this one: those directly below the same tile, or, of the outermost
// block, the coarsest ones of the whole set that are as fine.
std::vector<LevelId> besideByForce(const Levels& levels, LevelId level) {
  const auto above = [&](LevelId of) { return levels.above({true, of, 0, 0}); };
  bool outermost = true;
  for (LevelId of = above(level); of != Levels::kRoots; of = above(of)) outermost &= levels.entry(of).coarser > 0;
  const LevelEntry& own = levels.entry(level);
  const auto isAsFine = [&](LevelId of) {
    const LevelEntry& e = levels.entry(of);
    const bool is_coarser =
        own.coarser > 0 ? e.error_um > own.error_um || e.pixel_um > own.pixel_um : e.error_um > 0 || e.pixel_um > 0;
    return e.coarser == 0 || !is_coarser;
  };
  std::vector<LevelId> beside;
  for (LevelId of = 0; of < levels.size(); ++of) {
    bool is_first = outermost ? isAsFine(of) : above(of) == above(level);
    for (LevelId a = above(of); outermost && a != Levels::kRoots; a = above(a)) is_first &= !isAsFine(a);
    if (is_first) beside.push_back(of);
  }
  return beside;
}

// The problems of one level tile, in the words of checkLevels().
std::vector<std::string> problemsOfLevel(const TileSet& set, const Levels& levels, LevelId level) {
  const LevelEntry& e = levels.entry(level);
  const auto tile = levels.load(level);
  const TileAppearance appearance = levels.loadAppearance(level);
  const double error_um = e.error_um * (1 + 1e-9) + set.grid().quantum_um() * 1e-3;
  std::vector<std::shared_ptr<const Tile>> siblings;
  double pixel_um = 0;
  const std::vector<LevelId> beside = besideByForce(levels, level);
  for (const LevelId id : beside) {
    const LevelEntry& of = levels.entry(id);
    const Tile& one = *siblings.emplace_back(levels.load(id));
    double length_um = 0;
    for (std::uint32_t s = 0; s < one.segment_count(); ++s)
      length_um += (one.position_W(one.child(s)) - one.position_W(one.parent(s))).norm();
    pixel_um = std::max(
        {pixel_um, 2 * std::max(of.pixel_um, of.error_um), length_um / (256.0 * std::max(1u, one.segment_count()))});
  }
  std::set<std::uint32_t> cells;
  std::vector<CheckedPiece> pieces;
  std::array<std::set<std::pair<std::int64_t, std::int64_t>>, 3> covered;
  for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
    const bool ball = tile->isolated(s) && appearance.types[s] == kSomaType && appearance.radii_um[s] > 0;
    const Vector3d a_W = tile->position_W(tile->child(s)), b_W = tile->position_W(tile->parent(s));
    pieces.push_back(
        {tile->segmentId(s).cell, a_W, b_W, ball ? 1.06 * static_cast<double>(appearance.radii_um[s]) : 0, ball, ball});
  }
  std::vector<CheckedPiece> balls;
  for (const LevelId id : beside) {
    const auto one = levels.load(id);
    const TileAppearance of = levels.loadAppearance(id);
    for (std::uint32_t s = 0; s < one->segment_count(); ++s)
      if (one->isolated(s) && of.types[s] == kSomaType && of.radii_um[s] > 0)
        balls.push_back({one->segmentId(s).cell,
                         one->position_W(one->child(s)),
                         {},
                         1.06 * static_cast<double>(of.radii_um[s]),
                         true,
                         true});
  }
  for (const auto& one : siblings)
    for (std::uint32_t s = 0; s < one->segment_count(); ++s) {
      cells.insert(one->segmentId(s).cell);
      if (e.hidden == 0) continue;
      const Vector3d a_W = one->position_W(one->child(s)), b_W = one->position_W(one->parent(s));
      const int steps = static_cast<int>((b_W - a_W).cwiseAbs().maxCoeff() / pixel_um * 2) + 1;
      for (int i = 0; i <= steps; ++i) {
        const auto at = pixelOf(a_W + (b_W - a_W) * (static_cast<double>(i) / steps), pixel_um);
        for (std::size_t v = 0; v < 3; ++v) covered[v].emplace(at[v], at[(v + 1) % 3]);
      }
    }
  const auto hides = [&](const Vector3d& p_W) {
    const auto at = pixelOf(p_W, pixel_um);
    for (std::size_t v = 0; v < 3; ++v) {
      bool found = false;
      for (int dx = -1; dx <= 1; ++dx)
        for (int dy = -1; dy <= 1; ++dy) found |= covered[v].contains({at[v] + dx, at[(v + 1) % 3] + dy});
      if (!found) return false;
    }
    return true;
  };
  std::uint64_t owned = 0, far = 0, hidden = 0, missing = 0;
  for (TileId t = 0; t < set.tile_count(); ++t) {
    if (t == set.long_tile() || !e.key.contains(set.entry(t).key.low)) continue;
    const auto full = set.load(t);
    for (std::uint32_t s = 0; s < full->segment_count(); ++s) {
      if (!full->owned(s)) continue;
      ++owned;
      const std::uint32_t cell = full->segmentId(s).cell;
      const Vector3d a_W = full->position_W(full->child(s)), b_W = full->position_W(full->parent(s));
      std::array<bool, 3> near{};
      for (CheckedPiece& piece : pieces) {
        if (piece.cell != cell) continue;
        piece.is_reached |= distance2(0.5 * (piece.a_W + piece.b_W), a_W, b_W) <= error_um * error_um;
        std::size_t i = 0;
        for (const Vector3d& p_W : {a_W, b_W, Vector3d(0.5 * (a_W + b_W))})
          near[i++] |= std::sqrt(distance2(p_W, piece.a_W, piece.b_W)) <= error_um + piece.radius_um;
      }
      for (const CheckedPiece& ball : balls) {
        if (ball.cell != cell) continue;
        std::size_t i = 0;
        for (const Vector3d& p_W : {a_W, b_W, Vector3d(0.5 * (a_W + b_W))})
          near[i++] |= (p_W - ball.a_W).norm() <= error_um + ball.radius_um;
      }
      if (!cells.contains(cell) && e.coarser == 0) ++missing;
      std::size_t i = 0;
      for (const Vector3d& p_W : {a_W, b_W, Vector3d(0.5 * (a_W + b_W))}) {
        if (near[i++]) continue;
        ++(e.hidden > 0 && hides(p_W) ? hidden : far);
        break;
      }
    }
  }
  std::vector<std::string> problems;
  const auto say = [&](const std::string& what) {
    problems.push_back("level tile " + std::to_string(level) + ": " + what);
  };
  if (owned != e.represented + e.hidden)
    say("represents " + std::to_string(e.represented) + " and hides " + std::to_string(e.hidden) +
        " segments, but there are " + std::to_string(owned));
  if (far > 0) say(counted(far, "segment") + " farther than its error and not covered by others");
  if (far + hidden > e.hidden)
    say(counted(far + hidden, "segment") + " farther than its error, but only " + std::to_string(e.hidden) +
        " are stated as hidden");
  const auto strays = std::count_if(pieces.begin(), pieces.end(), [](const CheckedPiece& p) { return !p.is_reached; });
  if (strays > 0) say(std::to_string(strays) + " of its segments lie farther than its error from their cells");
  if (missing > 0) say("lacks " + counted(missing, "segment") + " of cells of which it has none");
  return problems;
}

std::vector<std::string> checkedByForce(const TileSet& set, const Levels& levels) {
  std::vector<std::string> problems;
  for (LevelId level = 0; level < levels.size(); ++level)
    for (std::string& problem : problemsOfLevel(set, levels, level)) problems.push_back(std::move(problem));
  return problems;
}

// A level tile that can be changed.
struct OpenTile {
  LevelEntry entry;
  std::vector<StoredSegment> segments;
  TileAppearance appearance;
};

// Writes a copy of the set in which one level tile is changed.
void writeForged(const std::string& path, const std::string& to, LevelId changed,
                 const std::function<void(OpenTile&)>& change) {
  const auto set = TileSet::open(path);
  const auto levels = Levels::open(*set);
  fs::copy(path, to, fs::copy_options::recursive);
  const std::string revision = to + "/" + set->revision();
  internal::LevelTable table;
  table.grid = set->grid();
  for (std::uint32_t pack = 0; fs::remove(revision + "/" + internal::levelPackFile(pack)); ++pack) continue;
  internal::PackWriter packs(revision, {internal::levelPackFile, internal::levelPackHeader}, UINT64_MAX);
  for (LevelId level = 0; level < levels->size(); ++level) {
    const auto tile = levels->load(level);
    OpenTile open{levels->entry(level), {}, levels->loadAppearance(level)};
    for (std::uint32_t s = 0; s < tile->segment_count(); ++s) {
      const Tile::Link link = tile->link(s);
      open.segments.push_back({link.id, link.child_id.sample, link.parent_id.sample, tile->gridPoint(link.child),
                               tile->gridPoint(link.parent), true});
    }
    if (level == changed) change(open);
    const Tile made(0, open.entry.key, true, tile->grid(), open.segments);
    open.entry.segments = made.segment_count();
    open.entry.decoded_bytes = made.bytes();
    table.entries.push_back(open.entry);
    table.locations.push_back(packs.add(encodeTile(made), encodeAppearance(open.appearance), "too large"));
  }
  const std::vector<std::uint8_t> bytes = internal::encodeLevels(table);
  test::writeBytes(revision + "/" + internal::kLevelsFile, std::string(bytes.begin(), bytes.end()));
  packs.close();
  auto manifest = nlohmann::ordered_json::parse(set->manifest());
  for (auto& file : manifest["files"]) {
    const std::string name = file["name"];
    if (!name.starts_with("levels")) continue;
    const std::string content = test::readBytes(revision + "/" + name);
    char digest[17];
    std::snprintf(digest, sizeof digest, "%016llx", static_cast<unsigned long long>(internal::checksum(content)));
    file["bytes"] = content.size();
    file["xxh3"] = digest;
  }
  const std::string text = manifest.dump(2) + "\n";
  char name[19];
  std::snprintf(name, sizeof name, "r-%016llx", static_cast<unsigned long long>(internal::checksum(text)));
  test::writeBytes(revision + "/manifest.json", text);
  fs::rename(revision, to + "/" + name);
  test::writeBytes(to + "/CURRENT", std::string(name) + "\n");
}

class LevelsCheck : public ::testing::Test {
 protected:
  void ingestCells(std::vector<Cell> cells, IngestOptions options) {
    options.levels = true;
    CellList stream(std::move(cells));
    ingest(stream, path_, options);
  }
  void expectNoProblems() {
    const auto set = TileSet::open(path_);
    const auto levels = Levels::open(*set);
    EXPECT_EQ(checkLevels(*set, *levels), std::vector<std::string>{});
    EXPECT_EQ(checkedByForce(*set, *levels), std::vector<std::string>{});
  }
  // Compares both checks of a set in which one level tile was changed; returns the problems.
  std::vector<std::string> problemsWith(LevelId changed, const std::function<void(OpenTile&)>& change) {
    const std::string forged = folder_ / ("forged" + std::to_string(++forged_));
    writeForged(path_, forged, changed, change);
    const auto set = TileSet::open(forged);
    const auto levels = Levels::open(*set);
    std::vector<std::string> found = checkLevels(*set, *levels), by_force;
    for (const LevelPart& beside : levels->below(levels->above({true, changed, 0, 0})))
      if (beside.level)
        for (std::string& problem : problemsOfLevel(*set, *levels, beside.tile)) by_force.push_back(std::move(problem));
    std::stable_sort(found.begin(), found.end());
    std::stable_sort(by_force.begin(), by_force.end());
    EXPECT_EQ(found, by_force);
    fs::remove_all(forged);
    return found;
  }

  test::TempFolder folder_;
  std::string path_ = folder_ / "a.fil";
  int forged_ = 0;
};

TEST_F(LevelsCheck, SoundLevelsHaveNoProblems) {
  for (const test::NamedCells& input : test::worstCases()) {
    SCOPED_TRACE(input.name);
    fs::remove_all(path_);
    ingestCells(input.cells, {.capacity = 40});
    expectNoProblems();
  }
}

TEST_F(LevelsCheck, FindsWhatBruteForceFindsInDamagedLevels) {
  const std::uint64_t seed = 411;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::vector<Cell> cells = test::randomColumn(seed, 10, 300, 10);
  // Somata become balls. The neurites are folded into a small cube, so that many hide others.
  for (Cell& cell : cells) {
    cell.types.front() = kSomaType;
    cell.radii_um.front() = 0.8f;
    for (Vector3d& p_W : cell.positions_um)
      for (double& coordinate : p_W) coordinate = std::abs(std::remainder(coordinate, 24));
  }
  ingestCells(std::move(cells), {.capacity = 24});
  expectNoProblems();
  const auto set = TileSet::open(path_);
  const auto levels = Levels::open(*set);
  ASSERT_GT(levels->size(), 4u);
  std::uint64_t hidden = 0;
  for (LevelId level = 0; level < levels->size(); ++level) hidden += levels->entry(level).hidden;
  ASSERT_GT(hidden, 0u);
  const std::uint32_t cell_count = set->cell_count();

  const auto pick = [&](const OpenTile& t) { return random() % t.segments.size(); };
  const auto erase = [](OpenTile& t, std::size_t i) {
    const auto at = static_cast<std::ptrdiff_t>(i);
    t.segments.erase(t.segments.begin() + at);
    t.appearance.radii_um.erase(t.appearance.radii_um.begin() + at);
    t.appearance.types.erase(t.appearance.types.begin() + at);
  };
  const auto longest = [](const OpenTile& t) {
    const auto length = [](const StoredSegment& s) { return (s.child - s.parent).cast<double>().norm(); };
    return static_cast<std::size_t>(
        std::max_element(t.segments.begin(), t.segments.end(),
                         [&](const StoredSegment& a, const StoredSegment& b) { return length(a) < length(b); }) -
        t.segments.begin());
  };
  struct Fault {
    const char* name;
    std::function<void(OpenTile&)> plant;
    bool always_found;
  };
  const std::vector<Fault> faults{
      {"a segment is missing", [&](OpenTile& t) { erase(t, longest(t)); }, false},
      {"half of the segments are missing",
       [&](OpenTile& t) {
         for (std::size_t n = t.segments.size() / 2; n > 0; --n) erase(t, pick(t));
       },
       true},
      {"a segment too many",
       [&](OpenTile& t) {
         StoredSegment s = t.segments.back();
         s.id.segment += 2;
         s.child_sample = s.parent_sample = s.id.segment;
         s.child += GridPoint(1 << 20, 0, 0);
         s.parent = s.child;
         t.segments.push_back(s);
         t.appearance.radii_um.push_back(1);
         t.appearance.types.push_back(3);
       },
       true},
      {"a segment lies elsewhere",
       [&](OpenTile& t) {
         StoredSegment& s = t.segments[pick(t)];
         s.child += GridPoint(0, 1 << 18, 0);
       },
       false},
      {"the last cell's segments are another's",
       [&](OpenTile& t) {
         const std::uint32_t last = t.segments.back().id.cell;
         for (StoredSegment& s : t.segments)
           if (s.id.cell == last && last + 1 < cell_count) ++s.id.cell;
       },
       false},
      {"a ball is too small",
       [&](OpenTile& t) {
         for (std::size_t i = 0; i < t.segments.size(); ++i)
           if (t.appearance.types[i] == kSomaType) t.appearance.radii_um[i] *= 0.1f;
       },
       false},
      {"the error is stated too small", [](OpenTile& t) { t.entry.error_um *= 0.3; }, false},
      {"the error is stated as zero", [](OpenTile& t) { t.entry.error_um = 0; }, false},
      {"one segment more is stated", [](OpenTile& t) { ++t.entry.represented; }, true},
      {"fewer are stated as hidden",
       [](OpenTile& t) {
         t.entry.represented += t.entry.hidden;
         t.entry.hidden = 0;
       },
       false},
      {"pixels are stated too small", [](OpenTile& t) { t.entry.pixel_um *= 0.1; }, false},
  };
  std::set<std::string> found;
  for (const Fault& fault : faults)
    for (LevelId level = 0; level < levels->size(); level += 1 + level / 3) {
      SCOPED_TRACE(std::string(fault.name) + ", level tile " + std::to_string(level));
      const std::vector<std::string> problems = problemsWith(level, fault.plant);
      if (fault.always_found) {
        EXPECT_FALSE(problems.empty());
      }
      if (!problems.empty()) found.insert(fault.name);
    }
  std::string never_found;
  for (const Fault& fault : faults)
    if (!found.contains(fault.name)) never_found += std::string(fault.name) + "; ";
  EXPECT_GE(found.size(), 7u) << "never found: " << never_found;
}

}  // namespace
}  // namespace filiform
