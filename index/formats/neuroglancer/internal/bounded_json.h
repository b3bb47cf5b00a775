// Parses JSON of strangers. Thread rule: a pure function.
#pragma once

#include <algorithm>
#include <string_view>

#include <nlohmann/json.hpp>

namespace filiform::internal {

// The parsed text; discarded if it is no JSON, or nests deeper than 64 levels: the tree is destroyed by recursion.
// O(length).
inline nlohmann::json boundedJson(std::string_view text) {
  int depth = 0, deepest = 0;
  bool in_text = false, behind_backslash = false;
  for (const char c : text) {
    if (c == '"' && !behind_backslash) in_text = !in_text;
    behind_backslash = in_text && c == '\\' && !behind_backslash;
    if (in_text) continue;
    depth += c == '[' || c == '{';
    depth -= c == ']' || c == '}';
    deepest = std::max(deepest, depth);
  }
  using Json = nlohmann::json;
  return deepest > 64 ? Json(Json::value_t::discarded) : Json::parse(text, nullptr, false);
}

}  // namespace filiform::internal
