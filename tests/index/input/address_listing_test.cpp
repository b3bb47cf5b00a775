// Skeletons at addresses, as clouds serve them: codings of the transport, volumes, addresses of buckets.
#include "index/errors.h"
#include "index/input/input.h"
#include "tests/support/gzip_bytes.h"
#include "tests/support/servers/http_server.h"
#include "tests/support/temp_folder.h"
#include "tests/support/variable.h"

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::HttpServer;
using test::Variable;
using Ids = std::vector<std::uint64_t>;

const char* const kSkeletonInfo = R"({"@type": "neuroglancer_skeletons", "segment_properties": "names"})";
const char* const kVolumeInfo =
    R"({"type": "segmentation", "skeletons": "skeletons_mip_2", "mesh": "mesh", "scales": [{"key": "8_8_8"}]})";

// Two nodes, linked.
std::string bytesOfPair() {
  return std::string("\2\0\0\0\1\0\0\0", 8) + std::string(12, '\0') + std::string("\0\0\x7A\x44", 4) +
         std::string(8, '\0') + std::string("\0\0\0\0\1\0\0\0", 8);
}

// A zstd frame that holds the text as it is.
std::string zstdOf(const std::string& text) {
  const auto size = static_cast<std::uint32_t>(text.size());
  const std::uint32_t block = size << 3 | 1;
  std::string bytes = "\x28\xB5\x2F\xFD\xA0";
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(size >> 8 * i);
  for (int i = 0; i < 3; ++i) bytes += static_cast<char>(block >> 8 * i);
  return bytes + text;
}

// "source name" of each cell, and "source: reason" of each input that is refused.
std::vector<std::string> readAll(const std::string& argument, const Ids& ids = {}) {
  InputOptions options;
  options.remote.deadline_s = 2;
  if (!ids.empty()) options.ids = std::make_shared<const Ids>(ids);
  Input input({argument}, options);
  std::vector<std::string> found;
  for (Cell cell; input.next(cell);) {
    EXPECT_EQ(cell.samples(), 2u);
    found.push_back(cell.source + " " + cell.name);
  }
  for (const SourceReport& row : input.reports()) {
    if (row.entries.empty() && row.report.severity == Severity::kRefuse)
      found.push_back(row.file + ": " + refusalReason(row.report));
    for (const EntryReport& entry : row.entries)
      if (entry.report.severity == Severity::kRefuse)
        found.push_back(row.file + "/" + entry.entry + ": " + refusalReason(entry.report));
  }
  return found;
}

template <class Failure>
std::string failureOf(const std::string& argument, const Ids& ids = {1}) {
  try {
    readAll(argument, ids);
  } catch (const Failure& failure) {
    return failure.what();
  }
  return "no failure";
}

class AddressListing : public ::testing::Test {
 protected:
  AddressListing() { write("s/info", kSkeletonInfo); }
  void write(const std::string& file, const std::string& bytes) {
    std::filesystem::create_directories(std::filesystem::path(folder_.file(file)).parent_path());
    test::writeBytes(folder_.file(file), bytes);
  }
  using Found = std::vector<std::string>;

  const test::TempFolder folder_;
  HttpServer server_{folder_.path()};
};

TEST_F(AddressListing, ACodingOfTheTransportIsUndone) {
  write("s/info", test::gzipped(kSkeletonInfo));
  write("s/names/info", test::gzipped(R"({"inline": {"ids": ["1", "3"], "properties": [
      {"id": "label", "type": "label", "values": ["one", "three"]}]}})"));
  for (const char* const id : {"s/1", "s/3"}) write(id, test::gzipped(bytesOfPair()));
  server_.fault("coded", "/s/", 1000, {{"coding", "gzip"}});
  EXPECT_EQ(readAll(server_ / "s"), (Found{"s/1 one", "s/3 three"}));
  EXPECT_EQ(readAll(server_ / "s", {3}), (Found{"s/3 three"}));
  server_.clear();
  EXPECT_EQ(readAll(server_ / "s"), (Found{"s/1 one", "s/3 three"})) << "packed, and not said so";
  server_.fault("coded", "/s/1", 1000, {{"coding", "x-strange"}});
  const Found strange = readAll(server_ / "s");
  EXPECT_EQ(strange.front(), "s/3 three");
  EXPECT_NE(strange.at(1).find("Content-Encoding (x-strange)"), std::string::npos) << strange.at(1);
}

TEST_F(AddressListing, ZstdIsUndoneWhereLibcurlHasIt) {
  write("s/1", zstdOf(bytesOfPair()));
  server_.fault("coded", "/s/1", 1000, {{"coding", "zstd"}});
  const Found found = readAll(server_ / "s", {1});
  EXPECT_TRUE(found == Found{"s/1 "} || found.at(0).find("Content-Encoding (zstd)") != std::string::npos)
      << found.at(0);
}

