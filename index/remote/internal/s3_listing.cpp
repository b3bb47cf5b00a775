#include "index/remote/internal/s3_listing.h"

#include "index/errors.h"
#include "index/remote/internal/s3_answer.h"
#include "index/text.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <ctime>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kMostListing = 4 << 20;
constexpr int kMostListPages = 10'000;

// All pages of a list: `parameters` of the first one, and those of the page after it, empty for none, by next(page).
template <typename Use, typename Next>
void forEachPage(HttpClient& client, const RemoteAddress& address, std::string parameters, Use use, Next next) {
  for (int page = 0; !parameters.empty(); ++page) {
    if (page == kMostListPages)
      throw IoError(inShort(address.set), "the store's list does not end; check the endpoint");
    const std::string text = readList(client, address.bucket + "?" + parameters);
    use(text);
    parameters = xmlText(text, "IsTruncated") == "true" ? next(text) : "";
  }
}

// The name of a key relative to the address; empty: it lies elsewhere.
std::string nameBelow(const std::string& key, const RemoteAddress& address) {
  const std::string folder = address.files.substr(address.bucket.size() + 1);
  return key.starts_with(folder) ? key.substr(folder.size()) : "";
}

std::string prefixParameter(const RemoteAddress& address, const std::string& name) {
  return "prefix=" + queryText((address.files + name).substr(address.bucket.size() + 1));
}

}  // namespace

std::string readList(HttpClient& client, const std::string& url) {
  const Bytes text = client.readWhole(url, kMostListing);
  return {text.begin(), text.end()};
}

std::string queryText(std::string_view text) {
  constexpr std::string_view kPlain = "-._~", kHex = "0123456789ABCDEF";
  std::string encoded;
  for (const char c : text) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       kPlain.find(c) != std::string_view::npos;
    if (plain) {
      encoded += c;
      continue;
    }
    const auto byte = static_cast<unsigned char>(c);
    encoded += '%';
    encoded += kHex[byte >> 4];
    encoded += kHex[byte & 15];
  }
  return encoded;
}

std::uint64_t numberOrZero(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? number : 0;
}

std::int64_t timeOrZero(const std::string& text) {
  std::tm time{};
  if (std::sscanf(text.c_str(), "%4d-%2d-%2dT%2d:%2d:%2d", &time.tm_year, &time.tm_mon, &time.tm_mday, &time.tm_hour,
                  &time.tm_min, &time.tm_sec) != 6)
    return 0;
  time.tm_year -= 1900;
  time.tm_mon -= 1;
  return std::max<std::int64_t>(::timegm(&time), 0);
}

std::string unquoted(std::string_view tag) {
  std::string plain;
  for (std::size_t i = 0; i < tag.size(); ++i) {
    if (tag.compare(i, 6, "&quot;") == 0)
      i += 5;
    else if (tag[i] != '"')
      plain += tag[i];
  }
  return plain;
}

std::vector<S3Object> listObjects(HttpClient& client, const RemoteAddress& address, const std::string& name) {
  std::vector<S3Object> objects;
  const std::string rest =
      "list-type=2&max-keys=1000&" + prefixParameter(address, name);  // in the order of a signature
  forEachPage(
      client, address, rest,
      [&](const std::string& page) {
        forEachElement(page, "Contents", [&](std::string_view one) {
          S3Object object{.name = nameBelow(xmlText(one, "Key"), address),
                          .bytes = numberOrZero(xmlText(one, "Size")),
                          .written_s = timeOrZero(xmlText(one, "LastModified"))};
          object.url = address.files + object.name;
          if (!object.name.empty()) objects.push_back(std::move(object));
        });
      },
      [&](const std::string& page) {
        const std::string token = xmlText(page, "NextContinuationToken");
        return token.empty() ? "" : "continuation-token=" + queryText(token) + "&" + rest;
      });
  return objects;
}

std::vector<S3Object> listUploads(HttpClient& client, const RemoteAddress& address, const std::string& name) {
  std::vector<S3Object> uploads;
  const std::string prefix = prefixParameter(address, name);
  forEachPage(
      client, address, prefix + "&uploads=",
      [&](const std::string& page) {
        forEachElement(page, "Upload", [&](std::string_view one) {
          S3Object upload{.name = nameBelow(xmlText(one, "Key"), address),
                          .written_s = timeOrZero(xmlText(one, "Initiated")),
                          .upload = xmlText(one, "UploadId")};
          upload.url = address.files + upload.name + "?uploadId=" + queryText(upload.upload);
          if (!upload.name.empty() && !upload.upload.empty()) uploads.push_back(std::move(upload));
        });
      },
      [&](const std::string& page) {
        const std::string key = xmlText(page, "NextKeyMarker");
        return key.empty() ? ""
                           : "key-marker=" + queryText(key) + "&" + prefix +
                                 "&upload-id-marker=" + queryText(xmlText(page, "NextUploadIdMarker")) + "&uploads=";
      });
  return uploads;
}

}  // namespace filiform::internal
