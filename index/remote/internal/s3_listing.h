// What an object store holds below an address, and the XML of its lists.
#pragma once

#include "index/remote/internal/http_client.h"
#include "index/remote/internal/remote_address.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::internal {

// Thread rule: values.
struct S3Object {
  std::string name{};          // relative to the address: what follows RemoteAddress::files
  std::uint64_t bytes = 0;     // of an object
  std::int64_t written_s = 0;  // when it was written, or the upload began; since 1970, by the store's clock
  std::string upload{};        // number of an upload in parts that has not ended; empty: an object
  std::string url{};           // to ask for it, or to end the upload
};

// The objects, and the uploads in parts that have not ended, whose name begins with `name`. A page of 1000 takes a
// request. Throws IoError, DeniedByServer if the keys may not list, and IoError for a list that no store sends.
std::vector<S3Object> listObjects(HttpClient& client, const RemoteAddress& address, const std::string& name);
std::vector<S3Object> listUploads(HttpClient& client, const RemoteAddress& address, const std::string& name);

// The address of a list, and its text. Thread rule: pure functions, but for the request.
std::string readList(HttpClient& client, const std::string& url);
std::string queryText(std::string_view text);       // as signatures require it in a query
std::uint64_t numberOrZero(std::string_view text);  // 0: not a number
std::int64_t timeOrZero(const std::string& text);   // of 2026-11-30T12:00:00.000Z, since 1970; 0: not a time
std::string unquoted(std::string_view tag);         // some stores write quotation marks as entities

// Calls use(content) for each element `<name>`.
template <typename Use>
void forEachElement(std::string_view xml, const std::string& name, Use use) {
  const std::string open = "<" + name + ">", close = "</" + name + ">";
  for (std::size_t at = xml.find(open); at != std::string_view::npos; at = xml.find(open, at)) {
    const std::size_t from = at + open.size(), end = xml.find(close, from);
    if (end == std::string_view::npos) return;
    use(xml.substr(from, end - from));
    at = end;
  }
}

}  // namespace filiform::internal
