#include "index/remote/internal/remote_address.h"

#include "index/errors.h"
#include "index/remote/http_source.h"
#include "index/remote/internal/url_origin.h"

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

TEST(RemoteAddress, AnObjectStoreIsAtItsEndpointOrAtAws) {
  const auto files = [](const std::string& text, const std::string& endpoint) {
    internal::S3Account account{.endpoint = endpoint};
    account.region = "eu-west-1";
    return RemoteAddress(text, account).files;
  };
  EXPECT_EQ(files("s3://sets/lab/a.fil", "http://127.0.0.1:9000"), "http://127.0.0.1:9000/sets/lab/a.fil/");
  EXPECT_EQ(files("S3://sets/a.fil//", "https://store/s3"), "https://store/s3/sets/a.fil/");
  EXPECT_EQ(files("s3://sets/a.fil", ""), "https://sets.s3.eu-west-1.amazonaws.com/a.fil/");
  EXPECT_EQ(files("s3://my.sets/a.fil", ""), "https://s3.eu-west-1.amazonaws.com/my.sets/a.fil/");
  EXPECT_EQ(RemoteAddress("s3://sets/a.fil", {}).origin, "https://sets.s3.us-east-1.amazonaws.com");
  for (const char* bad : {"s3://", "s3://sets", "s3://sets/", "s3://ab/a.fil", "s3://sets/a b", "s3://sets/a=b.fil",
                          "s3://sets/a//b", "s3://sets/../b", "s3://user:s3cret@host/a.fil"})
    try {
      const RemoteAddress address(bad, {});
      ADD_FAILURE() << bad << " gives " << address.files;
    } catch (const UsageError& error) {
      EXPECT_EQ(std::string(error.what()).find("s3cret"), std::string::npos) << "a secret in a message";
    }
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
  EXPECT_TRUE(isAddress("s3://bucket/a.fil"));
  for (const char* folder : {"", "http", "http:/a.fil", "a/http://b", "./http://a", "s3", "s3:/a"})
    EXPECT_FALSE(isAddress(folder));
}

}  // namespace
}  // namespace filiform