TEST_F(AddressListing, WhatIsUnpackedIsBounded) {
  write("s/info", test::gzipped(kSkeletonInfo + std::string(std::size_t{64} << 20, ' ')));
  EXPECT_NE(failureOf<IoError>(server_ / "s").find("has more than 1048576 bytes"), std::string::npos);
  server_.fault("coded", "/s/", 1000, {{"coding", "gzip"}});
  EXPECT_NE(failureOf<IoError>(server_ / "s").find("has more than 1048576 bytes"), std::string::npos);
}

TEST_F(AddressListing, GzipBytesUnderAPlainNameAreReadInAFolderToo) {
  write("s/info", test::gzipped(kSkeletonInfo));
  write("s/1", test::gzipped(bytesOfPair()));
  write("s/3", bytesOfPair());
  write("s/4", test::gzipped(bytesOfPair()).substr(0, 30));
  EXPECT_EQ(readAll(folder_.file("s")), (Found{"1 ", "3 ", "4: archive is cut short; fetch it again"}));
}

TEST_F(AddressListing, WhatIsMissingIsNotOnTheServer) {
  write("s/1", bytesOfPair());
  EXPECT_EQ(readAll(server_ / "s", {1, 2}), (Found{"s/1 ", "s/2: is not on the server (404)"}));
  EXPECT_EQ(readAll(folder_.file("s"), {1, 2}), (Found{"1 ", "2: is not in this folder"}));
  EXPECT_NE(failureOf<IoError>(server_ / "nothing").find("nothing/info: is not on the server (404); give"),
            std::string::npos);
}

TEST_F(AddressListing, AVolumeNamesItsSkeletons) {
  write("v/info", kVolumeInfo);
  EXPECT_NE(failureOf<IoError>(server_ / "v").find("skeletons_mip_2/info: is not on the server"), std::string::npos);
  EXPECT_NE(failureOf<InputError>(folder_.file("v")).find("has no info of skeletons"), std::string::npos);
  write("v/skeletons_mip_2/info", R"({"@type": "neuroglancer_skeletons"})");
  write("v/skeletons_mip_2/77", bytesOfPair());
  write("v/skeletons_mip_2/78:0:0_0_0", bytesOfPair());
  EXPECT_EQ(readAll(folder_.file("v")), (Found{"77 "}));
  EXPECT_EQ(readAll(server_ / "v", {77}), (Found{"skeletons_mip_2/77 "}));
  for (const auto& [info, said] : std::map<std::string, std::string>{
           {R"({"type": "image", "scales": []})", "its info is that of an image volume, which has no skeletons; give"},
           {R"({"type": "segmentation", "scales": [], "mesh": "m"})", "that of a volume with meshes, but without"},
           {R"({"@type": "neuroglancer_multilod_draco"})", "its info is that of meshes; give the address"},
           {R"({"@type": "neuroglancer_annotations_v1"})", "its info is that of neuroglancer_annotations_v1; give"},
           {R"({"type": "segmentation", "scales": [], "skeletons": "../s"})", "its skeletons lead out of the folder"},
           {"[]", "its info is not that of skeletons; give the address"}}) {
    write("w/info", info);
    EXPECT_NE(failureOf<InputError>(server_ / "w").find(said), std::string::npos)
        << failureOf<InputError>(server_ / "w");
  }
}

