// A set at an address with a cache on disk.
#include "tests/index/remote/http_source_fixture.h"
#include "tests/support/scenes/tile_invariants.h"

#include <filesystem>

namespace filiform {
namespace {

namespace fs = std::filesystem;

class HttpCacheTest : public test::HttpSourceTest {
 protected:
  std::unique_ptr<TileSet> openWithCache() const {
    RemoteOptions options = quick();
    options.cache_folder = cache_.path();
    return openRemote(options);
  }
  const test::TempFolder cache_;
};

TEST_F(HttpCacheTest, ACacheSparesRequestsAndHealsItself) {
  server_.fault("flip", ".pack", 1);
  test::expectSameTiles(*openWithCache(), *local_);
  server_.log();
  test::expectSameTiles(*openWithCache(), *local_);
  const auto requests = server_.log();
  ASSERT_EQ(requests.size(), 1u) << "only CURRENT";
  EXPECT_NE(requests[0].dump().find("CURRENT"), std::string::npos) << requests[0].dump();

  // Damage every file of the cache, each in another place.
  int at = 0;
  for (const auto& entry : fs::recursive_directory_iterator(cache_.path())) {
    if (!entry.is_regular_file() || entry.file_size() == 0) continue;
    std::string bytes = test::readBytes(entry.path().string());
    bytes[static_cast<std::size_t>(at += 37) % bytes.size()] ^= 1;
    test::writeBytes(entry.path().string(), bytes);
  }
  test::expectSameTiles(*openWithCache(), *local_);
  server_.log();
  test::expectSameTiles(*openWithCache(), *local_);
  EXPECT_EQ(server_.log().size(), 1u);
}

TEST_F(HttpCacheTest, ADamagedManifestIsNotKept) {
  server_.fault("flip", "manifest", 1);
  test::expectSameTiles(*openWithCache(), *local_);
  server_.fault("flip", "manifest", 2);
  server_.log();
  EXPECT_NO_THROW(openWithCache()) << "from the cache";
  EXPECT_EQ(server_.log().size(), 1u);
  fs::remove_all(cache_.path());
  EXPECT_THROW(openWithCache(), CorruptSet) << "damaged twice";
}

}  // namespace
}  // namespace filiform
