// The description of the interface, made from the table of routes.
#include "index/text.h"
#include "tools/serve/routes/answer_schemas.h"
#include "tools/serve/routes/routes.h"
#include "tools/serve/sets/limits.h"

#include <cctype>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace filiform::tools {

namespace {

using Json = nlohmann::ordered_json;

// What a generated client calls the operation: getSetNearest for GET /v1/sets/{set}/nearest. The method, and the parts
// of the path; a part before a placeholder of its name stands for both.
std::string operationId(const Route& route) {
  std::string id = lowerCase(route.method), word;
  std::vector<std::string> words;
  for (const char c : std::string_view(route.path).substr(1)) {
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '{')
      word += c;
    else if (!word.empty())
      words.push_back(std::exchange(word, ""));
  }
  if (!word.empty()) words.push_back(word);
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "v1" || (i + 1 < words.size() && words[i + 1] + 's' == '{' + words[i])) continue;
    const std::size_t begin = words[i].front() == '{';
    id += static_cast<char>(std::toupper(static_cast<unsigned char>(words[i][begin])));
    id += words[i].substr(begin + 1);
  }
  return id == "get" ? "getPage" : id;
}

const char* topicOf(std::string_view path) {
  if (path.starts_with("/precomputed")) return "neuroglancer";
  if (path.starts_with("/catmaid")) return "catmaid";
  if (path.starts_with("/v1/sets")) return path.find("/files") == std::string_view::npos ? "sets" : "files";
  if (path.starts_with("/v1/session") || path.starts_with("/travel") || path.find("/desks") != std::string_view::npos)
    return "travel";
  return "server";
}

Json parametersOf(const Route& route) {
  Json parameters = Json::array();
  const std::string path = route.path;
  for (std::size_t at = path.find('{'); at != std::string::npos; at = path.find('{', at + 1))
    parameters.push_back({{"name", path.substr(at + 1, path.find('}', at) - at - 1)},
                          {"in", "path"},
                          {"required", true},
                          {"schema", {{"type", "string"}}}});
  for (const RouteParameter& parameter : route.parameters)
    parameters.push_back({{"name", parameter.name},
                          {"in", "query"},
                          {"required", parameter.required},
                          {"description", parameter.meaning},
                          {"schema", {{"type", parameter.kind}}}});
  return parameters;
}

Json bodyOfPoints() {
  const Json point{{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 3}, {"maxItems", 3}};
  const Json points{{"type", "array"}, {"items", point}, {"maxItems", limits::kPoints}};
  const Json object{{"type", "object"},
                    {"required", {"points"}},
                    {"additionalProperties", false},
                    {"properties",
                     {{"points", points},
                      {"k", {{"type", "integer"}}},
                      {"epsilon", {{"type", "number"}}},
                      {"radius", {{"type", "number"}}}}}};
  return {{"required", true},
          {"content",
           {{kJsonType, {{"schema", object}}}, {kNpyType, {{"schema", {{"type", "string"}, {"format", "binary"}}}}}}}};
}

Json operationOf(const Route& route) {
  const std::string_view path(route.path);
  const Json bytes{{"schema", {{"type", "string"}, {"format", "binary"}}}};
  Json content{{route.type, Json::object()}};
  if (const std::string_view schema = schemaOf(path); !schema.empty())
    content[route.type] = {{"schema", {{"$ref", "#/components/schemas/" + std::string(schema)}}}};
  else if (std::string_view(route.type) != kJsonType)
    content[route.type] = {{"schema", {{"type", "string"}}}};
  if (path.ends_with("/nearest") || path.ends_with("/box") || path.ends_with("/ray")) content[kNpyType] = bytes;
  if (path.ends_with("/{cell}")) {
    content["text/plain"] = {{"schema", {{"type", "string"}}}};
    content[kNpyType] = bytes;
  }
  if (path.find("/{revision}/{file}") != std::string_view::npos) content[kJsonType] = Json::object();  // the manifest
  const Json problems{
      {"description", "a problem"},
      {"content", {{"application/problem+json", {{"schema", {{"$ref", "#/components/schemas/Problem"}}}}}}}};
  Json operation{{"operationId", operationId(route)},
                 {"tags", {topicOf(path)}},
                 {"summary", route.summary},
                 {"description", std::string(route.summary) + '.'},
                 {"parameters", parametersOf(route)}};
  if (std::string_view(route.method) == "POST") operation["requestBody"] = bodyOfPoints();
  operation["responses"] = {{"200", {{"description", route.summary}, {"content", content}}}, {"default", problems}};
  if (path.ends_with("/session") || path.find("/desks/") != std::string_view::npos)
    operation["responses"] = {{"101", {{"description", "a WebSocket"}}}, {"default", problems}};
  if (path.find("{set}") != std::string_view::npos && std::string_view(route.method) == "GET" &&
      operation["responses"].contains("200"))
    operation["responses"]["304"] = {{"description", "If-None-Match names the ETag of the answer"}};
  if (path.ends_with("{file}"))
    operation["responses"]["206"] = {{"description", "the part that Range asks for"}, {"content", content}};
  operation["security"] = route.scope == Scope::open
                              ? Json::array({Json::object()})
                              : Json::array({Json::object(), {{"token", Json::array({toString(route.scope)})}}});
  return operation;
}

}  // namespace

Answer openapiAnswer(const Call& call) {
  Json paths = Json::object();
  for (const Route& route : allRoutes()) paths[route.path][lowerCase(route.method)] = operationOf(route);
  return jsonAnswer(
      {{"openapi", "3.1.0"},
       {"info",
        {{"title", "filiform"},
         {"version", call.service.version},
         {"description",
          "Tile sets of neuron reconstructions. Positions are in um. Errors are RFC 9457 problems. "
          "If the server needs a token, the addresses under /precomputed and /catmaid also answer as "
          "/precomputed/~CAPABILITY/... and /catmaid/~CAPABILITY/..., without the token."},
         {"license", {{"name", "GPL-3.0-or-later"}, {"identifier", "GPL-3.0-or-later"}}}}},
       {"servers", {{{"url", "/"}}}},
       {"tags",
        {{{"name", "sets"}, {"description", "Questions about sets and their cells."}},
         {{"name", "files"}, {"description", "The files of a set, for programs that read it themselves."}},
         {{"name", "travel"}, {"description", "Sessions, the page for travel and its desks."}},
         {{"name", "neuroglancer"}, {"description", "Skeletons and their properties, as Neuroglancer reads them."}},
         {{"name", "catmaid"}, {"description", "What clients of CATMAID read."}},
         {{"name", "server"}, {"description", "Pages, state and measurements of the server."}}}},
       {"paths", paths},
       {"components",
        {{"schemas", answerSchemas()}, {"securitySchemes", {{"token", {{"type", "http"}, {"scheme", "bearer"}}}}}}}});
}

}  // namespace filiform::tools
