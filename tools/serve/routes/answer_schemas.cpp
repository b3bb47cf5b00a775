#include "tools/serve/routes/answer_schemas.h"

#include <array>
#include <utility>

namespace filiform::tools {

namespace {

// Fields may be added to answers, so that no object is closed.
constexpr const char* kSchemas = R"json({
"Problem": {"type": "object", "required": ["type", "title", "status", "detail"],
  "properties": {"type": {"type": "string"}, "title": {"type": "string"}, "status": {"type": "integer"},
                 "detail": {"type": "string"}}},
"Count": {"type": "integer", "minimum": 0},
"Point": {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
"Box": {"anyOf": [{"type": "null"},
  {"type": "array", "items": {"$ref": "#/components/schemas/Point"}, "minItems": 2, "maxItems": 2}]},
"Sets": {"type": "object", "required": ["truncated", "sets"],
  "properties": {"truncated": {"type": "boolean"}, "sets": {"type": "array", "items": {
    "type": "object", "required": ["name", "revision", "cells", "segments", "bytes"],
    "properties": {"name": {"type": "string"}, "revision": {"type": "string"},
      "cells": {"$ref": "#/components/schemas/Count"}, "segments": {"$ref": "#/components/schemas/Count"},
      "bytes": {"$ref": "#/components/schemas/Count"}}}}}},
"Set": {"type": "object",
  "required": ["cells", "samples", "segments", "isolated", "roots", "tiles", "stored_segments", "bytes",
    "decoded_bytes", "quantum_um", "capacity", "refused", "level_tiles", "level_bytes", "revision", "box_um", "ghosts",
    "level_segments", "coarsest_level", "smallest_budget_bytes", "refused_inputs"],
  "properties": {"cells": {"$ref": "#/components/schemas/Count"}, "samples": {"$ref": "#/components/schemas/Count"},
    "segments": {"$ref": "#/components/schemas/Count"}, "isolated": {"$ref": "#/components/schemas/Count"},
    "roots": {"$ref": "#/components/schemas/Count"}, "tiles": {"$ref": "#/components/schemas/Count"},
    "stored_segments": {"$ref": "#/components/schemas/Count"}, "bytes": {"$ref": "#/components/schemas/Count"},
    "decoded_bytes": {"$ref": "#/components/schemas/Count"}, "quantum_um": {"type": "number", "exclusiveMinimum": 0},
    "capacity": {"$ref": "#/components/schemas/Count"}, "refused": {"$ref": "#/components/schemas/Count"},
    "level_tiles": {"$ref": "#/components/schemas/Count"}, "level_bytes": {"$ref": "#/components/schemas/Count"},
    "revision": {"type": "string"}, "box_um": {"$ref": "#/components/schemas/Box"},
    "ghosts": {"$ref": "#/components/schemas/Count"}, "level_segments": {"$ref": "#/components/schemas/Count"},
    "coarsest_level": {"anyOf": [{"type": "null"}, {"type": "object",
      "required": ["segments", "error_um", "hidden", "of"],
      "properties": {"segments": {"$ref": "#/components/schemas/Count"}, "error_um": {"type": "number"},
        "hidden": {"$ref": "#/components/schemas/Count"}, "of": {"$ref": "#/components/schemas/Count"}}}]},
    "smallest_budget_bytes": {"$ref": "#/components/schemas/Count"},
    "refused_inputs": {"type": "array", "items": {"type": "object", "required": ["name", "reason"],
      "properties": {"name": {"type": "string"}, "reason": {"type": "string"}}}}}},
"Rows": {"type": "object", "required": ["truncated", "rows"],
  "properties": {"truncated": {"type": "boolean"}, "rows": {"type": "array", "items": {"type": "object",
    "required": ["query", "rank", "distance", "x", "y", "z", "cell", "segment", "sample", "exact"],
    "properties": {"query": {"$ref": "#/components/schemas/Count"}, "rank": {"$ref": "#/components/schemas/Count"},
      "distance": {"type": "number", "minimum": 0}, "x": {"type": "number"}, "y": {"type": "number"},
      "z": {"type": "number"}, "cell": {"type": "string"}, "segment": {"$ref": "#/components/schemas/Count"},
      "sample": {"type": "integer"}, "exact": {"type": "boolean"}, "along": {"type": "number"}}}}}},
"Place": {"type": "object", "required": ["sample", "t", "x", "y", "z"],
  "properties": {"sample": {"type": "integer"}, "t": {"type": "number", "minimum": 0, "maximum": 1},
    "x": {"type": "number"}, "y": {"type": "number"}, "z": {"type": "number"}}},
"Path": {"type": "object",
  "required": ["cell", "length_um", "straight_um", "from", "to", "truncated", "note", "points"],
  "properties": {"cell": {"type": "string"}, "length_um": {"type": "number", "minimum": 0},
    "straight_um": {"type": "number", "minimum": 0}, "from": {"$ref": "#/components/schemas/Place"},
    "to": {"$ref": "#/components/schemas/Place"}, "truncated": {"type": "boolean"}, "note": {"type": "string"},
    "points": {"type": "array", "items": {"type": "object", "required": ["sample", "x", "y", "z", "along"],
      "properties": {"sample": {"type": ["integer", "null"]}, "x": {"type": "number"}, "y": {"type": "number"},
        "z": {"type": "number"}, "along": {"type": "number", "minimum": 0}}}}}},
"CellRow": {"type": "object",
  "required": ["id", "name", "source", "samples", "segments", "isolated", "roots", "loops", "box_um"],
  "properties": {"id": {"$ref": "#/components/schemas/Count"}, "name": {"type": "string"},
    "source": {"type": "string"}, "samples": {"$ref": "#/components/schemas/Count"},
    "segments": {"$ref": "#/components/schemas/Count"}, "isolated": {"$ref": "#/components/schemas/Count"},
    "roots": {"$ref": "#/components/schemas/Count"}, "loops": {"$ref": "#/components/schemas/Count"},
    "box_um": {"$ref": "#/components/schemas/Box"}}},
"Cells": {"type": "object", "required": ["truncated", "cursor", "cells"],
  "properties": {"truncated": {"type": "boolean"}, "cursor": {"type": ["string", "null"]},
    "cells": {"type": "array", "items": {"$ref": "#/components/schemas/CellRow"}}}},
"Cell": {"allOf": [{"$ref": "#/components/schemas/CellRow"}, {"type": "object",
  "required": ["truncated", "samples_by_rank"],
  "properties": {"truncated": {"type": "boolean"}, "samples_by_rank": {"type": "object",
    "required": ["id", "x", "y", "z", "radius", "type", "parent"],
    "properties": {"id": {"type": "array", "items": {"type": "integer"}},
      "x": {"type": "array", "items": {"type": "number"}}, "y": {"type": "array", "items": {"type": "number"}},
      "z": {"type": "array", "items": {"type": "number"}},
      "radius": {"type": "array", "items": {"type": ["number", "null"]}},
      "type": {"type": "array", "items": {"type": "integer", "minimum": 0, "maximum": 65535}},
      "parent": {"type": "array", "items": {"type": "integer", "minimum": -1}}}},
    "links": {"type": "array", "items": {"type": "array", "items": {"$ref": "#/components/schemas/Count"},
      "minItems": 2, "maxItems": 2}}}}]},
"Capability": {"type": "object", "required": ["capability", "precomputed", "catmaid"],
  "properties": {"capability": {"type": ["string", "null"]}, "precomputed": {"type": "string"},
    "catmaid": {"type": "string"}}},
"SkeletonInfo": {"type": "object", "required": ["@type", "transform", "vertex_attributes", "segment_properties"],
  "properties": {"@type": {"const": "neuroglancer_skeletons"},
    "transform": {"type": "array", "items": {"type": "number"}, "minItems": 12, "maxItems": 12},
    "vertex_attributes": {"type": "array", "items": {"type": "object",
      "required": ["id", "data_type", "num_components"],
      "properties": {"id": {"type": "string"}, "data_type": {"const": "float32"},
        "num_components": {"const": 1}}}},
    "segment_properties": {"const": "segment_properties"}, "sharding": false}},
"SegmentProperties": {"type": "object", "required": ["@type", "inline"],
  "properties": {"@type": {"const": "neuroglancer_segment_properties"}, "inline": {"type": "object",
    "required": ["ids", "properties"],
    "properties": {
      "ids": {"type": "array", "uniqueItems": true, "items": {"type": "string", "pattern": "^[1-9][0-9]*$"}},
      "properties": {"type": "array", "items": {"type": "object", "required": ["id", "type", "values"],
        "properties": {"id": {"type": "string"}, "values": {"type": "array"},
          "type": {"enum": ["label", "description", "string", "tags", "number"]}}}}}}}},
"CatmaidToken": {"type": "object", "required": ["token"], "properties": {"token": {"const": "anonymous"}}},
"CatmaidVersion": {"type": "object", "required": ["SERVER_VERSION"],
  "properties": {"SERVER_VERSION": {"type": "string"}}},
"CatmaidStacks": {"type": "array", "minItems": 1, "maxItems": 1, "items": {"type": "object", "required": ["id"],
  "properties": {"id": {"const": 1}}}},
"CatmaidVector": {"type": "object", "required": ["x", "y", "z"],
  "properties": {"x": {"type": "number"}, "y": {"type": "number"}, "z": {"type": "number"}}},
"CatmaidStack": {"type": "object", "required": ["dimension", "resolution", "translation", "metadata"],
  "properties": {"dimension": {"$ref": "#/components/schemas/CatmaidVector"},
    "resolution": {"$ref": "#/components/schemas/CatmaidVector"},
    "translation": {"$ref": "#/components/schemas/CatmaidVector"},
    "metadata": {"type": "object", "required": ["read_only", "spatial"], "properties": {"read_only": {"const": true},
      "spatial": {"type": "array", "minItems": 1, "items": {"type": "object", "required": ["chunk_size", "limit"],
        "properties": {"limit": {"$ref": "#/components/schemas/Count"}, "chunk_size": {"type": "array",
          "items": {"type": "integer", "minimum": 1, "maximum": 4294967295}, "minItems": 3, "maxItems": 3}}}}}}}},
"CatmaidNode": {"type": "integer", "minimum": 1, "maximum": 2147483647},
"CatmaidParent": {"anyOf": [{"type": "null"}, {"$ref": "#/components/schemas/CatmaidNode"}]},
"CatmaidSkeletonId": {"type": "integer", "minimum": 1, "maximum": 4294967295},
"CatmaidSkeletons": {"type": "array", "uniqueItems": true,
  "items": {"$ref": "#/components/schemas/CatmaidSkeletonId"}},
"CatmaidNodes": {"type": "array", "minItems": 6, "maxItems": 6, "prefixItems": [
  {"type": "array", "items": {"type": "array", "minItems": 10, "maxItems": 10, "prefixItems": [
    {"$ref": "#/components/schemas/CatmaidNode"}, {"$ref": "#/components/schemas/CatmaidParent"}, {"type": "number"},
    {"type": "number"}, {"type": "number"}, {"type": "integer"}, {"type": "number"},
    {"$ref": "#/components/schemas/CatmaidSkeletonId"}, {"type": "number"}, {"type": "integer"}]}},
  {"type": "array"}, {"type": "object"}, {"type": "boolean"}, {"type": "object"}, {"type": "array"}]},
"CatmaidDetail": {"type": "array", "minItems": 3, "prefixItems": [
  {"type": "array", "items": {"type": "array", "minItems": 9, "maxItems": 9, "prefixItems": [
    {"$ref": "#/components/schemas/CatmaidNode"}, {"$ref": "#/components/schemas/CatmaidParent"}, {"type": "integer"},
    {"type": "number"}, {"type": "number"}, {"type": "number"}, {"type": "number"}, {"type": "integer"},
    {"type": "number"}]}},
  {"type": "array"}, {"type": "object"}]},
"CatmaidRoot": {"type": "object", "required": ["root_id", "x", "y", "z"],
  "properties": {"root_id": {"$ref": "#/components/schemas/CatmaidNode"}, "x": {"type": "number"},
    "y": {"type": "number"}, "z": {"type": "number"}}}
})json";

constexpr std::array<std::pair<std::string_view, std::string_view>, 19> kSchemaOfRoute{{
    {"/v1/sets", "Sets"},
    {"/v1/sets/{set}", "Set"},
    {"/v1/sets/{set}/nearest", "Rows"},
    {"/v1/sets/{set}/box", "Rows"},
    {"/v1/sets/{set}/ray", "Rows"},
    {"/v1/sets/{set}/path", "Path"},
    {"/v1/sets/{set}/cells", "Cells"},
    {"/v1/sets/{set}/cells/{cell}", "Cell"},
    {"/v1/capability", "Capability"},
    {"/precomputed/{set}/info", "SkeletonInfo"},
    {"/precomputed/{set}/segment_properties/info", "SegmentProperties"},
    {"/catmaid/{set}/accounts/anonymous-api-token", "CatmaidToken"},
    {"/catmaid/{set}/version", "CatmaidVersion"},
    {"/catmaid/{set}/1/stacks", "CatmaidStacks"},
    {"/catmaid/{set}/1/stack/1/info", "CatmaidStack"},
    {"/catmaid/{set}/1/skeletons/", "CatmaidSkeletons"},
    {"/catmaid/{set}/1/node/list", "CatmaidNodes"},
    {"/catmaid/{set}/1/skeletons/{skeleton}/compact-detail", "CatmaidDetail"},
    {"/catmaid/{set}/1/skeletons/{skeleton}/root", "CatmaidRoot"},
}};

}  // namespace

nlohmann::ordered_json answerSchemas() { return nlohmann::ordered_json::parse(kSchemas); }

std::string_view schemaOf(std::string_view path) {
  for (const auto& [route, schema] : kSchemaOfRoute)
    if (route == path) return schema;
  return {};
}

}  // namespace filiform::tools
