// Sharded skeletons, and skeletons on a server.
#include "index/containers/internal/shard_index.h"

#include "index/errors.h"
#include "index/formats/neuroglancer/object_ids.h"
#include "index/input/input.h"
#include "tests/support/gzip_bytes.h"
#include "tests/support/servers/http_server.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <bit>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

std::string u64(std::uint64_t value) {
  std::string bytes;
  for (int i = 0; i < 8; ++i) bytes += static_cast<char>(value >> (8 * i));
  return bytes;
}

// Two nodes 1000 nm apart, with a radius of 250 nm.
std::string pairSkeleton(float x) {
  const auto f32 = [](float v) { return u64(std::bit_cast<std::uint32_t>(v)).substr(0, 4); };
  return u64(2).substr(0, 4) + u64(1).substr(0, 4) + f32(x) + f32(0) + f32(0) + f32(x + 1000) + f32(0) + f32(0) +
         u64(0).substr(0, 4) + u64(1).substr(0, 4) + f32(250) + f32(250);
}

ShardScheme shardingWith(unsigned preshift, unsigned minishard, unsigned shard, bool murmur, bool packed) {
  ShardScheme sharding;
  sharding.preshift_bits = preshift;
  sharding.minishard_bits = minishard;
  sharding.shard_bits = shard;
  sharding.murmur = murmur;
  sharding.gzip_index = sharding.gzip_data = packed;
  return sharding;
}

std::string infoOf(const ShardScheme& s, const std::string& more = "") {
  std::ostringstream out;
  const char* const encoding = s.gzip_data ? "gzip" : "raw";
  out << R"({"@type": "neuroglancer_skeletons", "transform": [1,0,0,0,0,1,0,0,0,0,1,0],)"
      << R"("vertex_attributes": [{"id": "radius", "data_type": "float32", "num_components": 1}],)" << more
      << R"("sharding": {"@type": "neuroglancer_uint64_sharded_v1", "hash": ")"
      << (s.murmur ? "murmurhash3_x86_128" : "identity") << R"(", "preshift_bits": )" << s.preshift_bits
      << R"(, "minishard_bits": )" << s.minishard_bits << R"(, "shard_bits": )" << s.shard_bits
      << R"(, "minishard_index_encoding": ")" << encoding << R"(", "data_encoding": ")" << encoding << R"("}})";
  return out.str();
}

// Writes the shards of these objects as the format says, by the simplest means.
void writeShards(const std::string& folder, const ShardScheme& s, const std::vector<std::uint64_t>& ids,
                 const std::string& more = "") {
  std::filesystem::create_directories(folder);
  test::writeBytes(folder + "/info", infoOf(s, more));
  std::map<std::uint64_t, std::map<std::uint64_t, std::vector<std::uint64_t>>> shards;
  for (const std::uint64_t id : ids) shards[s.shardOf(id)][s.minishardOf(id)].push_back(id);
  for (auto& [shard, minishards] : shards) {
    std::string index(std::size_t{16} << s.minishard_bits, '\0'), body;
    for (auto& [minishard, members] : minishards) {
      std::sort(members.begin(), members.end());
      std::string rows[3];
      const std::uint64_t first = body.size();
      std::uint64_t last_id = 0, start = first;
      for (const std::uint64_t id : members) {
        const std::string skeleton = pairSkeleton(static_cast<float>(id % 1000));
        const std::string stored = s.gzip_data ? test::gzipped(skeleton) : skeleton;
        rows[0] += u64(id - last_id);
        rows[1] += u64(id == members.front() ? start : 0);
        rows[2] += u64(stored.size());
        last_id = id;
        body += stored;
        start += stored.size();
      }
      std::string table = rows[0] + rows[1] + rows[2];
      if (s.gzip_index) table = test::gzipped(table);
      index.replace(16 * minishard, 16, u64(body.size()) + u64(body.size() + table.size()));
      body += table;
    }
    test::writeBytes(folder + "/" + s.fileNameOf(shard), index + body);
  }
}

const std::vector<std::uint64_t> kObjects = {0,         1, 17, 720575940600000001, 720575940600000002, UINT64_MAX - 1,
                                             UINT64_MAX};

