// Without libcurl: a page has a URL that the browser has parsed. Stands in for remote_address.cpp in the preset `web`.
#include "index/remote/internal/remote_address.h"

#include "index/errors.h"
#include "index/remote/internal/url_origin.h"
#include "index/text.h"

namespace filiform::internal {

RemoteAddress::RemoteAddress(const std::string& text) {
  origin = originOf(text);
  if (origin.empty() || text.find_first_of("?#@") != std::string::npos)
    throw UsageError(inShort(text) + ": is not a valid address; give http://HOST/PATH or https://HOST/PATH");
  set = text;
  while (set.ends_with('/')) set.pop_back();
  files = set + "/files/";
}

bool isS3Address(std::string_view) { return false; }

std::string originOf(const std::string& text) {
  const std::size_t host = text.starts_with("http://") ? 7 : text.starts_with("https://") ? 8 : 0;
  if (host == 0 || host == text.size() || text[host] == '/') return {};
  return text.substr(0, text.find('/', host));
}

}  // namespace filiform::internal
