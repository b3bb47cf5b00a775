// ParsedUrl: the parts of a URL, by libcurl. Thread rule: thread-compatible.
#pragma once

#include <curl/curl.h>
#include <memory>
#include <optional>
#include <string>

namespace filiform::internal {

class ParsedUrl {
 public:
  explicit ParsedUrl(const std::string& text) : url_(curl_url(), curl_url_cleanup) {
    valid_ = url_ != nullptr && curl_url_set(url_.get(), CURLUPART_URL, text.c_str(), 0) == CURLUE_OK;
  }
  bool valid() const { return valid_; }
  std::optional<std::string> part(CURLUPart which, unsigned flags = 0) const {
    char* text = nullptr;
    if (curl_url_get(url_.get(), which, &text, flags) != CURLUE_OK) return std::nullopt;
    std::string copy = text;
    curl_free(text);
    return copy;
  }

 private:
  std::unique_ptr<CURLU, void (*)(CURLU*)> url_;
  bool valid_ = false;
};

}  // namespace filiform::internal
