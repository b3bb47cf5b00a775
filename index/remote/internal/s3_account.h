// S3Account: where S3-compatible storage is, and the keys for it, as the programs of AWS find them.
#pragma once

#include <functional>
#include <optional>
#include <string>

namespace filiform::internal {

// Thread rule: values.
struct S3Account {
  std::string endpoint{};                                   // such as http://127.0.0.1:9000; empty: AWS
  std::string region = "us-east-1";                         // part of each signature
  std::string access_key{}, secret_key{}, session_token{};  // empty: requests are not signed
  std::string authorities{};                                // file of certificates; empty: as for every address

  bool hasKeys() const { return !access_key.empty(); }
};

// The value of an environment variable; nullopt: not set.
using Environment = std::function<std::optional<std::string>(const char* name)>;
Environment processEnvironment();

// Looks for each value in the environment, then in the files of AWS, in the profile AWS_PROFILE or `default`:
//
//   endpoint   AWS_ENDPOINT_URL_S3, AWS_ENDPOINT_URL         endpoint_url
//   region     AWS_REGION, AWS_DEFAULT_REGION                region
//   keys       AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY,     aws_access_key_id, aws_secret_access_key,
//              AWS_SESSION_TOKEN                             aws_session_token
//   files      AWS_SHARED_CREDENTIALS_FILE, AWS_CONFIG_FILE  by default ~/.aws/credentials, ~/.aws/config
//
// The keys come from one place together. An empty variable counts as not set. Throws UsageError for half a pair of
// keys, an invalid value, a profile that neither file holds, or one that names another way to get keys; IoError if a
// file that a variable names cannot be read.
S3Account readS3Account(const Environment& environment = processEnvironment());

}  // namespace filiform::internal