TEST_F(AddressListing, PropertiesOfTheVolumeAndASpatialIndexChoose) {
  write("v/info", R"({"type": "segmentation", "skeletons": "skel", "segment_properties": "props", "scales": [
      {"resolution": [10, 10, 10], "size": [400, 100, 100]}]})");
  write("v/props/info", R"({"inline": {"ids": ["1", "2", "3"], "properties": [
      {"id": "label", "type": "label", "values": ["one", "two", "three"]},
      {"id": "layer", "type": "number", "data_type": "uint8", "values": [4, 5, 6]}]}})");
  write("v/skel/info", R"({"@type": "neuroglancer_skeletons", "spatial_index": {"chunk_size": [2000, 2000, 2000]}})");
  for (const char* const id : {"1", "2", "3"}) write(std::string("v/skel/") + id, bytesOfPair());
  write("v/skel/0-2000_0-1000_0-1000.spatial", R"({"1": [0, 0, 0, 10, 10, 10], "2": [900, 0, 0, 1900, 10, 10]})");
  write("v/skel/2000-4000_0-1000_0-1000.spatial.gz", test::gzipped(R"({"3": [2000, 0, 0, 2001, 1, 1]})"));
  const auto chosen = [&](const std::string& argument, std::vector<std::string> where,
                          std::optional<std::array<Vector3d, 2>> box_um = {}) {
    InputOptions options;
    options.where = std::move(where);
    options.box_um = box_um;
    Found names;
    Input input({argument}, options);
    for (Cell cell; input.next(cell);) names.push_back(cell.name);
    return names;
  };
  const std::array<Vector3d, 2> left{Vector3d(0.8, 0, 0), Vector3d(1, 1, 1)}, all{Vector3d(0, 0, 0), Vector3d(9, 9, 9)};
  for (const std::string& place : {server_ / "v", folder_.file("v")}) {
    EXPECT_EQ(chosen(place, {}), (Found{"one", "two", "three"})) << place;
    EXPECT_EQ(chosen(place, {"layer>=5"}), (Found{"two", "three"})) << place;
    EXPECT_EQ(chosen(place, {"layer>=5", "layer!=6"}), (Found{"two"})) << place;
    EXPECT_EQ(chosen(place, {}, left), (Found{"two"})) << place;
    EXPECT_EQ(chosen(place, {"layer>=5"}, all), (Found{"two", "three"})) << place;
    EXPECT_THROW(chosen(place, {"layer=9"}), InputError) << "none";
    EXPECT_THROW(chosen(place, {"depth>3"}), UsageError) << "no such property";
  }
  EXPECT_EQ(chosen(server_ / "v/skel", {}, left).size(), 1u) << "the volume is above";
  EXPECT_EQ(chosen(folder_.file("v/skel"), {}, left).size(), 1u);
  EXPECT_THROW(chosen(server_ / "v/skel", {"layer=5"}), InputError) << "it names no properties itself";
  std::filesystem::remove(folder_.file("v/skel/2000-4000_0-1000_0-1000.spatial.gz"));
  EXPECT_THROW(chosen(server_ / "v", {}, all), IoError) << "a hole in the index";
  write("cell.swc", "1 1 0 0 0 1 -1\n2 3 1 0 0 1 1\n");
  EXPECT_THROW(chosen(folder_.file("cell.swc"), {"layer=5"}), UsageError) << "no skeletons";
}

TEST_F(AddressListing, PropertiesOfAVolumeNameItsSkeletons) {
  const auto properties = [](const std::string& ids, const std::string& labels) {
    return R"({"inline": {"ids": [)" + ids + R"(], "properties": [{"id": "label", "type": "label", "values": [)" +
           labels + "]}]}}";
  };
  write("v/info", R"({"type": "segmentation", "scales": [], "skeletons": "s/", "segment_properties": "names"})");
  write("v/names/info", properties(R"("1", "3")", R"("one", "three")"));
  write("v/s/info", R"({"@type": "neuroglancer_skeletons", "segment_properties": "own"})");
  for (const char* const id : {"v/s/1", "v/s/3", "v/s/4"}) write(id, bytesOfPair());
  EXPECT_EQ(readAll(server_ / "v"), (Found{"s/1 one", "s/3 three"})) << "it lists them too";
  EXPECT_EQ(readAll(server_ / "v", {3, 4}), (Found{"s/3 three", "s/4 "}));
  EXPECT_EQ(readAll(folder_.file("v")), (Found{"1 one", "3 three", "4 "}));
  write("v/s/own/info", properties(R"("4")", R"("four")"));
  EXPECT_EQ(readAll(server_ / "v"), Found{"s/4 four"}) << "those of the skeletons come first";
  EXPECT_EQ(readAll(folder_.file("v")), (Found{"1 ", "3 ", "4 four"}));
}

TEST_F(AddressListing, AnAddressHoldsNoPasswordAndNoQuery) {
  const std::string host = server_.url().substr(7);
  for (const std::string& wrong : {"http://user:s3cret@" + host + "/s", server_ / "s?s3cret", server_ / "s#s3cret"}) {
    const std::string said = failureOf<UsageError>(wrong);
    EXPECT_NE(said.find("an address must not contain"), std::string::npos) << said;
    EXPECT_EQ(said.find("s3cret"), std::string::npos) << "a secret in a message";
  }
}

TEST_F(AddressListing, BytesBehindACodingAreRefusedAtOnce) {
  write("s/1", test::gzipped(bytesOfPair()) + test::gzipped(bytesOfPair()));
  server_.fault("coded", "/s/1", 1000, {{"coding", "gzip"}});
  server_.log();
  EXPECT_NE(readAll(server_ / "s", {1}).at(0).find("its Content-Encoding (gzip) is damaged"), std::string::npos);
  int asked = 0;
  for (const auto& request : server_.log()) asked += request["path"] == "/s/1";
  EXPECT_EQ(asked, 1);
}

