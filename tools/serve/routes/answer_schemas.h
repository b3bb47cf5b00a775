// The JSON Schemas of the answers, for the description of the interface. Functions without state.
#pragma once

#include <string_view>

#include <nlohmann/json.hpp>

namespace filiform::tools {

// All schemas by name, for `components/schemas`.
nlohmann::ordered_json answerSchemas();

// The name of the schema of a route's JSON answer; empty: any JSON. `path` is that of the table of routes.
std::string_view schemaOf(std::string_view path);

}  // namespace filiform::tools
