#include "viewer/window/settings/settings.h"

#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <nlohmann/json.hpp>

namespace filiform {

namespace fs = std::filesystem;

std::string Settings::path() {
  for (const auto& [name, below] : {std::pair{"XDG_CONFIG_HOME", ""}, std::pair{"HOME", ".config"}}) {
    const char* value = std::getenv(name);
    if (value != nullptr && fs::path(value).is_absolute())
      return (fs::path(value) / below / "filiform/view.json").string();
  }
  throw UsageError("settings: neither XDG_CONFIG_HOME nor HOME is set to an absolute path");
}

Settings Settings::load(const std::string& path, std::string& warning) {
  Settings s;
  std::ifstream in(path, std::ios::binary);
  if (!in) return s;
  const auto json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object()) {
    warning = inShort(path);
    warning += ": not a settings file of filiform view; using the defaults";
    return s;
  }
  const auto number = [&](const char* name, auto& value, double least, double most) {
    const auto found = json.find(name);
    if (found == json.end() || !found->is_number()) return;
    const double wanted = found->get<double>();
    if (wanted >= least && wanted <= most) value = static_cast<std::decay_t<decltype(value)>>(wanted);
  };
  const auto flag = [&](const char* name, auto& value) {
    const auto found = json.find(name);
    if (found != json.end() && found->is_boolean()) value = found->get<bool>();
  };
  const auto choice = [&](const char* name, auto& value, const auto& choices) {
    const auto found = json.find(name);
    if (found == json.end() || !found->is_string()) return;
    for (const auto one : choices)
      if (found->get<std::string>() == toString(one)) value = one;
  };
  choice("theme", s.theme, kThemes);
  choice("colour_by", s.colouring, kColourings);
  choice("stereo", s.stereo, kStereoModes);
  flag("orthographic", s.orthographic);
  flag("own_cell", s.own_cell);
  flag("orange_blue", s.orange_blue);
  number("separation", s.separation, 0, 2);
  number("widening", s.widening, 0.5, 2);
  flag("reduced_motion", s.reduced_motion);
  number("interface_scale", s.interface_scale, 0.5, 4);
  flag("show_tiles", s.show_tiles);
  flag("show_force", s.show_force);
  flag("show_minimap", s.show_minimap);
  number("width", s.width, 1, 8192);
  number("height", s.height, 1, 8192);
  return s;
}

void Settings::save(const std::string& path) const {
  nlohmann::ordered_json json{{"theme", toString(theme)},
                              {"colour_by", toString(colouring)},
                              {"stereo", toString(stereo)},
                              {"orthographic", orthographic},
                              {"own_cell", own_cell},
                              {"orange_blue", orange_blue},
                              {"separation", separation},
                              {"widening", widening},
                              {"reduced_motion", reduced_motion},
                              {"interface_scale", interface_scale},
                              {"show_tiles", show_tiles},
                              {"show_minimap", show_minimap},
                              {"width", width},
                              {"height", height}};
  if (show_force) json["show_force"] = *show_force;
  std::error_code error;
  fs::create_directories(fs::path(path).parent_path(), error);
  Output out(path);
  out.stream() << json.dump(1) << '\n';
  out.finish();
}

}  // namespace filiform