TEST_F(AddressListing, AShardThatIsRefusedIsNotCalledMissing) {
  write("h/info", R"({"@type": "neuroglancer_skeletons", "sharding": {"@type": "neuroglancer_uint64_sharded_v1",
      "preshift_bits": 0, "hash": "identity", "minishard_bits": 0, "shard_bits": 2}})");
  const std::string pair = bytesOfPair();
  std::string shard;
  const auto add = [&](std::uint64_t number) {
    for (int i = 0; i < 8; ++i) shard += static_cast<char>(number >> 8 * i);
  };
  for (const std::uint64_t number : {pair.size(), pair.size() + 24}) add(number);
  shard += pair;
  for (const std::uint64_t number : {std::size_t{5}, std::size_t{0}, pair.size()}) add(number);
  write("h/1.shard", shard);
  server_.fault("status", "/h/2.shard", 1000, {{"status", 403}});
  EXPECT_EQ(readAll(server_ / "h", {5, 6, 7}),
            (Found{"1.shard/5 ", "6: its shard 2.shard is refused by the server (403), or is not there",
                   "7: its shard 3.shard is not on the server (404)"}));
  EXPECT_NE(failureOf<IoError>(server_ / "h", {6}).find("refuses access (403)"), std::string::npos);
  EXPECT_NE(failureOf<InputError>(server_ / "h", {7}).find("holds no shard with these ids"), std::string::npos);
}

TEST_F(AddressListing, AnEndedRunGoesOnFromTheCache) {
  write("s/1", bytesOfPair());
  write("s/3", bytesOfPair());
  InputOptions options;
  options.remote.cache_folder = folder_.file("cache");
  options.ids = std::make_shared<const Ids>(Ids{1});
  const auto objectsAsked = [&] {
    server_.log();
    Input input({server_ / "s"}, options);
    for (Cell cell; input.next(cell);) EXPECT_EQ(cell.samples(), 2u);
    Found asked;
    for (const auto& request : server_.log())
      if (const std::string path = request["path"]; !path.ends_with("info")) asked.push_back(path);
    return asked;
  };
  EXPECT_EQ(objectsAsked(), (Found{"/s/1"}));
  options.ids = std::make_shared<const Ids>(Ids{1, 3});
  EXPECT_EQ(objectsAsked(), (Found{"/s/3"}));
  EXPECT_EQ(objectsAsked(), Found{});
}

TEST_F(AddressListing, BucketsAreReadByTheirUsualAddresses) {
  write("bucket/v/info", kVolumeInfo);
  write("bucket/v/skeletons_mip_2/info", R"({"@type": "neuroglancer_skeletons"})");
  write("bucket/v/skeletons_mip_2/77", bytesOfPair());
  const Found all{"skeletons_mip_2/77 "};
  const Variable google("STORAGE_EMULATOR_HOST", server_.url().substr(7) + "/");
  const Variable amazon("AWS_ENDPOINT_URL", server_.url());
  const Variable home("HOME", folder_.path());
  const Variable key("AWS_ACCESS_KEY_ID", std::nullopt), secret("AWS_SECRET_ACCESS_KEY", std::nullopt);
  const Variable profile("AWS_PROFILE", std::nullopt), endpoint("AWS_ENDPOINT_URL_S3", std::nullopt);
  const std::string place = server_ / "bucket/v";
  for (const std::string& address :
       std::vector<std::string>{"gs://bucket/v", "gs://bucket/v/", "precomputed://gs://bucket/v",
                                "gs://bucket/v/|neuroglancer-precomputed:", "s3://bucket/v",
                                "precomputed://s3://bucket/v/", "s3://bucket/v|neuroglancer-precomputed:",
                                place + "|neuroglancer-precomputed:", "precomputed://middleauth+" + place})
    EXPECT_EQ(readAll(address, {77}), all) << address;
  server_.log();
  readAll("s3://bucket/v", {77});
  for (const auto& request : server_.log()) EXPECT_TRUE(request["token"].is_null()) << "a public bucket needs no keys";
  EXPECT_EQ(readAll("gs://bucket/v", {77, 78}).back(), "skeletons_mip_2/78: is not on the server (404)");
  EXPECT_NE(failureOf<InputError>("gs://bucket/v|zarr3:").find("only neuroglancer-precomputed: is known"),
            std::string::npos);
  for (const char* const wrong : {"gs://", "gs:///", "precomputed://x", "precomputed://ftp://a/b"})
    EXPECT_NE(failureOf<UsageError>(wrong).find("is not a valid address; give gs://"), std::string::npos) << wrong;
  EXPECT_NE(failureOf<UsageError>("s3://bucket").find("is not a valid address"), std::string::npos);
}

}  // namespace
}  // namespace filiform
