#include "index/set/internal/manifest.h"

#include "index/file/internal/digest.h"
#include "index/file/internal/set_files.h"
#include "index/file/tile_source.h"
#include "index/set/internal/cells_file.h"
#include "index/text.h"
#include "index/whole_number.h"

#include <algorithm>
#include <cstdio>

#include <nlohmann/json.hpp>

namespace filiform::internal {
namespace {

// Bytes that are not valid UTF-8 become \xNN, so that JSON can hold any file name.
std::string validUtf8(std::string_view bytes) {
  std::string text;
  while (!bytes.empty()) {
    const std::size_t length = decodeUtf8(bytes).length;
    if (length > 0) {
      text += bytes.substr(0, length);
    } else {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\x%02X", static_cast<unsigned>(static_cast<unsigned char>(bytes[0])));
      text += escape;
    }
    bytes.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return text;
}

nlohmann::ordered_json pointJson(const Grid& grid, const GridPoint& p) {
  const Vector3d p_W = grid.toWorld(p);
  return {p_W.x(), p_W.y(), p_W.z()};
}

nlohmann::ordered_json corners(const GridBox& box) {
  return {{box.lo.x(), box.lo.y(), box.lo.z()}, {box.hi.x(), box.hi.y(), box.hi.z()}};
}

GridBox boxOf(const nlohmann::json& corners) {
  if (corners.size() != 2 || corners.at(0).size() != 3 || corners.at(1).size() != 3)
    throw Damage{0, "a box is malformed"};
  GridBox box;
  for (std::size_t i = 0; i < 3; ++i) {
    box.lo[static_cast<Eigen::Index>(i)] = wholeNumber<std::int64_t>(corners.at(0).at(i));
    box.hi[static_cast<Eigen::Index>(i)] = wholeNumber<std::int64_t>(corners.at(1).at(i));
  }
  if (box.empty()) throw Damage{0, "a box is malformed"};
  return box;
}

std::uint64_t fromHex16(const std::string& text) {
  if (text.size() != 16 || text.find_first_not_of("0123456789abcdef") != std::string::npos)
    throw Damage{0, "a digest is malformed"};
  return std::stoull(text, nullptr, 16);
}

// Refuses counts that the files cannot hold, so that memory that follows from counts is bounded by bytes.
void checkCounts(const Manifest& manifest) {
  std::uint64_t packs = 0, cells = 0;
  for (const SetFile& file : manifest.files) {
    if (file.bytes > INT64_MAX / (manifest.files.size() * kMostSamplesAByte)) throw Damage{0, "a file is too large"};
    if (isPackFile(file.name)) packs += file.bytes;
    if (file.name == kCellsFile) cells = file.bytes;
  }
  const SetCounts& c = manifest.counts;
  const std::uint64_t segments = kMostSegmentsAByte * packs, samples = kMostSamplesAByte * packs;
  if (c.segments > segments || c.isolated > segments || c.stored_segments > segments || c.samples > samples ||
      c.roots > samples || (c.cells + c.removed) * kCellRecordBytes > cells)
    throw Damage{0, "counts more than its files can hold"};
}

}  // namespace

std::string encodeManifest(const Manifest& manifest, const Provenance& provenance) {
  nlohmann::ordered_json json;
  json["format"] = "filiform tile set";
  json["version"] = manifest.version;
  json["units"] = "um";
  json["quantum_exponent"] = manifest.grid.exponent();
  json["quantum_um"] = manifest.grid.quantum_um();
  json["capacity"] = manifest.capacity;
  json["bounds_um"] = nullptr;
  json["bounds_quanta"] = nullptr;
  if (!manifest.bounds.empty()) {
    json["bounds_um"] = {pointJson(manifest.grid, manifest.bounds.lo), pointJson(manifest.grid, manifest.bounds.hi)};
    json["bounds_quanta"] = corners(manifest.bounds);
  }
  if (manifest.usual && !manifest.usual->box.empty())
    json["usual_box"] = {{"quanta", corners(manifest.usual->box)}, {"outside", manifest.usual->outside}};
  const SetCounts& c = manifest.counts;
  json["counts"] = {{"cells", c.cells},
                    {"samples", c.samples},
                    {"segments", c.segments},
                    {"isolated", c.isolated},
                    {"roots", c.roots},
                    {"removed", c.removed},
                    {"tiles", c.tiles},
                    {"stored_segments", c.stored_segments},
                    {"decoded_bytes", c.decoded_bytes}};
  json["covering_radius_um"] = manifest.covering_radius_um;
  json["grown"] = manifest.grown;
  json["smallest_budget_bytes"] = manifest.floor_bytes;
  json["directory"] =
      toBase64({reinterpret_cast<const char*>(manifest.directory_root.data()), manifest.directory_root.size()});
  json["cells_root"] = {{"bytes", manifest.cells_root_bytes}, {"xxh3", hex16(manifest.cells_root_checksum)}};
  json["files"] = nlohmann::ordered_json::array();
  for (const SetFile& file : manifest.files) {
    json["files"].push_back({{"name", file.name}, {"bytes", file.bytes}, {"xxh3", hex16(file.digest)}});
    if (!file.revision.empty()) json["files"].back()["revision"] = file.revision;
  }
  nlohmann::ordered_json codes = nlohmann::ordered_json::object();
  for (const auto& [code, count] : provenance.codes) codes[validUtf8(code)] = count;
  json["provenance"] = {
      {"sources", provenance.sources.size()}, {"refused", provenance.refused.size()}, {"codes", codes}};
  if (!provenance.skipped.empty()) json["provenance"]["skipped"] = provenance.skipped.size();
  return json.dump(2) + "\n";
}

void writeProvenance(const Provenance& provenance, const std::function<void(std::string_view piece)>& use) {
  using Json = nlohmann::ordered_json;
  use("{\n\"sources\": [");
  const char* between = "\n";
  for (const Provenance::Source& s : provenance.sources) {
    const Json source = {
        {"name", validUtf8(s.name)}, {"bytes", s.bytes}, {"xxh3", hex16(s.digest)}, {"cells", s.cells}};
    std::string text = between + source.dump();
    between = ",\n";
    if (s.dropped) {
      text.pop_back();
      use(text + ",\"dropped\":\"");
      s.dropped([&](std::string_view piece) {
        if (piece.find_first_not_of("0123456789,") != std::string_view::npos) {
          text = Json(validUtf8(std::string(piece))).dump();
          piece = std::string_view(text).substr(1, text.size() - 2);
        }
        use(piece);
      });
      text = "\"}";
    }
    use(text);
  }
  const auto write = [&](const char* list, const std::vector<Provenance::Lost>& inputs) {
    use(list);
    between = "\n";
    for (const Provenance::Lost& input : inputs) {
      use(between +
          Json{{"name", validUtf8(input.name)}, {"code", validUtf8(input.code)}, {"reason", validUtf8(input.reason)}}
              .dump());
      between = ",\n";
    }
    use("\n]");
  };
  use("\n],\n");
  write("\"refused\": [", provenance.refused);
  if (!provenance.skipped.empty()) write(",\n\"skipped\": [", provenance.skipped);
  if (!provenance.passed_over.empty()) {
    Json endings = Json::object();
    for (const auto& [ending, count] : provenance.passed_over) endings[validUtf8(ending)] = count;
    use(",\n\"passed_over\": " + endings.dump());
  }
  use("\n}\n");
}

Manifest decodeManifest(const std::string& text) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    if (json.at("format") != "filiform tile set") throw Damage{0, "not the manifest of a tile set"};
    const nlohmann::json& version = json.at("version");
    if (!version.is_number_unsigned()) throw Damage{0, "its version is no number"};
    const auto number = version.get<std::uint64_t>();
    if (number < kOldestVersion || number > kFormatVersion)
      throwOtherVersion(0, version.dump(), number < kOldestVersion);
    Manifest manifest;
    manifest.version = static_cast<std::uint32_t>(number);
    const int exponent = wholeNumber<int>(json.at("quantum_exponent"));
    if (exponent < Grid::kMinExponent || exponent > Grid::kMaxExponent) throw Damage{0, "the quantum is out of range"};
    manifest.grid = Grid(exponent);
    manifest.capacity = wholeNumber<std::uint32_t>(json.at("capacity"));
    if (!json.at("bounds_quanta").is_null()) manifest.bounds = boxOf(json.at("bounds_quanta"));
    if (json.contains("usual_box"))
      manifest.usual = {boxOf(json.at("usual_box").at("quanta")),
                        wholeNumber<std::uint64_t>(json.at("usual_box").at("outside"))};
    const nlohmann::json& counts = json.at("counts");
    const auto count = [&](const char* name) { return wholeNumber<std::uint64_t>(counts.at(name)); };
    SetCounts& c = manifest.counts;
    c.cells = count("cells"), c.samples = count("samples"), c.segments = count("segments");
    c.isolated = count("isolated"), c.roots = count("roots"), c.removed = count("removed");
    c.tiles = count("tiles"), c.stored_segments = count("stored_segments"), c.decoded_bytes = count("decoded_bytes");
    if (c.cells > UINT32_MAX - 1 || c.removed > UINT32_MAX - 1 - c.cells) throw Damage{0, "too many cells"};
    manifest.grown = json.at("grown").get<bool>();
    manifest.covering_radius_um = json.at("covering_radius_um").get<double>();
    const nlohmann::json& provenance = json.at("provenance");
    manifest.refused = wholeNumber<std::uint64_t>(provenance.at("refused"));
    if (provenance.contains("skipped")) manifest.skipped = wholeNumber<std::uint64_t>(provenance.at("skipped"));
    manifest.floor_bytes = wholeNumber<std::uint64_t>(json.at("smallest_budget_bytes"));
    const std::optional<std::string> root = fromBase64(json.at("directory").get_ref<const std::string&>());
    if (!root) throw Damage{0, "not base64"};
    manifest.directory_root.assign(root->begin(), root->end());
    const nlohmann::json& cells_root = json.at("cells_root");
    manifest.cells_root_bytes = wholeNumber<std::uint64_t>(cells_root.at("bytes"));
    manifest.cells_root_checksum = fromHex16(cells_root.at("xxh3").get<std::string>());
    for (const nlohmann::json& file : json.at("files")) {
      manifest.files.push_back({file.at("name").get<std::string>(), wholeNumber<std::uint64_t>(file.at("bytes")),
                                fromHex16(file.at("xxh3").get<std::string>())});
      SetFile& last = manifest.files.back();
      if (file.contains("revision")) last.revision = file.at("revision").get<std::string>();
      if (!last.revision.empty() && !isRevisionName(last.revision)) throw Damage{0, "a file has an invalid revision"};
      const std::string& name = last.name;
      if (!isTileFileName(name) || name.find('/') != std::string::npos) throw Damage{0, "a file has an invalid name"};
    }
    checkCounts(manifest);
    return manifest;
  } catch (const nlohmann::json::exception& error) {
    throw Damage{0, std::string("not a manifest: ") + error.what()};
  } catch (const std::out_of_range& error) {
    throw Damage{0, std::string("not a manifest: ") + error.what()};
  }
}

