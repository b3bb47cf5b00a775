// Answer: what a route gives back. The server adds the headers that concern the connection. Thread rule: a value.
#pragma once

#include "tools/words/refusal.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform {
class TileSet;
}

namespace filiform::tools {

// A part of a file of a set, read while it is sent.
struct FileRange {
  std::shared_ptr<const TileSet> set;
  std::string file;
  std::uint64_t first = 0, bytes = 0;
};

struct Answer {
  unsigned status = 200;
  std::string type = {};                                          // media type; empty: no content
  std::string body = {};                                          // empty if `file` is set
  std::optional<FileRange> file = {};                             // the content instead of `body`
  std::vector<std::pair<std::string, std::string>> headers = {};  // values without line ends

  std::uint64_t contentBytes() const { return file ? file->bytes : body.size(); }
  // The value of a header; empty if it is absent. For tests and logs.
  std::string header(const std::string& name) const;
};

inline constexpr const char* kJsonType = "application/json";
inline constexpr const char* kBytesType = "application/octet-stream";
inline constexpr const char* kNpyType = "application/x-npy";

// ASCII, in one line; bytes that are not UTF-8 are replaced.
std::string jsonText(const nlohmann::ordered_json& json);
Answer jsonAnswer(const nlohmann::ordered_json& json);
// application/problem+json: type, title, status, detail. 429 and 503 get a Retry-After of one second.
Answer problem(unsigned status, const std::string& detail);
// "Not Found" and so on; "Error" for a status that the service does not use.
const char* reasonPhrase(unsigned status);

}  // namespace filiform::tools