std::vector<std::string> namesIn(const std::string& argument, InputOptions options = {},
                                 std::vector<SourceReport>* rows = nullptr) {
  options.threads = 2;
  Input input({argument}, options);
  std::vector<std::string> sources;
  for (Cell cell; input.next(cell);) {
    EXPECT_EQ(cell.samples(), 2u);
    EXPECT_NEAR((cell.positions_um[1] - cell.positions_um[0]).norm(), 1, 1e-9);
    EXPECT_FLOAT_EQ(cell.radii_um[0], 0.25f);
    sources.push_back(cell.source);
  }
  if (rows != nullptr) *rows = input.reports();
  std::vector<std::string> names = cellNames(sources);
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::string> decimalsOf(const std::vector<std::uint64_t>& ids) {
  std::vector<std::string> names;
  for (const std::uint64_t id : ids) names.push_back(std::to_string(id));
  std::sort(names.begin(), names.end());
  return names;
}

TEST(ShardIndex, MemoryFollowsTheBytesThatCome) {
  struct NoMore {};
  std::size_t most = 0;
  std::vector<ShardObject> objects;
  const auto read = [&](std::uint64_t offset, std::span<char> bytes) {
    const std::string pair = u64(0) + u64(internal::kMostIndexBytes);
    if (offset == 0) std::copy(pair.begin(), pair.end(), bytes.begin());
    most = std::max(most, bytes.size());
    if (offset > 0) throw NoMore();
  };
  EXPECT_THROW(
      internal::listShard(shardingWith(0, 0, 0, false, false), std::nullopt, std::uint64_t{1} << 40, read, objects),
      NoMore);
  EXPECT_LE(most, std::size_t{1} << 20);
}

TEST(ShardIndex, AFileHasAtLeastAByteForEachObject) {
  std::string table;
  for (int i = 0; i < 100'000; ++i) table += u64(1);
  table.resize(3 * table.size(), '\0');
  const std::string packed = test::gzipped(table), file = u64(0) + u64(packed.size()) + packed;
  std::vector<ShardObject> objects;
  const auto read = [&](std::uint64_t offset, std::span<char> bytes) {
    std::copy_n(file.begin() + static_cast<std::ptrdiff_t>(offset), bytes.size(), bytes.begin());
  };
  EXPECT_NE(internal::listShard(shardingWith(0, 0, 0, false, true), std::nullopt, file.size(), read, objects)
                .find("more objects than the file has bytes"),
            std::string::npos);
  EXPECT_TRUE(objects.empty());
}

// Values by libmurmurhash 2 (lmmh_x86_128 of the eight bytes of the id).
TEST(ShardScheme, HashesAsTheFormatSays) {
  ShardScheme s = shardingWith(0, 32, 32, true, false);
  const auto hash = [&](std::uint64_t id) { return s.shardOf(id) << 32 | s.minishardOf(id); };
  for (const auto& [id, wanted] :
       std::vector<std::pair<std::uint64_t, std::uint64_t>>{{0ull, 0x4772B084E028AE41ull},
                                                            {1ull, 0xE8BD67D616D4CE9Aull},
                                                            {17ull, 0x91F6ECE4313A2C94ull},
                                                            {720575940600000001ull, 0x8273486EFEF91DB0ull},
                                                            {9223372036854775808ull, 0x998A35E4316ACFA8ull},
                                                            {18446744073709551615ull, 0x574F66BD212B5D1Aull},
                                                            {123456789012345678ull, 0xF26826DFF5A1394Eull}})
    EXPECT_EQ(hash(id), wanted) << id;
  s = shardingWith(3, 2, 5, false, false);
  EXPECT_EQ(s.minishardOf(0b1011011), 0b11u);
  EXPECT_EQ(s.shardOf(0b1011011), 0b10u);
  EXPECT_EQ(s.fileNameOf(2), "02.shard");
  EXPECT_EQ(shardingWith(0, 0, 0, false, false).fileNameOf(0), "0.shard");
  EXPECT_EQ(shardingWith(0, 0, 12, false, false).fileNameOf(0xABC), "abc.shard");
}

TEST(SkeletonShards, EveryObjectOfEveryKindIsFound) {
  for (const bool murmur : {false, true})
    for (const bool packed : {false, true})
      for (const unsigned minishard_bits : {0u, 3u}) {
        const test::TempFolder folder;
        writeShards(folder.file("s"), shardingWith(1, minishard_bits, 4, murmur, packed), kObjects);
        EXPECT_EQ(namesIn(folder.file("s")), decimalsOf(kObjects)) << murmur << packed << minishard_bits;
      }
}

TEST(SkeletonShards, IdsChooseObjects) {
  const test::TempFolder folder;
  writeShards(folder.file("s"), shardingWith(0, 1, 0, true, true), kObjects);
  InputOptions options;
  options.ids = std::make_shared<const std::vector<std::uint64_t>>(std::vector<std::uint64_t>{17, UINT64_MAX});
  EXPECT_EQ(namesIn(folder.file("s"), options), (std::vector<std::string>{"17", "18446744073709551615"}));
  writeShards(folder.file("t"), shardingWith(0, 1, 6, false, false), kObjects);
  options.ids = std::make_shared<const std::vector<std::uint64_t>>(std::vector<std::uint64_t>{17, 145});
  std::vector<SourceReport> rows;  // 145 belongs to the shard of 17, and is not there
  EXPECT_EQ(namesIn(folder.file("t"), options, &rows), (std::vector<std::string>{"17"}));
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].report.codes[InputCode::E_UNREADABLE], 1u);
}

