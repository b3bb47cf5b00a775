#include "index/formats/internal/neuroglancer_skeleton.h"

#include "index/errors.h"
#include "index/file/internal/byte_stream.h"
#include "index/formats/internal/graph_builder.h"
#include "index/formats/neuroglancer/internal/bounded_json.h"
#include "index/text.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

namespace filiform {
namespace {

using Json = nlohmann::json;
using Type = SkeletonInfo::Attribute::Type;

constexpr double kNanometre_um = 1e-3;

bool isOfSkeletons(const Json& json) {
  return json.is_object() && json.contains("@type") && json["@type"] == "neuroglancer_skeletons";
}

std::size_t bytesOfType(Type type) {
  switch (type) {
    case Type::kInt8:
    case Type::kUint8:
      return 1;
    case Type::kInt16:
    case Type::kUint16:
      return 2;
    default:
      return 4;
  }
}

// Reads a little-endian number. Returns false at the end of the file.
bool readBits(internal::ByteStream& in, std::size_t bytes, std::uint32_t& bits) {
  std::array<unsigned char, 4> raw{};
  if (!in.read(raw.data(), bytes)) return false;
  bits = 0;
  for (std::size_t i = 0; i < bytes; ++i) bits |= std::uint32_t{raw[i]} << (8 * i);
  return true;
}

double valueOf(std::uint32_t bits, Type type) {
  switch (type) {
    case Type::kFloat32:
      return double(std::bit_cast<float>(bits));
    case Type::kInt8:
      return static_cast<std::int8_t>(bits);
    case Type::kInt16:
      return static_cast<std::int16_t>(bits);
    case Type::kInt32:
      return static_cast<std::int32_t>(bits);
    default:
      return bits;
  }
}

// Reads nodes, links and attributes. Returns false if the file is too short.
bool readAll(internal::ByteStream& in, const SkeletonInfo& info, internal::GraphBuilder& graph) {
  std::uint32_t nodes = 0, links = 0;
  if (!readBits(in, 4, nodes) || !readBits(in, 4, links)) return false;
  const std::array<double, 12>& m = info.transform_nm;
  for (std::uint32_t i = 0; i < nodes; ++i) {
    std::array<double, 3> p{};
    for (double& coordinate : p) {
      std::uint32_t bits = 0;
      if (!readBits(in, 4, bits)) return false;
      coordinate = valueOf(bits, Type::kFloat32);
    }
    Vector3d position_um;
    for (std::size_t row = 0; row < 3; ++row)
      position_um[static_cast<Eigen::Index>(row)] =
          (m[4 * row] * p[0] + m[4 * row + 1] * p[1] + m[4 * row + 2] * p[2] + m[4 * row + 3]) * kNanometre_um;
    graph.node(i, position_um, std::nan(""), 0, std::uint64_t{i} + 1, "node " + std::to_string(i));
  }
  for (std::uint32_t i = 0; i < links; ++i) {
    std::uint32_t a = 0, b = 0;
    if (!readBits(in, 4, a) || !readBits(in, 4, b)) return false;
    graph.link(a, b, std::uint64_t{i} + 1);
  }
  const double radius_unit_nm = info.radiusUnit_nm();
  const auto isNamed = [](const SkeletonInfo::Attribute& attribute, std::string_view id) {
    return attribute.components == 1 && attribute.id == id;
  };
  const bool has_types = std::any_of(info.attributes.begin(), info.attributes.end(),
                                     [&](const auto& attribute) { return isNamed(attribute, "vertex_types"); });
  for (const SkeletonInfo::Attribute& attribute : info.attributes) {
    const bool radius = isNamed(attribute, "radius");
    const bool type = isNamed(attribute, has_types ? "vertex_types" : "compartment");
    if (!radius && !type) {
      graph.remark(InputCode::W_ATTRIBUTE, 0, attribute.id);
      if (!in.skip(std::uint64_t{nodes} * attribute.components * bytesOfType(attribute.type))) return false;
      continue;
    }
    for (std::uint32_t i = 0; i < nodes; ++i) {
      std::uint32_t bits = 0;
      if (!readBits(in, bytesOfType(attribute.type), bits)) return false;
      const double value = valueOf(bits, attribute.type);
      if (radius) {
        const double radius_um = radius_unit_nm > 0 ? value * radius_unit_nm * kNanometre_um : std::nan("");
        graph.setRadius(i, radius_um, std::uint64_t{i} + 1);
      } else if (value >= 0 && value <= 65535 && value == std::floor(value)) {
        graph.setType(i, static_cast<std::uint16_t>(value));
      } else {
        graph.remark(InputCode::W_BAD_TYPE, std::uint64_t{i} + 1, std::to_string(value));
      }
    }
  }
  return true;
}

template <class Fail>
ShardScheme shardingOf(const Json& json, Fail fail) {
  const auto text = [&](const char* key, const char* otherwise) {
    if (!json.contains(key)) return std::string(otherwise);
    if (!json[key].is_string()) fail(std::string("its sharding has no valid ") + key);
    return json[key].get<std::string>();
  };
  if (!json.is_object() || text("@type", "") != "neuroglancer_uint64_sharded_v1")
    fail("its sharding is not neuroglancer_uint64_sharded_v1");
  const auto bits = [&](const char* key) {
    const bool good = json.contains(key) && json[key].is_number_unsigned() && json[key].get<std::uint64_t>() <= 64;
    if (!good) fail(std::string("its sharding has no valid ") + key);
    return json[key].get<unsigned>();
  };
  const auto isGzip = [&](const char* key) {
    const std::string encoding = text(key, "raw");
    if (encoding != "raw" && encoding != "gzip")
      fail(std::string("its sharding has the ") + key + " " + escaped(encoding, 40) + "; raw and gzip are known");
    return encoding == "gzip";
  };
  ShardScheme sharding;
  sharding.preshift_bits = bits("preshift_bits");
  sharding.minishard_bits = bits("minishard_bits");
  sharding.shard_bits = bits("shard_bits");
  if (sharding.minishard_bits + sharding.shard_bits > 64) fail("its sharding has more than 64 bits");
  const std::string hash = text("hash", "");
  if (hash != "identity" && hash != "murmurhash3_x86_128")
    fail("its sharding has the hash " + escaped(hash, 40) + "; identity and murmurhash3_x86_128 are known");
  sharding.murmur = hash != "identity";
  sharding.gzip_index = isGzip("minishard_index_encoding");
  sharding.gzip_data = isGzip("data_encoding");
  return sharding;
}

// The folder below that of the info that a member names; empty: none.
std::string folderBelow(const Json& json, const char* key, const std::string& file) {
  if (!json.contains(key) || !json[key].is_string()) return {};
  std::string folder = json[key].get<std::string>();
  while (folder.ends_with('/') && folder.size() > 1) folder.pop_back();
  if (folder.find("..") != std::string::npos || folder.starts_with('/'))
    throw InputError(inShort(file) + ": its " + key +
                     " lead out of the folder; read a copy of it in which they do not");
  return folder;
}

}  // namespace

double SkeletonInfo::radiusUnit_nm() const {
  const std::array<double, 12>& m = transform_nm;
  const double x = m[0], y = m[5], z = m[10];
  const bool diagonal = m[1] == 0 && m[2] == 0 && m[4] == 0 && m[6] == 0 && m[8] == 0 && m[9] == 0;
  if (diagonal && std::abs(x) == std::abs(y) && std::abs(x) == std::abs(z)) return std::abs(x);  // without rounding
  const double volume = x * (y * z - m[6] * m[9]) - m[1] * (m[4] * z - m[6] * m[8]) + m[2] * (m[4] * m[9] - y * m[8]);
  return std::cbrt(std::abs(volume));
}

bool SkeletonInfo::isGzip(std::string_view head, std::uint64_t bytes) const {
  if (head.size() < 8 || !head.starts_with("\x1f\x8b\x08")) return false;
  const auto word = [&](std::size_t at) {
    std::uint64_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<unsigned char>(head[at + i]);
    return value;
  };
  std::uint64_t bytes_of_node = 12;
  for (const Attribute& attribute : attributes) bytes_of_node += attribute.components * bytesOfType(attribute.type);
  return bytes != 8 + word(0) * bytes_of_node + word(4) * 8;
}

SkeletonInfo::Elsewhere SkeletonInfo::elsewhere(std::string_view text, const std::string& file) {
  const Json json = internal::boundedJson(text);
  if (!json.is_object()) return {};
  const auto member = [&](const char* key) {
    return json.contains(key) && json[key].is_string() ? json[key].get<std::string>() : std::string();
  };
  const std::string type = member("@type"), kind = member("type");
  if (type == "neuroglancer_legacy_mesh" || type == "neuroglancer_multilod_draco")
    return {.folder = {}, .what = "meshes"};
  if (type != "neuroglancer_multiscale_volume" &&
      (!json.contains("scales") || (kind != "image" && kind != "segmentation")))
    return {.folder = {}, .what = escaped(type, 60)};
  Elsewhere found{.folder = folderBelow(json, "skeletons", file)};
  if (!found.folder.empty()) {
    found.segment_properties = folderBelow(json, "segment_properties", file);
    return found;
  }
  found.what = kind == "image"           ? "an image volume, which has no skeletons"
               : !member("mesh").empty() ? "a volume with meshes, but without skeletons"
                                         : "a volume without skeletons";
  return found;
}

bool SkeletonInfo::isSkeletonInfo(std::string_view json) { return isOfSkeletons(internal::boundedJson(json)); }

SkeletonInfo SkeletonInfo::parse(std::string_view text, const std::string& file) {
  const auto fail = [&](const std::string& what) { throw InputError(inShort(file) + ": " + what); };
  const Json json = internal::boundedJson(text);
  if (!isOfSkeletons(json)) fail("is not the info of neuroglancer skeletons");
  SkeletonInfo info;
  const auto states = [&](const char* key) { return json.contains(key) && !json[key].is_null(); };
  if (states("sharding")) info.sharding = shardingOf(json["sharding"], fail);
  info.segment_properties = folderBelow(json, "segment_properties", file);
  if (states("transform")) {
    const Json& transform = json["transform"];
    bool good = transform.is_array() && transform.size() == info.transform_nm.size();
    for (std::size_t i = 0; good && i < info.transform_nm.size(); ++i) {
      good = transform[i].is_number();
      if (good) info.transform_nm[i] = transform[i].get<double>();
      good = good && std::isfinite(info.transform_nm[i]);
    }
    if (!good) fail("its transform is not 12 finite numbers");
  }
  if (!states("vertex_attributes")) return info;
  if (!json["vertex_attributes"].is_array()) fail("its vertex_attributes are not a list");
  static constexpr std::pair<std::string_view, Type> kTypes[] = {
      {"float32", Type::kFloat32}, {"int8", Type::kInt8},   {"uint8", Type::kUint8},  {"int16", Type::kInt16},
      {"uint16", Type::kUint16},   {"int32", Type::kInt32}, {"uint32", Type::kUint32}};
  for (const Json& one : json["vertex_attributes"]) {
    Attribute attribute;
    bool good = one.is_object() && one.contains("id") && one["id"].is_string() && one.contains("data_type") &&
                one["data_type"].is_string() && one.contains("num_components") &&
                one["num_components"].is_number_unsigned();
    if (good) {
      attribute.id = one["id"].get<std::string>();
      attribute.components = one["num_components"].get<std::size_t>();
      const std::string name = one["data_type"].get<std::string>();
      good = false;
      for (const auto& [type_name, type] : kTypes)
        if (type_name == name) attribute.type = type, good = true;
      good = good && attribute.components >= 1 && attribute.components <= 1024;
    }
    if (!good) fail("one of its vertex_attributes lacks a valid id, data_type or num_components");
    info.attributes.push_back(std::move(attribute));
  }
  return info;
}

void readSkeleton(internal::ByteStream& in, const SkeletonInfo& info, internal::GraphBuilder& graph) {
  if (!readAll(in, info, graph)) {
    graph.refuse(InputCode::E_FORMAT, 0, "ends too soon");
  } else if (in.peek() != internal::ByteStream::kEnd) {
    graph.refuse(InputCode::E_FORMAT, 0, "longer than its counts say");
  }
}

}  // namespace filiform
