#include "index/http/internal/remote_address.h"

#include "index/errors.h"
#include "index/set/http_source.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

using internal::originOf;
using internal::RemoteAddress;

TEST(RemoteAddress, FilesOfAServiceAndOfAFolder) {
  const auto files = [](const std::string& text) { return RemoteAddress(text).files; };
  EXPECT_EQ(files("http://host:7878/v1/sets/column"), "http://host:7878/v1/sets/column/files/");
  EXPECT_EQ(files("http://host:7878/v1/sets/column/"), "http://host:7878/v1/sets/column/files/");
  EXPECT_EQ(files("https://host/lab/v1/sets/column"), "https://host/lab/v1/sets/column/files/");
  EXPECT_EQ(files("https://host/path/column.fil"), "https://host/path/column.fil/");
  EXPECT_EQ(files("https://host/v1/sets/column.fil"), "https://host/v1/sets/column.fil/");
  EXPECT_EQ(files("https://host/v1/sets"), "https://host/v1/sets/");
  EXPECT_EQ(files("https://host"), "https://host/");
  EXPECT_EQ(files("HTTP://HOST:80/a.fil//"), "http://host/a.fil/");
}

TEST(RemoteAddress, OriginIsSchemeHostAndPort) {
  EXPECT_EQ(originOf("https://Host/a"), "https://host");
  EXPECT_EQ(originOf("https://host:443/b"), "https://host");
  EXPECT_EQ(originOf("https://host:444/b"), "https://host:444");
  EXPECT_EQ(originOf("http://[::1]:8080/b"), "http://[::1]:8080");
  EXPECT_EQ(originOf("ftp://host/a"), "");
  EXPECT_EQ(originOf("host"), "");
}

TEST(RemoteAddress, RefusesWhatIsNoAddressAndSecretsInIt) {
  for (const char* bad :
       {"http://", "http://user@host/a.fil", "http://user:s3cret@host/a.fil", "http://host/a.fil?token=x",
        "http://host/a.fil#b", "http://host:99999/a.fil", "http://ho st/a.fil"}) {
    try {
      RemoteAddress address(bad);
      ADD_FAILURE() << bad << " gives " << address.files;
    } catch (const UsageError& error) {
      EXPECT_EQ(std::string(error.what()).find("s3cret"), std::string::npos) << "a password in a message";
    }
  }
}

TEST(RemoteAddress, IsToldFromAFolder) {
  EXPECT_TRUE(isAddress("http://host/a.fil"));
  EXPECT_TRUE(isAddress("HTTPS://host/a.fil"));
  for (const char* folder : {"", "http", "http:/a.fil", "a/http://b", "./http://a"}) EXPECT_FALSE(isAddress(folder));
}

}  // namespace
}  // namespace filiform