std::string shardReason(const std::string& bytes, unsigned minishard_bits = 0) {
  const test::TempFolder folder;
  const ShardScheme s = shardingWith(0, minishard_bits, 0, false, false);
  test::writeBytes(folder.file("info"), infoOf(s));
  test::writeBytes(folder.file("0.shard"), bytes);
  Input input({folder.path()});
  Cell cell;
  EXPECT_FALSE(input.next(cell));
  EXPECT_EQ(input.reports().at(0).report.severity, Severity::kRefuse);
  return refusalReason(input.reports().at(0).report);
}

TEST(SkeletonShards, WhatPointsOutsideTheFileIsRefused) {
  EXPECT_EQ(shardReason(""), "is shorter than its index");
  EXPECT_EQ(shardReason(u64(0) + u64(24)), "minishard 0: its index lies outside the file");
  EXPECT_EQ(shardReason(u64(0) + u64(UINT64_MAX)), "minishard 0: its index lies outside the file");
  EXPECT_EQ(shardReason(u64(8) + u64(0)), "minishard 0: its index lies outside the file");
  EXPECT_EQ(shardReason(u64(0) + u64(23) + std::string(23, '\0')),
            "minishard 0: its index is not a table of three rows");
  EXPECT_EQ(shardReason(u64(0) + u64(24) + u64(5) + u64(0) + u64(25)), "minishard 0: object 5 lies outside the file");
  EXPECT_EQ(shardReason(u64(0) + u64(24) + u64(5) + u64(UINT64_MAX) + u64(2)),
            "minishard 0: object 5 lies outside the file");
  EXPECT_EQ(shardReason(u64(0) + u64(0) + u64(0) + u64(24) + u64(2) + u64(0) + u64(0), 1),
            "minishard 1: object 2 belongs to another shard");
  EXPECT_EQ(shardReason("x", 40), "is shorter than its index");
}

TEST(SkeletonShards, ShardsWithoutInfoAreExplained) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("0.shard"), "x");
  try {
    const Input input({folder.path()});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("holds shards of skeletons, but no info file"), std::string::npos);
  }
}

TEST(SkeletonShards, ADamagedObjectLeavesTheOthers) {
  const test::TempFolder folder;
  writeShards(folder.file("s"), shardingWith(0, 0, 0, false, true), {1, 2});
  std::string bytes = test::readBytes(folder.file("s/0.shard"));
  bytes[16 + 20] = static_cast<char>(bytes[16 + 20] ^ 0x55);  // in the first object
  test::writeBytes(folder.file("s/0.shard"), bytes);
  std::vector<SourceReport> rows;
  EXPECT_EQ(namesIn(folder.file("s"), {}, &rows), (std::vector<std::string>{"2"}));
  EXPECT_EQ(rows.at(0).report.codes[InputCode::E_ZIP_CRC] + rows.at(0).report.codes[InputCode::E_FORMAT] +
                rows.at(0).report.codes[InputCode::E_ZIP_TRUNCATED],
            1u);
}

