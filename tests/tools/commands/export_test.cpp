// `export` as a process: ingest of every format gives the same cell again.
#include "index/attributes/cell_attributes.h"
#include "index/export/skeleton_shards.h"
#include "index/input/input.h"
#include "index/query/cell_graph.h"
#include "index/set/tile_set.h"
#include "tests/support/corpus.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iomanip>
#include <set>
#include <sstream>
#include <string>
#include <vector>
#include <zlib.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::runFiliform;
using test::writeBytes;

struct Exported {
  std::vector<GridPoint> points;
  std::set<std::array<std::uint32_t, 2>> links;  // the lower rank first
  std::vector<float> radii;
  std::vector<std::uint16_t> types;
};

Exported cellOf(const TileStore& set, std::uint32_t id) {
  const CellGraph graph = readCell(set, id, true);
  Exported cell{graph.positions, {}, graph.radii_um, graph.types};
  const auto add = [&](std::uint32_t a, std::uint32_t b) {
    if (a != b) cell.links.insert({std::min(a, b), std::max(a, b)});
  };
  for (const auto& [child, parent] : graph.links) add(child, parent);
  for (std::uint32_t i = 0; !graph.isGraph() && i < graph.samples(); ++i)
    if (graph.parents[i] != kNoParent) add(i, graph.parents[i]);
  return cell;
}

enum Keeps { kLinks = 0, kTypes = 1, kRadii = 2, kNearRadii = 4 };

void expectSame(const Exported& a, const Exported& b, int keeps) {
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.links, b.links);
  if (keeps & kTypes) {
    EXPECT_EQ(a.types, b.types);
  }
  if ((keeps & (kRadii | kNearRadii)) == 0) return;
  ASSERT_EQ(a.radii.size(), b.radii.size());
  for (std::size_t i = 0; i < a.radii.size(); ++i) {
    if (std::isnan(a.radii[i])) {
      EXPECT_TRUE(std::isnan(b.radii[i]) || b.radii[i] == 0) << i;  // SWC writes an unknown radius as 0
    } else if (keeps & kRadii) {
      ASSERT_EQ(a.radii[i], b.radii[i]) << i;
    } else {
      ASSERT_NEAR(a.radii[i], b.radii[i], 2e-7 * a.radii[i]) << i;
    }
  }
}

