#include "index/remote/internal/s3_account.h"

#include "index/errors.h"
#include "index/remote/internal/url_origin.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string_view>

namespace filiform::internal {
namespace {

using Profile = std::map<std::string, std::string>;
constexpr std::size_t kMostFileBytes = std::size_t{1} << 20;

std::string trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return std::string(text);
}

// The profile of this name in an INI file; nullopt if there is no such file or profile. `prefix`: before the names of
// profiles other than `default`. Indented lines belong to tables inside a profile and are not read.
std::optional<Profile> readProfile(const std::string& path, bool must_exist, const std::string& name,
                                   const std::string& prefix) {
  std::ifstream in(path);
  if (!in) {
    if (must_exist) throw IoError(inShort(path), "cannot be opened; check AWS_CONFIG_FILE and the like", errno);
    return std::nullopt;
  }
  std::optional<Profile> profile;
  bool inside = false;
  std::size_t bytes = 0;
  for (std::string line; std::getline(in, line);) {
    if ((bytes += line.size()) > kMostFileBytes) throw UsageError(inShort(path) + ": has more than 1 MiB");
    if (line.empty() || line.front() == ' ' || line.front() == '\t' || line.front() == '#' || line.front() == ';')
      continue;
    if (line.front() == '[') {
      const std::string title = trimmed(line.substr(1, line.find(']') - 1));
      inside = title == name || (!prefix.empty() && title == prefix + name);
      if (inside && !profile) profile.emplace();
      continue;
    }
    const std::size_t equals = line.find('=');
    if (inside && equals != std::string::npos)
      (*profile)[trimmed(std::string_view(line).substr(0, equals))] =
          trimmed(std::string_view(line).substr(equals + 1));
  }
  return profile;
}

std::string valueIn(const std::optional<Profile>& profile, const char* name) {
  if (!profile) return {};
  const auto found = profile->find(name);
  return found != profile->end() ? found->second : "";
}

void requirePrintable(const char* what, const std::string& value) {
  if (!std::all_of(value.begin(), value.end(), [](char c) { return c > ' ' && c < '\x7f'; }))
    throw UsageError(std::string(what) + " contains a blank or a character that is not ASCII");
}

}  // namespace

Environment processEnvironment() {
  return [](const char* name) -> std::optional<std::string> {
    const char* const value = std::getenv(name);
    return value != nullptr ? std::optional<std::string>(value) : std::nullopt;
  };
}

S3Account readS3Account(const Environment& environment) {
  const auto variable = [&](std::initializer_list<const char*> names) -> std::string {
    for (const char* const name : names)
      if (const auto value = environment(name); value && !value->empty()) return *value;
    return {};
  };
  const std::string stated_profile = variable({"AWS_PROFILE", "AWS_DEFAULT_PROFILE"});
  const std::string name = stated_profile.empty() ? "default" : stated_profile;
  const std::string home = variable({"HOME"});
  const auto profileIn = [&](const char* file_variable, const char* file,
                             const char* prefix) -> std::optional<Profile> {
    const std::string stated = variable({file_variable});
    if (stated.empty() && home.empty()) return std::nullopt;
    return readProfile(stated.empty() ? home + "/.aws/" + file : stated, !stated.empty(), name, prefix);
  };
  const std::optional<Profile> credentials = profileIn("AWS_SHARED_CREDENTIALS_FILE", "credentials", "");
  const std::optional<Profile> config = profileIn("AWS_CONFIG_FILE", "config", "profile ");

  S3Account account;
  account.access_key = variable({"AWS_ACCESS_KEY_ID"});
  account.secret_key = variable({"AWS_SECRET_ACCESS_KEY"});
  if (account.access_key.empty() != account.secret_key.empty())
    throw UsageError("AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY go together; set both or none");
  if (account.hasKeys()) {
    account.session_token = variable({"AWS_SESSION_TOKEN"});
  } else {
    if (!stated_profile.empty() && !credentials && !config)
      throw UsageError("AWS_PROFILE " + inShort(name) +
                       ": neither ~/.aws/credentials nor ~/.aws/config holds this profile; correct the name");
    for (const std::optional<Profile>* const from : {&credentials, &config}) {
      account.access_key = valueIn(*from, "aws_access_key_id");
      account.secret_key = valueIn(*from, "aws_secret_access_key");
      account.session_token = valueIn(*from, "aws_session_token");
      if (account.access_key.empty() != account.secret_key.empty())
        throw UsageError("AWS profile " + inShort(name) +
                         ": aws_access_key_id and aws_secret_access_key go together; give both or none");
      if (account.hasKeys()) break;
    }
    for (const char* const other : {"role_arn", "sso_session", "sso_start_url", "credential_process"})
      if (!account.hasKeys() && (!valueIn(config, other).empty() || !valueIn(credentials, other).empty()))
        throw UsageError("AWS profile " + inShort(name) + ": filiform cannot get keys by " + other +
                         "; set the variables that `aws configure export-credentials --format env` prints");
  }
  account.endpoint = variable({"AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL"});
  if (account.endpoint.empty()) account.endpoint = valueIn(config, "endpoint_url");
  if (!account.endpoint.empty() && originOf(account.endpoint).empty())
    throw UsageError("AWS_ENDPOINT_URL " + inShort(account.endpoint) +
                     ": is not a valid address; give http://HOST:PORT or https://HOST");
  while (account.endpoint.ends_with('/')) account.endpoint.pop_back();
  std::string region = variable({"AWS_REGION", "AWS_DEFAULT_REGION"});
  if (region.empty()) region = valueIn(config, "region");
  if (!region.empty()) account.region = region;
  if (account.region.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-") !=
      std::string::npos)
    throw UsageError("AWS_REGION " + inShort(account.region) + ": is not the name of a region, such as eu-west-1");
  account.authorities = variable({"AWS_CA_BUNDLE"});
  requirePrintable("AWS_ACCESS_KEY_ID", account.access_key);
  requirePrintable("AWS_SECRET_ACCESS_KEY", account.secret_key);
  requirePrintable("AWS_SESSION_TOKEN", account.session_token);
  return account;
}

}  // namespace filiform::internal
