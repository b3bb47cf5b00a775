// Sets at an address, with a real server (tests/support/servers/http_server.py) and its faults.
#include "index/remote/http_source.h"

#include "index/ingest/ingest.h"
#include "index/levels/levels.h"
#include "index/remote/internal/background_reads.h"
#include "index/verify/verify.h"
#include "tests/index/remote/http_source_fixture.h"
#include "tests/support/sanitized.h"
#include "tests/support/scenes/tile_invariants.h"

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using test::HttpServer;
using test::HttpSourceTest;

double secondsOf(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

TEST_F(HttpSourceTest, EveryAnswerEqualsThatOfTheFolder) {
  const auto remote = openRemote();
  EXPECT_TRUE(remote->isRemote());
  EXPECT_FALSE(local_->isRemote());
  EXPECT_EQ(remote->manifest(), local_->manifest());
  test::expectSameTiles(*remote, *local_);
  EXPECT_EQ(remote->segmentCount(), local_->TileStore::segmentCount()) << "the sum over the cells";
  EXPECT_EQ(remote->decodedBytes(), local_->TileStore::decodedBytes()) << "the sum over the tiles";
  ASSERT_EQ(remote->cell_count(), local_->cell_count());
  for (std::uint32_t c = 0; c < local_->cell_count(); ++c) {
    EXPECT_EQ(remote->cell(c).name, local_->cell(c).name);
    EXPECT_EQ(remote->loadCellDetail(c).sample_ids, local_->loadCellDetail(c).sample_ids);
    EXPECT_EQ(remote->findCell(local_->cell(c).name), c);
  }
  EXPECT_EQ(remote->landmarks().points, local_->landmarks().points);
  EXPECT_EQ(remote->readProvenance(), local_->readProvenance());
  const auto levels = Levels::open(*remote), expected = Levels::open(*local_);
  ASSERT_EQ(levels->size(), expected->size());
  for (LevelId l = 0; l < levels->size(); ++l) test::expectSameTile(*levels->load(l), *expected->load(l));
}

TEST_F(HttpSourceTest, AServiceAnswersTheSame) {
  fs::create_directories(*folder_ / "v1/sets/column");
  if (!fs::exists(*folder_ / "v1/sets/column/files"))
    fs::create_directory_symlink(*folder_ / "a.fil", *folder_ / "v1/sets/column/files");
  test::expectSameTiles(*TileSet::open(server_ / "v1/sets/column"), *local_);
}

TEST_F(HttpSourceTest, AtMostFourRequestsComeBeforeTheFirstTile) {
  ASSERT_GT(local_->tile_count(), 16u);
  const TileId tile = local_->tile_count() / 2;
  const GridPoint place = mortonPoint(local_->entry(tile).key.low);
  server_.log();
  const auto set = openRemote();
  set->load(set->home(place));
  const json log = server_.log();
  // In a large directory, inner page and page lie in different blocks: then four requests come before the tile.
  ASSERT_EQ(log.size(), 4u) << log.dump(1);
  EXPECT_EQ(log[0]["path"], "/a.fil/CURRENT");
  EXPECT_TRUE(log[1]["path"].get<std::string>().ends_with("/manifest.json"));
  EXPECT_TRUE(log[2]["path"].get<std::string>().ends_with("/directory.bin"));
  EXPECT_TRUE(log[3]["path"].get<std::string>().ends_with(".pack"));
  for (const json& request : log) EXPECT_EQ(request["port"], log[0]["port"]) << "the connection stays open";
}

TEST_F(HttpSourceTest, ADirectoryIsReadInBlocks) {
  const test::TempFolder folder;
  const std::string name = "r-0123456789abcdef/directory.bin";
  fs::create_directories(folder / "r-0123456789abcdef");
  std::string content(1'000'000, 'x');
  for (std::size_t i = 0; i < content.size(); ++i) content[i] = static_cast<char>(i * 2654435761u >> 13);
  test::writeBytes(folder / name, content);
  HttpServer server(folder.path());
  const HttpSource source(server.url(), quick());
  source.expect(name, content.size());
  for (int round = 0; round < 3; ++round)
    for (std::size_t at = 0; at < content.size(); at += 32'768 + 1'234) {
      std::vector<std::uint8_t> bytes(std::min<std::size_t>(32'768, content.size() - at));
      source.read(name, at, bytes);
      ASSERT_TRUE(std::equal(bytes.begin(), bytes.end(), reinterpret_cast<const std::uint8_t*>(content.data()) + at));
    }
  EXPECT_EQ(source.counters().requests, 4u);
  EXPECT_TRUE(source.discard(name, 300'000, 10));
  std::vector<std::uint8_t> bytes(10);
  source.read(name, 300'000, bytes);
  EXPECT_EQ(source.counters().requests, 5u);
  EXPECT_THROW(source.read(name, content.size() - 5, bytes), CorruptSet);
}

TEST_F(HttpSourceTest, ThreadsThatWantOneBlockShareARequest) {
  server_.delay(0.1);
  const HttpSource source(server_ / "a.fil");
  const std::string name = local_->revision() + "/directory.bin";
  const std::uint64_t size = fs::file_size(*folder_ / ("a.fil/" + name));
  source.expect(name, size);
  std::vector<std::thread> threads;
  for (std::uint64_t i = 0; i < 8; ++i)
    threads.emplace_back([&, i] {
      std::vector<std::uint8_t> bytes(10);
      source.read(name, i * (size - 10) / 8, bytes);
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(source.counters().requests, 1u);
}

TEST_F(HttpSourceTest, AHandDoesNotWaitForBulkWork) {
  constexpr std::size_t kBulk = 24, kApart = 250'000;  // too far from each other to be merged
  const test::TempFolder folder;
  const std::string name = "r-0123456789abcdef/x.bin";
  fs::create_directories(folder / "r-0123456789abcdef");
  test::writeBytes(folder / name, std::string(kBulk * kApart, 'x'));
  HttpServer server(folder.path());
  server.delay(0.2);
  const HttpSource source(server.url(), {.connections = 8});
  std::vector<std::thread> threads;
  std::atomic<std::size_t> done{0};
  for (std::size_t i = 0; i < kBulk; ++i)
    threads.emplace_back([&, i] {
      const internal::BackgroundReads bulk;
      std::vector<std::uint8_t> bytes(10);
      source.read(name, i * kApart, bytes);
      ++done;
    });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  std::vector<std::uint8_t> bytes(10);
  source.read(name, 5, bytes);
  EXPECT_LT(done, kBulk) << "the bulk work came first";
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(source.counters().requests, kBulk + 1);
}

TEST_F(HttpSourceTest, TheWholeDirectoryComesInFewRequests) {
  const auto remote = openRemote();
  server_.log();
  remote->readDirectory();
  EXPECT_LE(server_.log().size(), 2u) << "blocks of 256 KiB";
  for (TileId t = 0; t < local_->tile_count(); ++t) remote->entry(t);
  EXPECT_TRUE(server_.log().empty());
}

TEST_F(HttpSourceTest, PagesOnlyAreReadOfCells) {
  const auto set = openRemote();
  server_.log();
  set->cell(3);
  set->entry(0);
  std::map<std::string, std::uint64_t> bytes;
  for (const json& request : server_.log()) {
    const std::string range = request["range"], path = request["path"];
    const std::size_t dash = range.find('-');
    bytes[path.substr(path.rfind('/') + 1)] += std::stoull(range.substr(dash + 1)) - std::stoull(range.substr(6)) + 1;
  }
  for (const SetFile& file : set->files()) {
    if (file.name == "cells.bin") {
      EXPECT_LT(bytes[file.name], file.bytes / 2);
    }
  }
  EXPECT_EQ(bytes.size(), 2u);
}

TEST_F(HttpSourceTest, PassingFaultsAreTriedAgain) {
  const std::vector<std::pair<std::string, json>> faults{{"status", {{"status", 500}}},
                                                         {"status", {{"status", 502}}},
                                                         {"status", {{"status", 503}, {"retry_after", 1}}},
                                                         {"status", {{"status", 504}}},
                                                         {"status", {{"status", 408}}},
                                                         {"status", {{"status", 429}, {"retry_after", 1}}},
                                                         {"status", {{"status", 304}}},
                                                         {"cut", {}},
                                                         {"short", {}},
                                                         {"reset", {}},
                                                         {"stall", {{"s", 3}}},
                                                         {"silent", {{"s", 3}}},
                                                         {"flip", {}}};
  for (const auto& [kind, fields] : faults) {
    SCOPED_TRACE(kind + " " + fields.dump());
    for (const char* file : {"CURRENT", "manifest.json", "directory.bin", ".pack"}) {
      SCOPED_TRACE(file);
      const bool whole = std::string(file) == "CURRENT" || std::string(file) == "manifest.json";
      // No checksum covers CURRENT; a wrong manifest is an error of the set. "short" needs a range.
      if (whole && (kind == "flip" || kind == "short")) continue;
      // These take a second each.
      const bool slow = kind == "stall" || kind == "silent" || (fields.is_object() && fields.contains("retry_after"));
      if (slow && std::string(file) != ".pack") continue;
      server_.fault(kind, file, 1, fields.is_null() ? json::object() : fields);
      const auto set = openRemote({.deadline_s = 8, .stall_s = 1});
      test::expectSameTile(*set->load(1), *local_->load(1));
      server_.clear();
    }
  }
}

TEST_F(HttpSourceTest, RetryAfterIsKept) {
  server_.fault("status", "CURRENT", 1, {{"status", 429}, {"retry_after", 1}});
  EXPECT_GE(secondsOf([&] { openRemote(); }), 1);
  server_.fault("status", "CURRENT", 100, {{"status", 503}, {"retry_after", 3600}});
  std::string line;
  EXPECT_LT(secondsOf([&] { line = refusal<IoError>(quick()); }), 2) << "no wait beyond the deadline";
  EXPECT_NE(line.find("try again in 3600 s"), std::string::npos) << line;
}

TEST_F(HttpSourceTest, EveryLastingFaultGivesOneClearLine) {
  struct LastingFault {
    std::string kind;
    json fields;
    std::string file, said;
  };
  const std::vector<LastingFault> rows{
      {"status", {{"status", 401}}, "CURRENT", "--token-file"},
      {"status", {{"status", 403}}, "CURRENT", "refuses access (403)"},
      {"status", {{"status", 404}}, "CURRENT", "check the address"},
      {"status", {{"status", 404}}, ".pack", "open it again"},
      {"status", {{"status", 410}}, "directory.bin", "(410)"},
      {"status", {{"status", 418}}, ".pack", "answered 418"},
      {"status", {{"status", 500}}, "manifest", "answered 500, "},
      {"status", {{"status", 429}}, ".pack", "limits the number of requests"},
      {"status", {{"status", 302}, {"location", "/a.fil/CURRENT"}}, "CURRENT", "redirects too often"},
      {"status", {{"status", 302}, {"location", "ftp://host/x"}}, "CURRENT", "not HTTP"},
      {"status", {{"status", 302}}, "CURRENT", "answered 302"},
      {"large", {{"bytes", 100'000}}, "CURRENT", "has more than "},
      {"other", {}, "directory.bin", "other bytes than those asked for"},
      {"bare", {}, "directory.bin", "other bytes than those asked for"},
      {"cut", {}, ".pack", "cannot be read"},
      {"short", {}, ".pack", "cut its answer short"},
      {"reset", {}, "manifest", "check the address and the network"},
      {"silent", {{"s", 20}}, ".pack", "check the address and the network"},
      {"stall", {{"s", 20}}, "directory.bin", "check the address and the network"},
  };
  for (const LastingFault& row : rows) {
    SCOPED_TRACE(row.kind + " " + row.fields.dump() + " " + row.file);
    server_.fault(row.kind, row.file, 1000, row.fields.is_null() ? json::object() : row.fields);
    std::string line;
    EXPECT_LT(secondsOf([&] { line = refusal<IoError>(quick()); }), 8);
    EXPECT_NE(line.find(row.said), std::string::npos) << line;
    EXPECT_NE(line.find(server_ / "a.fil/"), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
    server_.clear();
  }
}

TEST_F(HttpSourceTest, DamageThatStaysIsReportedWithItsPlace) {
  server_.fault("flip", ".pack", 1000);
  const std::string line = refusal<CorruptTile>(quick());
  EXPECT_NE(line.find("checksum"), std::string::npos) << line;
  EXPECT_NE(line.find(server_ / "a.fil/r-"), std::string::npos) << line;
  server_.clear();
  server_.fault("flip", "directory.bin", 1000);
  EXPECT_NE(refusal<CorruptSet>(quick()).find("page"), std::string::npos);
}

TEST_F(HttpSourceTest, AFileThatEndsTooSoonIsDamage) {
  const HttpSource source(server_ / "a.fil", quick());
  const std::string name = local_->revision() + "/cells.bin";
  const std::uint64_t size = fs::file_size(*folder_ / ("a.fil/" + name));
  EXPECT_EQ(source.size(name), size);
  std::vector<std::uint8_t> bytes(100);
  EXPECT_THROW(source.read(name, size, bytes), CorruptSet);
  EXPECT_THROW(source.read(name, size - 50, bytes), CorruptSet);
  EXPECT_NO_THROW(source.read(name, size - 100, bytes));
  EXPECT_THROW(source.read("../CURRENT", 0, bytes), UsageError);
}

TEST_F(HttpSourceTest, AServerWithoutRangesIsCutOrRefused) {
  server_.fault("whole", ".", 1 << 30);
  test::expectSameTiles(*openRemote(), *local_);
  const test::TempFolder folder;
  fs::create_directories(folder / "r-0123456789abcdef");
  test::writeBytes(folder / "r-0123456789abcdef/x.bin", std::string(18 << 20, 'x'));
  HttpServer server(folder.path());
  server.fault("whole", ".", 1 << 30);
  const HttpSource source(server.url(), quick());
  std::vector<std::uint8_t> bytes(100);
  source.read("r-0123456789abcdef/x.bin", 15 << 20, bytes);
  EXPECT_EQ(bytes, std::vector<std::uint8_t>(100, 'x'));
  try {
    source.read("r-0123456789abcdef/x.bin", 17 << 20, bytes);
    ADD_FAILURE();
  } catch (const IoError& error) {
    EXPECT_NE(std::string(error.what()).find("ignores Range"), std::string::npos) << error.what();
  }
  EXPECT_LT(source.counters().bytes, 17u << 20) << "not the whole file, twice";
}

TEST_F(HttpSourceTest, APartInACodingIsRefused) {
  const HttpSource source(server_ / "a.fil", quick());
  const std::string name = local_->revision() + "/directory.bin";
  server_.fault("coded", "directory.bin", 2, {{"coding", "gzip"}});
  std::vector<std::uint8_t> bytes(10);
  for (const bool size : {false, true}) {
    try {
      size ? void(source.size(name)) : source.read(name, 0, bytes);
      ADD_FAILURE();
    } catch (const IoError& error) {
      EXPECT_NE(std::string(error.what()).find("packed (Content-Encoding: gzip), so that parts of it cannot be read"),
                std::string::npos)
          << error.what();
    }
  }
}

TEST_F(HttpSourceTest, RedirectsAreFollowedWithoutTheTokenToOthers) {
  HttpServer other(folder_->path());
  HttpServer asks(folder_->path(), {"--token", "secret-word"});
  const RemoteOptions with_token{.token = "secret-word", .deadline_s = 2};
  test::expectSameTile(*TileSet::open(asks / "a.fil", with_token)->load(0), *local_->load(0));
  for (const json& request : asks.log()) EXPECT_EQ(request["token"], "Bearer secret-word");

  const std::string tile = local_->revision() + "/tiles-00000.pack";
  asks.fault("status", ".pack", 1, {{"status", 302}, {"location", other / ("a.fil/" + tile)}});
  const auto set = TileSet::open(asks / "a.fil", with_token);
  test::expectSameTile(*set->load(0), *local_->load(0));
  const json there = other.log();
  ASSERT_EQ(there.size(), 1u);
  EXPECT_TRUE(there[0]["token"].is_null()) << there.dump();

  asks.fault("status", ".pack", 1, {{"status", 307}, {"location", "/a.fil/" + tile}});
  asks.log();
  EXPECT_NO_THROW(set->load(1));
  const json same = asks.log();
  ASSERT_EQ(same.size(), 2u);
  EXPECT_EQ(same[1]["token"], "Bearer secret-word") << "its own host";
}

TEST_F(HttpSourceTest, AWrongTokenIsSaidToBeWrongAndNotShown) {
  HttpServer asks(folder_->path(), {"--token", "right"});
  for (const auto& [token, said] :
       std::map<std::string, std::string>{{"", "asks for a token"}, {"wrong-word", "does not accept the token"}}) {
    try {
      TileSet::open(asks / "a.fil", {.token = token});
      ADD_FAILURE();
    } catch (const IoError& error) {
      EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find("wrong-word"), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(TileSet::open(asks / "a.fil", {.token = "a\r\nHost: b"}), UsageError);
}

TEST_F(HttpSourceTest, ACertificateThatNobodyVouchesForIsRefusedAtOnce) {
  const test::TempFolder folder;
  const std::string pem = folder / "own.pem";
  const std::string make = "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=127.0.0.1 -keyout '" + pem +
                           "' -out '" + pem + ".crt' 2>/dev/null && cat '" + pem + ".crt' >> '" + pem + "'";
  if (std::system(make.c_str()) != 0) GTEST_SKIP() << "no openssl";
  const HttpServer server(folder_->path(), {"--certificate", pem});
  const std::string address = "https" + (server / "a.fil").substr(4);
  EXPECT_LT(secondsOf([&] {
              try {
                TileSet::open(address, {.token = "a-secret"});
                ADD_FAILURE();
              } catch (const IoError& error) {
                EXPECT_NE(std::string(error.what()).find("certificate"), std::string::npos) << error.what();
              }
            }),
            RemoteOptions{}.deadline_s / 2);  // else it was tried again
}

TEST_F(HttpSourceTest, NeighbouringReadsAreMerged) {
  server_.delay(0.05);
  const HttpSource source(server_ / "a.fil", {.connections = 1});
  const std::string pack = local_->revision() + "/tiles-00000.pack";
  const std::string bytes = test::readBytes(*folder_ / ("a.fil/" + pack));
  constexpr std::size_t kPiece = 500;
  const std::size_t count = std::min<std::size_t>(24, bytes.size() / kPiece);
  ASSERT_GT(count, 8u);
  std::vector<std::vector<std::uint8_t>> pieces(count, std::vector<std::uint8_t>(kPiece));
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < count; ++i) threads.emplace_back([&, i] { source.read(pack, i * kPiece, pieces[i]); });
  for (std::thread& thread : threads) thread.join();
  for (std::size_t i = 0; i < count; ++i)
    EXPECT_TRUE(std::equal(pieces[i].begin(), pieces[i].end(),
                           reinterpret_cast<const std::uint8_t*>(bytes.data()) + i * kPiece));
  EXPECT_LT(source.counters().requests, count / 2);
  EXPECT_EQ(source.counters().requests + source.counters().merged, count);
}

TEST_F(HttpSourceTest, AFileReadPieceAfterPieceTakesFewRequests) {
  const test::TempFolder folder;
  fs::create_directories(folder / "r-0123456789abcdef");
  std::string content(3 << 20, 'x');
  for (std::size_t i = 0; i < content.size(); ++i) content[i] = static_cast<char>(i * 2654435761u >> 13);
  test::writeBytes(folder / "r-0123456789abcdef/x.bin", content);
  const HttpServer server(folder.path());
  const HttpSource source(server.url(), quick());
  source.expect("r-0123456789abcdef/x.bin", content.size());
  std::vector<std::uint8_t> bytes(1000);
  for (std::size_t at = 0; at + bytes.size() <= content.size(); at += bytes.size()) {
    source.read("r-0123456789abcdef/x.bin", at, bytes);
    ASSERT_TRUE(std::equal(bytes.begin(), bytes.end(), reinterpret_cast<const std::uint8_t*>(content.data()) + at))
        << at;
  }
  EXPECT_LT(source.counters().requests, 12u);
  EXPECT_LT(source.counters().bytes, content.size() + content.size() / 16);
}

TEST_F(HttpSourceTest, EightRequestsGoAtOnce) {
  server_.delay(0.2);
  const HttpSource source(server_ / "a.fil");
  const std::string pack = local_->revision() + "/tiles-00000.pack";
  const double took = secondsOf([&] {
    std::vector<std::thread> threads;
    for (std::uint64_t i = 0; i < 8; ++i)
      threads.emplace_back([&, i] {
        std::vector<std::uint8_t> bytes(100);
        source.read(pack, i * 6'000, bytes);
      });
    for (std::thread& thread : threads) thread.join();
  });
  EXPECT_LT(took, test::kSanitized ? 1.4 : 0.8) << "one after the other they take 1.6 s";
}

TEST_F(HttpSourceTest, AnInterruptionEndsAWaitingRead) {
  std::atomic<bool> cancel{false};
  const auto set = openRemote({.cancel = &cancel});
  server_.fault("silent", ".pack", 1, {{"s", 30}});
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    cancel = true;
  });
  EXPECT_LT(secondsOf([&] { EXPECT_THROW(set->load(0), Interrupted); }), 5);
  later.join();
}

TEST_F(HttpSourceTest, AReplacedSetKeepsItsRevisionOrSaysSo) {
  const test::TempFolder folder;
  const auto make = [&](std::uint64_t seed) {
    CellList stream(test::randomColumn(seed, 3, 300, 200));
    ingest(stream, folder / "b.fil", {.capacity = 50, .force = true});
  };
  make(1);
  const HttpServer server(folder.path());
  const auto old = TileSet::open(server / "b.fil");
  old->load(0);
  const std::string revision = old->revision();
  make(2);
  try {
    for (TileId t = 1; t < old->tile_count(); ++t) old->load(t);
    ADD_FAILURE() << "the old files are gone";
  } catch (const IoError& error) {
    EXPECT_NE(std::string(error.what()).find("open it again"), std::string::npos) << error.what();
  }
  const auto fresh = TileSet::open(server / "b.fil");
  EXPECT_NE(fresh->revision(), revision);
  test::expectSameTiles(*fresh, *TileSet::open(folder / "b.fil"));
}

TEST_F(HttpSourceTest, VerifyReadsAnAddress) {
  const VerifyReport report = verify(server_ / "a.fil", {.deep = true});
  EXPECT_TRUE(report.sound()) << report.problems.front();
  EXPECT_EQ(report.tiles, local_->tile_count());
  EXPECT_THROW(verify(server_ / "b.fil"), IoError);
}

TEST_F(HttpSourceTest, ManyThreadsReadThroughFaults) {
  for (int i = 0; i < 40; ++i) server_.fault(i % 2 == 0 ? "cut" : "reset", ".pack", 1);
  const auto set = openRemote();
  std::vector<std::thread> threads;
  std::atomic<TileId> next{0};
  for (int i = 0; i < 16; ++i)
    threads.emplace_back([&] {
      for (TileId t = 0; (t = next++) < set->tile_count();) test::expectSameTile(*set->load(t), *local_->load(t));
    });
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace filiform
