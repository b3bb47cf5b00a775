#include "index/remote/internal/remote_address.h"

#include "index/errors.h"
#include "index/remote/internal/parsed_url.h"
#include "index/remote/internal/url_origin.h"
#include "index/text.h"

#include <algorithm>
#include <curl/curl.h>
#include <memory>
#include <optional>

namespace filiform::internal {
namespace {

// True for a path that ends in /v1/sets/NAME. A static server's folder has the ending .fil.
bool isServicePath(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  constexpr std::string_view kSets = "/v1/sets";
  return slash != std::string::npos && slash + 1 < path.size() && path.substr(0, slash).ends_with(kSets) &&
         !path.ends_with(".fil");
}

bool consistsOf(std::string_view text, std::string_view more) {
  return std::all_of(text.begin(), text.end(), [&](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           more.find(c) != std::string_view::npos;
  });
}

}  // namespace

bool isS3Address(std::string_view text) { return endsWithNoCase(text.substr(0, 5), "s3://"); }

RemoteAddress::RemoteAddress(const std::string& text, const S3Account& keys) {
  std::string path = text.substr(5);
  while (path.ends_with('/')) path.pop_back();
  const std::size_t slash = path.find('/');
  if (path.find('@') != std::string::npos)
    throw UsageError("an address must not contain keys; set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY");
  if (!isS3Address(text) || slash == std::string::npos)
    throw UsageError(inShort(text) + ": is not a valid address; give s3://BUCKET/PATH");
  const std::string name = path.substr(0, slash), inside = path.substr(slash);
  if (name.size() < 3 || name.size() > 63 || !consistsOf(name, ".-_"))
    throw UsageError(inShort(text) + ": " + inShort(name) + " is not the name of a bucket");
  if (!consistsOf(inside, "/._-") || inside.find("//") != std::string::npos || inside.find("/.") != std::string::npos)
    throw UsageError(inShort(text) + ": the path must consist of letters, digits, and . _ - between single slashes");
  const std::string aws = ".s3." + keys.region + ".amazonaws.com";
  if (!keys.endpoint.empty())
    bucket = keys.endpoint + "/" + name;
  else if (name.find('.') != std::string::npos)  // no certificate covers such a host
    bucket = "https://" + aws.substr(1) + "/" + name;
  else
    bucket = "https://" + lowerCase(name) + aws;
  set = bucket + inside;
  files = set + "/";
  origin = originOf(set);
  account = std::make_shared<const S3Account>(keys);
}

RemoteAddress::RemoteAddress(const std::string& text) {
  if (isS3Address(text)) {
    *this = RemoteAddress(text, readS3Account());
    return;
  }
  const ParsedUrl url(text);
  origin = originOf(text);
  if (!url.valid() || origin.empty())
    throw UsageError(inShort(text) +
                     ": is not a valid address; give http://HOST/PATH, https://HOST/PATH or s3://BUCKET/PATH");
  if (url.part(CURLUPART_USER) || url.part(CURLUPART_PASSWORD))
    throw UsageError("an address must not contain a name or password; use --token-file");
  if (url.part(CURLUPART_QUERY) || url.part(CURLUPART_FRAGMENT))
    throw UsageError("an address must not contain '?' or '#'; use --token-file for a token");
  std::string path = url.part(CURLUPART_PATH).value_or("/");
  while (path.ends_with('/')) path.pop_back();
  set = origin + path;
  files = set + (isServicePath(path) ? "/files/" : "/");
}

}  // namespace filiform::internal