TEST(ObjectIds, NameTheLineOfAMistake) {
  EXPECT_EQ(readObjectIds("\xEF\xBB\xBF# ids\n 7 \r\n18446744073709551615 # the last\n", "ids"),
            (std::vector<std::uint64_t>{7, UINT64_MAX}));
  for (const auto& [text, message] : std::vector<std::pair<std::string, std::string>>{
           {"1\n-2\n", "ids:2: -2 is not an id"}, {"18446744073709551616", "ids:1: "}, {"\n#\n", "ids: holds no id"}}) {
    try {
      readObjectIds(text, "ids");
      FAIL() << text;
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()).substr(0, message.size()), message);
    }
  }
}

TEST(SkeletonsAtAnAddress, ShardsAreFoundByTheirNumbers) {
  const test::TempFolder folder;
  writeShards(folder.file("s"), shardingWith(0, 2, 3, true, true), kObjects);
  const test::HttpServer server(folder.path());
  EXPECT_EQ(namesIn(server / "s"), decimalsOf(kObjects));
  EXPECT_EQ(namesIn("precomputed://" + (server / "s") + "/"), decimalsOf(kObjects));
  InputOptions options;
  options.ids = std::make_shared<const std::vector<std::uint64_t>>(std::vector<std::uint64_t>{17});
  EXPECT_EQ(namesIn(server / "s", options), (std::vector<std::string>{"17"}));
  std::vector<SourceReport> rows;  // some belong to its shard, some to shards that are not there
  options.ids = std::make_shared<const std::vector<std::uint64_t>>(std::vector<std::uint64_t>{17, 18, 19, 20, 21, 22});
  EXPECT_EQ(namesIn(server / "s", options, &rows), (std::vector<std::string>{"17"}));
  std::uint64_t missing = 0;
  for (const SourceReport& row : rows) missing += row.report.codes[InputCode::E_UNREADABLE];
  EXPECT_EQ(missing, 5u);
}

TEST(SkeletonsAtAnAddress, TheIndexesOfAShardComeTogether) {
  const test::TempFolder folder;
  writeShards(folder.file("s"), shardingWith(0, 6, 0, true, true), kObjects);
  test::HttpServer server(folder.path());
  InputOptions options;
  options.ids = std::make_shared<const std::vector<std::uint64_t>>(std::vector<std::uint64_t>{17});
  EXPECT_EQ(namesIn(server / "s", options), (std::vector<std::string>{"17"}));
  std::size_t ranges = 0;
  for (const auto& request : server.log()) ranges += !request["range"].is_null();
  EXPECT_LE(ranges, 3u) << "indexes in two, then the object";
}

TEST(SkeletonsAtAnAddress, UnshardedOnesNeedIds) {
  const test::TempFolder folder;
  std::filesystem::create_directories(folder.file("s/properties"));
  const std::string info = R"({"@type": "neuroglancer_skeletons", "vertex_attributes": [
      {"id": "radius", "data_type": "float32", "num_components": 1}])";
  test::writeBytes(folder.file("s/info"), info + "}");
  for (const std::uint64_t id : kObjects) test::writeBytes(folder.file("s/" + std::to_string(id)), pairSkeleton(1));
  const test::HttpServer server(folder.path());
  try {
    namesIn(server / "s");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("name them with --ids FILE"), std::string::npos);
  }
  InputOptions options;
  options.ids = std::make_shared<const std::vector<std::uint64_t>>(std::vector<std::uint64_t>{17, 18, UINT64_MAX});
  std::vector<SourceReport> rows;
  EXPECT_EQ(namesIn(server / "s", options, &rows), (std::vector<std::string>{"17", "18446744073709551615"}));
  EXPECT_EQ(rows.at(0).report.codes[InputCode::E_UNREADABLE], 1u);  // 18 is not there
  test::writeBytes(folder.file("s/info"), info + R"(, "segment_properties": "properties"})");
  test::writeBytes(folder.file("s/properties/info"),
                   R"({"@type": "neuroglancer_segment_properties", "inline": {"ids": ["0", "720575940600000001"]}})");
  EXPECT_EQ(namesIn(server / "s"), (std::vector<std::string>{"0", "720575940600000001"}));
}

}  // namespace
}  // namespace filiform
