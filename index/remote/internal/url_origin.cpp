#include "index/remote/internal/url_origin.h"

#include "index/remote/internal/parsed_url.h"
#include "index/text.h"

#include <optional>

namespace filiform::internal {

std::string originOf(const std::string& text) {
  const ParsedUrl url(text);
  if (!url.valid()) return {};
  const std::string scheme = lowerCase(url.part(CURLUPART_SCHEME).value_or(""));
  const auto host = url.part(CURLUPART_HOST), port = url.part(CURLUPART_PORT, CURLU_DEFAULT_PORT);
  if ((scheme != "http" && scheme != "https") || !host || !port) return {};
  const bool usual = *port == (scheme == "http" ? "80" : "443");
  return scheme + "://" + lowerCase(*host) + (usual ? "" : ":" + *port);
}

}  // namespace filiform::internal