Provenance decodeProvenance(const std::string& text, const std::string& manifest) {
  try {
    Provenance provenance;
    const nlohmann::json json = nlohmann::json::parse(text);
    for (const nlohmann::json& s : json.at("sources")) {
      provenance.sources.push_back({s.at("name").get<std::string>(), wholeNumber<std::uint64_t>(s.at("bytes")),
                                    fromHex16(s.at("xxh3").get<std::string>()),
                                    wholeNumber<std::uint64_t>(s.at("cells"))});
      if (s.contains("dropped"))
        provenance.sources.back().dropped = [dropped = s.at("dropped").get<std::string>()](const auto& use) {
          use(dropped);
        };
    }
    const auto readLost = [](const nlohmann::json& list, std::vector<Provenance::Lost>& lost) {
      for (const nlohmann::json& r : list)
        lost.push_back(
            {r.at("name").get<std::string>(), r.at("code").get<std::string>(), r.at("reason").get<std::string>()});
    };
    readLost(json.at("refused"), provenance.refused);
    if (json.contains("skipped")) readLost(json.at("skipped"), provenance.skipped);
    if (json.contains("passed_over"))
      for (const auto& [ending, count] : json.at("passed_over").items())
        provenance.passed_over[ending] = wholeNumber<std::uint64_t>(count);
    const nlohmann::json stated = nlohmann::json::parse(manifest);
    for (const auto& [code, count] : stated.at("provenance").at("codes").items())
      provenance.codes[code] = wholeNumber<std::uint64_t>(count);
    return provenance;
  } catch (const nlohmann::json::exception& error) {
    throw Damage{0, std::string("not a provenance: ") + error.what()};
  } catch (const std::out_of_range& error) {
    throw Damage{0, std::string("not a provenance: ") + error.what()};
  }
}

std::string revisionName(const std::string& manifest) { return "r-" + hex16(checksum(manifest)); }

bool isRevisionName(const std::string& name) {
  return name.size() == 18 && name.starts_with("r-") &&
         name.find_first_not_of("0123456789abcdef", 2) == std::string::npos;
}

}  // namespace filiform::internal
