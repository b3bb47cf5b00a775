// The address of a tile set on an HTTP server or in an object store.
#pragma once

#include "index/remote/internal/s3_account.h"

#include <memory>
#include <string>
#include <string_view>

namespace filiform::internal {

// Thread rule: values.
struct RemoteAddress {
  // `http://HOST/v1/sets/NAME`, as filiform serves sets, `s3://BUCKET/PATH`, or the address of a set's folder on any
  // server. Throws UsageError if it is malformed, or contains a password, a query or a fragment; for s3:// what
  // readS3Account() throws.
  explicit RemoteAddress(const std::string& text);
  // `s3://BUCKET/PATH`. An account's own endpoint has the address ENDPOINT/BUCKET/PATH; AWS has
  // https://BUCKET.s3.REGION.amazonaws.com/PATH. PATH must consist of [A-Za-z0-9._-] and single slashes, which every
  // store and every signature takes as they are.
  RemoteAddress(const std::string& text, const S3Account& account);

  std::string set;     // without a slash at the end
  std::string files;   // begins the address of each file: `SET/files/` for a set of a service, else `SET/`
  std::string origin;  // scheme, host and port
  std::shared_ptr<const S3Account> account;  // for s3://, else nullptr
  std::string bucket;                        // for s3://: address of the bucket, without a slash at the end
};

bool isS3Address(std::string_view text);  // begins with s3://, in any letter case

}  // namespace filiform::internal
