#include "index/circuits/circuit_config.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <system_error>

#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using ConfigJson = nlohmann::json;

class ConfigReader {
 public:
  explicit ConfigReader(const std::string& path) {
    config_.path = path;
    config_.folder = fs::path(path).parent_path().string();
  }

  CircuitConfig read() {
    std::ifstream in(config_.path, std::ios::binary);
    std::error_code error;
    if (fs::is_directory(config_.path, error)) fail("is a folder, not a circuit_config.json");
    if (!in) throw IoError(inShort(config_.path), "cannot read", errno);
    const std::string text{std::istreambuf_iterator<char>(in), {}};
    const ConfigJson root = ConfigJson::parse(text, nullptr, false);
    if (!root.is_object()) fail("not JSON, or not an object");
    if (root.contains("manifest")) readManifest(root["manifest"]);
    const ConfigJson none = ConfigJson::object();
    const ConfigJson& components = root.contains("components") ? objectOf(root["components"], "components") : none;
    if (!root.contains("networks")) fail("has no `networks`: not a circuit_config.json");
    const ConfigJson& networks = objectOf(root["networks"], "networks");
    if (!networks.contains("nodes") || !networks["nodes"].is_array()) fail("`networks.nodes` is not an array");
    std::size_t number = 0;
    for (const ConfigJson& nodes : networks["nodes"])
      readNodes(objectOf(nodes, "networks.nodes[" + std::to_string(number) + "]"), components,
                "networks.nodes[" + std::to_string(number) + "]"),
          ++number;
    if (config_.populations.empty()) fail("`networks.nodes` is empty");
    return config_;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(inShort(config_.path) + ": " + what); }

  const ConfigJson& objectOf(const ConfigJson& value, const std::string& key) const {
    if (!value.is_object()) fail("`" + escaped(key, 200) + "` is not an object");
    return value;
  }
  std::string textAt(const ConfigJson& object, const char* name, const std::string& key) const {
    if (!object.contains(name) || object[name].is_null()) return {};
    if (!object[name].is_string()) fail("`" + escaped(key, 200) + "." + name + "` is not text");
    return object[name].get<std::string>();
  }

  void readManifest(const ConfigJson& manifest) {
    for (const auto& [name, value] : objectOf(manifest, "manifest").items()) {
      if (!value.is_string()) fail("`manifest." + escaped(name, 100) + "` is not text");
      given_[name.starts_with("$") ? name.substr(1) : name] = value.get<std::string>();
    }
    for (const auto& [name, value] : given_) {
      std::vector<std::string> chain;
      variable(name, chain);
    }
  }

  // The value of a variable; `chain`: the variables that are being resolved.
  std::string variable(const std::string& name, std::vector<std::string>& chain) {
    if (name == "configdir") return ".";  // relative paths begin there
    const auto known = resolved_.find(name);
    if (known != resolved_.end()) return known->second;
    const auto given = given_.find(name);
    if (given == given_.end()) fail("the variable $" + escaped(name, 100) + " is not in the manifest");
    if (std::find(chain.begin(), chain.end(), name) != chain.end()) {
      std::string circle;
      for (auto at = std::find(chain.begin(), chain.end(), name); at != chain.end(); ++at) circle += "$" + *at + " -> ";
      fail("variables of the manifest refer to each other in a circle: " + escaped(circle + "$" + name, 300));
    }
    chain.push_back(name);
    std::string value = substituted(given->second, chain);
    chain.pop_back();
    return resolved_[name] = std::move(value);
  }

  std::string substituted(const std::string& text, std::vector<std::string>& chain) {
    static constexpr std::size_t kMostBytes = 65536;
    std::string out;
    for (std::size_t at = 0; at < text.size();) {
      if (text[at] != '$') {
        out += text[at++];
        continue;
      }
      std::string name;
      if (at + 1 < text.size() && text[at + 1] == '{') {
        const std::size_t end = text.find('}', at);
        if (end == std::string::npos) fail("'" + escaped(text, 200) + "' has a ${ without }");
        name = text.substr(at + 2, end - at - 2);
        at = end + 1;
      } else {
        std::size_t end = at + 1;
        while (end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) != 0 || text[end] == '_'))
          ++end;
        name = text.substr(at + 1, end - at - 1);
        at = end;
      }
      out += variable(name, chain);
      if (out.size() > kMostBytes) fail("a path of the manifest is longer than 65536 bytes");
    }
    return out;
  }

  std::string path(const std::string& text) {
    if (text.empty()) return {};
    std::vector<std::string> chain;
    fs::path found = substituted(text, chain);
    if (found.is_relative()) found = fs::path(config_.folder) / found;
    return found.lexically_normal().string();
  }

  MorphologyPlaces placesOf(const ConfigJson& object, const std::string& key, MorphologyPlaces places) {
    if (object.contains("morphologies_dir")) places.swc_folder = path(textAt(object, "morphologies_dir", key));
    if (object.contains("alternate_morphologies") && !object["alternate_morphologies"].is_null()) {
      const std::string inner = key + ".alternate_morphologies";
      const ConfigJson& others = objectOf(object["alternate_morphologies"], inner);
      if (others.contains("h5v1")) places.h5 = path(textAt(others, "h5v1", inner));
      if (others.contains("neurolucida-asc")) places.asc_folder = path(textAt(others, "neurolucida-asc", inner));
    }
    return places;
  }

  void readNodes(const ConfigJson& nodes, const ConfigJson& components, const std::string& key) {
    CircuitPopulation one;
    one.nodes_file = path(textAt(nodes, "nodes_file", key));
    one.node_types_file = path(textAt(nodes, "node_types_file", key));
    if (one.nodes_file.empty()) fail("`" + key + "` has no `nodes_file`");
    one.morphologies = placesOf(components, "components", {});
    if (!nodes.contains("populations")) {
      config_.populations.push_back(one);
      return;
    }
    for (const auto& [name, value] : objectOf(nodes["populations"], key + ".populations").items()) {
      const std::string inner = key + ".populations." + name;
      CircuitPopulation population = one;
      population.name = name;
      population.type = textAt(objectOf(value, inner), "type", inner);
      population.morphologies = placesOf(value, inner, one.morphologies);
      config_.populations.push_back(std::move(population));
    }
  }

  CircuitConfig config_;
  std::map<std::string, std::string> given_, resolved_;
};

}  // namespace

CircuitConfig readCircuitConfig(const std::string& path) { return ConfigReader(path).read(); }

bool isCircuitConfig(const std::string& path) {
  if (!endsWithNoCase(path, ".json")) return false;
  std::ifstream in(path, std::ios::binary);
  std::string head(std::size_t{1} << 16, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, in.gcount())));
  const std::size_t circuit = std::min(head.find("\"networks\""), head.find("\"manifest\""));
  return circuit < head.find("\"neurons\"");
}

}  // namespace filiform