class Export : public ::testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }
  void ingest(const std::string& input, const std::string& set) {
    const Outcome made = runFiliform({"ingest", input, "-o", set, "--force"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  // Exports the cell in each format, ingests the files, and compares the cells.
  void expectRoundTrips(const std::string& set_path, std::uint32_t id, bool loops) {
    const auto set = TileSet::open(set_path);
    const std::string name = set->cell(id).name;
    const Exported cell = cellOf(*set, id);
    for (const auto& [ending, keeps] :
         std::vector<std::pair<std::string, int>>{{".swc", kTypes | kRadii},
                                                  {"", kTypes | kRadii},
                                                  {".edges", kTypes | kRadii},
                                                  {".obj", kLinks},
                                                  {".vtk", kRadii},
                                                  {".precomputed", kTypes | kNearRadii}}) {
      SCOPED_TRACE(name + ending);
      if (loops && (ending == ".swc" || ending.empty())) continue;
      fs::remove_all(path("back" + ending));
      const Outcome out = runFiliform({"export", set_path, "--cell", name, "-o", path("back" + ending)});
      ASSERT_EQ(out.exit_code, 0) << out.err;
      ingest(path("back" + ending), path("back.fil"));
      const auto back = TileSet::open(path("back.fil"));
      ASSERT_EQ(back->cell_count(), 1u);
      expectSame(cell, cellOf(*back, 0), keeps);
    }
  }
  test::TempFolder folder_;
};

const char* const kAwkward =
    "1 1 0.123456 -1000000 900000000.9 5.1 -1\n2 3 -0.002 3 3 0.1 1\n3 3 1.0009765625 2 3 NaN 2\n4 2 7 7 7 1e-7 2\n"
    "5 7 7 7 7.0001 123456.7 4\n9 3 1e-9 -1e-9 0.0009765625 0.30000001 1\n";

TEST_F(Export, EveryFormatComesBackAsTheSameCell) {
  std::string swc = kAwkward;
  swc.replace(swc.find("900000000.9"), 11, "30000.9");  // within the precision of a skeleton's floats
  swc.replace(swc.find("-1000000"), 8, "-1000");
  writeBytes(path("tree.swc"), swc);
  writeBytes(path("ring.edges"),
             "node 5 0.1 0 0 1 1\nnode 7 3 4 0 nan 3\nnode 9 3 0.25 1 0.7 3\nnode 11 9 9 9\nedge 5 7\nedge 7 9\nedge 9 "
             "5\n");
  ingest(path("tree.swc"), path("tree.fil"));
  ingest(path("ring.edges"), path("ring.fil"));
  expectRoundTrips(path("tree.fil"), 0, false);
  expectRoundTrips(path("ring.fil"), 0, true);
}

TEST_F(Export, DecimalsAreAsFewAsTheGridNeeds) {
  writeBytes(path("a.swc"), "1 1 0.123 -7.9 1000.25 0.3 -1\n2 3 12.346 0 0 1 1\n");
  ingest(path("a.swc"), path("a.fil"));
  const Outcome out = runFiliform({"export", path("a.fil"), "--cell", "a", "-o", "-"});
  EXPECT_NE(out.out.find("\n1 1 0.123 -7.9 1000.25 0.3 -1\n2 3 12.346 0 0 1 1\n"), std::string::npos) << out.out;
}

TEST_F(Export, WhatIsTooWideForASkeletonIsRefused) {
  writeBytes(path("wide.swc"), kAwkward);
  ingest(path("wide.swc"), path("wide.fil"));
  const Outcome out = runFiliform({"export", path("wide.fil"), "--all", "-o", path("wide.precomputed")});
  EXPECT_EQ(out.exit_code, 1);
  EXPECT_TRUE(out.oneLineOnStderr()) << out.err;
  EXPECT_FALSE(fs::exists(path("wide.precomputed")));
}

TEST_F(Export, TheEndingNamesTheFormat) {
  writeBytes(path("a.swc"), "1 1 0 0 0 1 -1\n2 3 1 0 0 1 1\n");
  ingest(path("a.swc"), path("a.fil"));
  for (const char* name : {"a.svg", "a.txt", "a.swc.gz"}) {
    const Outcome out = runFiliform({"export", path("a.fil"), "--cell", "a", "-o", path(name)});
    EXPECT_EQ(out.exit_code, 2) << name;
    EXPECT_TRUE(out.oneLineOnStderr()) << out.err;
    for (const char* known : {".swc", ".edges", ".obj", ".vtk", ".precomputed"})
      EXPECT_NE(out.err.find(known), std::string::npos) << out.err;
    EXPECT_FALSE(fs::exists(path(name)));
  }
  ASSERT_EQ(runFiliform({"export", path("a.fil"), "--cell", "a", "-o", path("E.OBJ")}).exit_code, 0);
  EXPECT_NE(test::readBytes(path("E.OBJ")).find("\nl 1 2\n"), std::string::npos);
  for (const auto& wrong :
       std::vector<std::vector<std::string>>{{"-o", path("b.swc")},
                                             {"--all", "-o", path("b.swc")},
                                             {"--all", "--cell", "a", "-o", path("b/")},
                                             {"--all", "--format", "png", "-o", path("b/")},
                                             {"--cell", "a", "--format", "obj", "-o", path("b.swc")}}) {
    std::vector<std::string> words{"export", path("a.fil")};
    words.insert(words.end(), wrong.begin(), wrong.end());
    const Outcome out = runFiliform(words);
    EXPECT_EQ(out.exit_code, 2) << out.err;
    EXPECT_TRUE(out.oneLineOnStderr()) << out.err;
  }
}

TEST_F(Export, AllCellsGoIntoAFolderAZipOrSkeletons) {
  fs::create_directories(path("in/a"));
  fs::create_directories(path("in/b"));
  writeBytes(path("in/a/one.swc"), "1 1 0 0 0 1 -1\n2 3 1 0 0 1 1\n");
  writeBytes(path("in/b/one.swc"), "1 1 5 0 0 1 -1\n2 3 1.5 0 0 1 1\n3 3 1 1 1 1 2\n");
  writeBytes(path("in/b/ONE.swc"), "1 1 5 0 0 1 -1\n2 3 1.5 7 0 1 1\n");
  writeBytes(path("in/-x y;.swc"), "1 1 5 0 8 1 -1\n2 3 1.5 7 0 1 1\n");
  ingest(path("in"), path("all.fil"));
  const auto set = TileSet::open(path("all.fil"));
  ASSERT_EQ(set->cell_count(), 4u);
  const auto shapes = [](const TileStore& store) {
    std::multiset<std::uint64_t> sizes;
    for (std::uint32_t id = 0; id < store.cell_count(); ++id) {
      const Exported cell = cellOf(store, id);
      std::uint64_t hash = cell.points.size();
      for (const GridPoint& p : cell.points) hash = hash * 31 + static_cast<std::uint64_t>(p.dot(GridPoint(1, 7, 49)));
      sizes.insert(hash);
    }
    return sizes;
  };
  for (const auto& [name, format] : std::vector<std::pair<std::string, std::string>>{
           {"out/", ""}, {"vtk/", "vtk"}, {"cells.zip", ""}, {"all.precomputed", ""}}) {
    SCOPED_TRACE(name);
    std::vector<std::string> words{"export", path("all.fil"), "--all", "-o", path(name)};
    if (!format.empty()) words.insert(words.end(), {"--format", format});
    const Outcome out = runFiliform(words);
    ASSERT_EQ(out.exit_code, 0) << out.err;
    if (format == "vtk") {  // a folder argument does not take graph files
      std::vector<std::string> ingesting{"ingest", "-o", path("back.fil"), "--force"};
      for (const auto& entry : fs::directory_iterator(path(name))) ingesting.push_back(entry.path().string());
      ASSERT_EQ(runFiliform(ingesting).exit_code, 0);
    } else {
      ingest(path(name), path("back.fil"));
    }
    EXPECT_EQ(shapes(*TileSet::open(path("back.fil"))), shapes(*set));
  }
  std::set<std::string> lower;
  for (const auto& entry : fs::directory_iterator(path("out"))) {
    std::string name = entry.path().filename().string();
    EXPECT_EQ(name.find_first_of(" ;/"), std::string::npos) << name;
    EXPECT_NE(name.front(), '-') << name;
    std::transform(name.begin(), name.end(), name.begin(), ::tolower);
    lower.insert(name);
  }
  EXPECT_EQ(lower.size(), 4u) << "different in any letter case";
  // Existing files stay unchanged.
  EXPECT_EQ(runFiliform({"export", path("all.fil"), "--all", "-o", path("out")}).exit_code, 1);
  EXPECT_EQ(runFiliform({"export", path("all.fil"), "-o", path("out")}).exit_code, 1);
}

std::string gunzipped(std::string packed) {
  z_stream stream{};
  EXPECT_EQ(inflateInit2(&stream, 16 + MAX_WBITS), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_in = static_cast<uInt>(packed.size());
  std::string unpacked;
  int state = Z_OK;
  for (std::string block(1 << 16, '\0'); state == Z_OK; unpacked.append(block, 0, block.size() - stream.avail_out)) {
    stream.next_out = reinterpret_cast<Bytef*>(block.data());
    stream.avail_out = static_cast<uInt>(block.size());
    state = inflate(&stream, Z_NO_FLUSH);
  }
  EXPECT_EQ(state, Z_STREAM_END);
  inflateEnd(&stream);
  return unpacked;
}

// Finds a skeleton in a sharded folder as a reader does.
std::string skeletonInShards(const std::string& folder, std::uint64_t number) {
  const auto info = nlohmann::json::parse(test::readBytes(folder + "/info")).at("sharding");
  EXPECT_EQ(info.at("@type"), "neuroglancer_uint64_sharded_v1");
  EXPECT_EQ(info.at("hash"), "murmurhash3_x86_128");
  const int minishard_bits = info.at("minishard_bits"), shard_bits = info.at("shard_bits");
  const std::uint64_t hash = tools::murmurHash(number) >> info.at("preshift_bits").get<int>();
  const std::uint64_t minishard = hash & ((std::uint64_t{1} << minishard_bits) - 1);
  const std::uint64_t shard = hash >> minishard_bits & ((std::uint64_t{1} << shard_bits) - 1);
  std::ostringstream name;
  name << folder << '/' << std::hex << std::setfill('0') << std::setw((shard_bits + 3) / 4) << shard << ".shard";
  if (!fs::exists(name.str())) return "";
  const std::string file = test::readBytes(name.str());
  const std::size_t start = std::size_t{16} << minishard_bits;
  const auto word = [](const std::string& bytes, std::size_t at) {
    std::uint64_t value = 0;
    std::memcpy(&value, bytes.data() + 8 * at, 8);
    return value;
  };
  const auto unpacked = [&](std::uint64_t first, std::uint64_t end) {
    return gunzipped(file.substr(start + first, end - first));
  };
  const std::uint64_t first = word(file, 2 * minishard), end = word(file, 2 * minishard + 1);
  if (first == end) return "";
  const std::string index = unpacked(first, end);
  const std::size_t n = index.size() / 24;
  std::uint64_t id = 0, at = 0;
  for (std::size_t i = 0; i < n; ++i) {
    id += word(index, i);
    at += word(index, n + i);
    const std::uint64_t size = word(index, 2 * n + i);
    if (id == number) return unpacked(at, at + size);
    at += size;
  }
  return "";
}

TEST_F(Export, ShardsHoldTheSameSkeletons) {
  const std::string zip = path("c.zip"), set = path("c.fil");
  ASSERT_EQ(runFiliform({"synth", zip, "--cells", "100", "--seed", "3"}).exit_code, 0);
  ingest(zip, set);
  ASSERT_EQ(runFiliform({"export", set, "--all", "-o", path("c.precomputed")}).exit_code, 0);
  const Outcome out = runFiliform({"export", set, "--all", "--format", "precomputed", "-o", path("web")});
  ASSERT_EQ(out.exit_code, 0) << out.err;
  EXPECT_EQ(test::readBytes(path("web/segment_properties/info")),
            test::readBytes(path("c.precomputed/segment_properties/info")));
  std::size_t files = 0;
  for (const auto& entry : fs::directory_iterator(path("c.precomputed"))) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    ++files;
    ASSERT_EQ(skeletonInShards(path("web"), std::stoull(name)), test::readBytes(entry.path())) << name;
  }
  EXPECT_EQ(files, 100u);
  for (const std::uint64_t absent : {std::uint64_t{0}, std::uint64_t{101}, UINT64_MAX})
    EXPECT_EQ(skeletonInShards(path("web"), absent), "");
  // The same bytes each time.
  ASSERT_EQ(runFiliform({"export", set, "--all", "--format", "precomputed", "-o", path("again/")}).exit_code, 0);
  for (const auto& entry : fs::directory_iterator(path("web"))) {
    if (entry.is_regular_file()) {
      EXPECT_EQ(test::readBytes(entry.path()), test::readBytes(path("again/" + entry.path().filename().string())));
    }
  }
  for (const auto& wrong : std::vector<std::vector<std::string>>{{"-o", "-"}, {"-o", path("x.zip")}}) {
    std::vector<std::string> words{"export", set, "--all", "--format", "precomputed"};
    words.insert(words.end(), wrong.begin(), wrong.end());
    const Outcome refused = runFiliform(words);
    EXPECT_EQ(refused.exit_code, 2) << refused.err;
    EXPECT_TRUE(refused.oneLineOnStderr()) << refused.err;
  }
}

// The rows of `cells --tsv` without id, name, source and attributes, ascending.
std::vector<std::string> shapesOf(const std::string& set) {
  const Outcome cells = runFiliform({"cells", set, "--tsv"});
  std::istringstream lines(cells.out);
  std::vector<std::string> shapes;
  for (std::string line; std::getline(lines, line);) {
    std::size_t at = 0;
    for (int column = 0; column < 3; ++column) at = line.find('\t', at) + 1;
    std::size_t end = at;
    for (int column = 0; column < 12 && end != std::string::npos; ++column) end = line.find('\t', end + 1);
    shapes.push_back(line.substr(at, end - at));
  }
  std::sort(shapes.begin(), shapes.end());
  return shapes;
}

TEST_F(Export, ShardsComeBackThroughIngest) {
  const std::string zip = path("back.zip"), set = path("back.fil"), again = path("again.fil");
  ASSERT_EQ(runFiliform({"synth", zip, "--cells", "30", "--seed", "4"}).exit_code, 0);
  ingest(zip, set);
  ASSERT_EQ(runFiliform({"export", set, "--all", "--format", "precomputed", "-o", path("shards")}).exit_code, 0);
  const Outcome made = runFiliform({"ingest", path("shards"), "-o", again});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const std::vector<std::string> shapes = shapesOf(set);
  EXPECT_EQ(shapes.size(), 31u);
  EXPECT_EQ(shapesOf(again), shapes);

  std::string bytes = test::readBytes(path("shards/0.shard"));
  bytes.replace(8, 8, std::string(8, '\x7F'));  // where the first minishard's index ends
  test::writeBytes(path("shards/0.shard"), bytes);
  const Outcome outside = runFiliform({"ingest", path("shards"), "-o", path("outside.fil")});
  EXPECT_EQ(outside.exit_code, 1);
  EXPECT_TRUE(outside.oneLineOnStderr()) << outside.err;
  EXPECT_NE(outside.err.find("0.shard: minishard 0: its index lies outside the file"), std::string::npos)
      << outside.err;
  EXPECT_FALSE(fs::exists(path("outside.fil")));
}

TEST_F(Export, SkeletonsComeBackWithNamesAndAttributes) {
  fs::create_directories(path("in"));
  writeBytes(path("in/basket.swc"), "1 1 0.123456 -1 3.9 5.1 -1\n2 3 -0.002 3 3 0.1 1\n3 3 1.0009765625 2 3 NaN 2\n");
  writeBytes(path("in/pyramid.swc"), "1 1 0 0 0 2.5 -1\n2 3 1 0 0 0.3 1\n3 4 1 1 1 0.1 2\n");
  writeBytes(path("in/17.swc"), "1 1 5 0 0 1 -1\n2 2 1.5 7 0 nan 1\n");
  writeBytes(path("t.csv"),
             "name,species,layer,depth,root,some\nbasket,house mouse,4,0.1,864691135122603047,5\n"
             "pyramid,rat,5,-1e-3,864691135122603048,\n17,rat,6,7.25,3,1.5\n");
  ASSERT_EQ(runFiliform({"ingest", path("in"), "-o", path("a.fil"), "--attributes", path("t.csv"), "--key", "name"})
                .exit_code,
            0);
  const auto set = TileSet::open(path("a.fil"));
  const CellAttributes attributes(*set);
  ASSERT_EQ(attributes.columns().size(), 5u);
  std::string from = path("a.fil");
  for (const char* const way : {"one.precomputed", "two/", "three.precomputed"}) {
    SCOPED_TRACE(way);
    std::vector<std::string> words{"export", from, "--all", "-o", path(way)};
    if (path(way).ends_with('/')) words.insert(words.end(), {"--format", "precomputed"});
    const Outcome out = runFiliform(words);
    ASSERT_EQ(out.exit_code, 0) << out.err;
    ingest(path(way), path("back.fil"));
    const auto back = TileSet::open(path("back.fil"));
    const CellAttributes there(*back);
    ASSERT_EQ(back->cell_count(), 3u);
    for (std::uint32_t id = 0; id < 3; ++id) {
      std::uint32_t other = 0;
      while (other < 2 && back->cell(other).name != set->cell(id).name) ++other;
      ASSERT_EQ(back->cell(other).name, set->cell(id).name);
      expectSame(cellOf(*set, id), cellOf(*back, other), kTypes | kNearRadii);
      for (std::uint32_t column = 0; column < 5; ++column) {
        const auto found = there.find(attributes.columns()[column].name);
        ASSERT_TRUE(found) << attributes.columns()[column].name;
        EXPECT_EQ(there.value(*found, other), attributes.value(column, id)) << attributes.columns()[column].name;
      }
      EXPECT_EQ(there.value(there.find("source").value(), other), AttributeValue(set->cell(id).source));
    }
    from = path(std::string(1, *way) + ".fil");  // the next way exports what came back
    ingest(path(way), from);
  }
}

TEST(SkeletonShards, SpreadManyCellsOverFiles) {
  std::vector<std::uint64_t> numbers;
  for (std::uint64_t i = 0; i < 5000; ++i) numbers.push_back(720575940600000000ULL + i * 1024);
  const tools::SkeletonShards shards(numbers, std::uint64_t{1} << 30);
  EXPECT_EQ(shards.sharding().shard_bits, 5);
  EXPECT_EQ(shards.count(), 32u);
  EXPECT_EQ(shards.name(0), "00.shard");
  EXPECT_EQ(shards.name(31), "1f.shard");
  std::set<std::size_t> seen;
  for (std::size_t shard = 0; shard < shards.count(); ++shard)
    shards.content(shard, [&](std::size_t i) {
      EXPECT_TRUE(seen.insert(i).second);
      return std::string("x");
    });
  EXPECT_EQ(seen.size(), numbers.size());
}

// Known values of MurmurHash3_x86_128 with seed 0; the first 8 bytes, little-endian.
TEST(SkeletonShards, HashIsMurmur) {
  EXPECT_EQ(tools::murmurHash(0), 0x4772b084e028ae41ULL);
  EXPECT_EQ(tools::murmurHash(1), 0xe8bd67d616d4ce9aULL);
  EXPECT_EQ(tools::murmurHash(720575940626286432ULL), 0x50337d72914727a6ULL);
}

TEST_F(Export, RealCellsComeBack) {
  FILIFORM_NEEDS_CORPUS();
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(*test::corpusFolder() / "morphologies"))
    if (entry.path().extension() == ".swc") files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  ASSERT_FALSE(files.empty());
  const std::size_t step = std::max<std::size_t>(1, files.size() / 4);
  for (std::size_t i = 0; i < files.size(); i += step) {
    SCOPED_TRACE(files[i]);
    if (runFiliform({"ingest", files[i], "-o", path("real.fil"), "--force"}).exit_code != 0) continue;
    expectRoundTrips(path("real.fil"), 0, false);
  }
}

}  // namespace
}  // namespace filiform
