#include "solver/workspace/button_map.h"

#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;

constexpr std::array kNames{"none",    "mode", "centre",      "zoom-in", "zoom-out", "back",
                            "forward", "turn", "turn-moving", "carry",   "zoom",     "mode-turn"};

// The file's object; empty if there is no file.
nlohmann::json readMaps(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return nlohmann::json::object();
  nlohmann::json maps = nlohmann::json::parse(in, nullptr, false);
  if (!maps.is_object())
    throw InputError(inShort(path) + ": is damaged: remove it, then run filiform devices --setup again");
  return maps;
}

}  // namespace

const char* toString(ButtonAction action) { return kNames.at(static_cast<std::size_t>(action)); }

std::string buttonActionNames() {
  std::string names;
  for (std::size_t i = 1; i < kNames.size(); ++i) names += (i > 1 ? ", " : "") + std::string(kNames[i]);
  return names;
}

ButtonMap parseButtons(const std::string& text, const std::string& where) {
  ButtonMap map{};
  std::array<bool, 8> named{};
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    const std::string part = text.substr(at, end - at);
    at = end + 1;
    const std::string in = where + " '" + escaped(part) + "': ";
    if (part.size() < 3 || part[0] < '0' || part[0] > '7' || part[1] != '=')
      throw UsageError(in + "write BUTTON=ACTION with a button 0 to 7, as in 0=mode,1=turn");
    const auto button = static_cast<std::size_t>(part[0] - '0');
    const auto* const name = std::find(kNames.begin(), kNames.end(), part.substr(2));
    if (name == kNames.end()) throw UsageError(in + "no such action; choose one of " + buttonActionNames());
    if (named[button]) throw UsageError(in + "the button has two actions: leave one out");
    named[button] = true;
    map[button] = static_cast<ButtonAction>(name - kNames.begin());
  }
  return map;
}

std::string buttonsText(const ButtonMap& map) {
  std::string text;
  for (std::size_t i = 0; i < map.size(); ++i)
    if (map[i] != ButtonAction::none) text += (text.empty() ? "" : ",") + std::to_string(i) + "=" + toString(map[i]);
  return text.empty() ? "0=none" : text;
}

ButtonMap defaultButtons(const DeviceCapabilities& can) {
  using enum ButtonAction;
  const bool turns = can.senses_orientation;
  switch (can.buttons) {
    case 1:
      return {mode_turn};
    case 2:
      return turns ? ButtonMap{zoom, mode_turn} : ButtonMap{toggle_mode, zoom};
    case 3:
      return {toggle_mode, turns ? turn : centre, zoom};
    default:
      return {toggle_mode, turns ? turn : centre, zoom_in, zoom_out};
  }
}

void requireButtons(const ButtonMap& map, const DeviceCapabilities& can) {
  const auto has = static_cast<std::size_t>(std::clamp(can.buttons, 0, 8));
  for (std::size_t i = has; i < map.size(); ++i)
    if (map[i] != ButtonAction::none)
      throw UsageError("button " + std::to_string(i) + "=" + toString(map[i]) + ": " + escaped(can.name) + " has " +
                       (has == 0   ? "no buttons"
                        : has == 1 ? "one button, 0"
                                   : std::to_string(has) + " buttons, 0 to " + std::to_string(has - 1)) +
                       "; change --buttons, or run filiform devices --setup");
}

std::string buttonsFile() {
  for (const auto& [name, below] : {std::pair{"XDG_CONFIG_HOME", ""}, std::pair{"HOME", ".config"}})
    if (const char* const folder = std::getenv(name); folder != nullptr && folder[0] == '/')
      return (fs::path(folder) / below / "filiform" / "buttons.json").string();
  throw UsageError("the buttons have no file: set HOME or XDG_CONFIG_HOME to an absolute path");
}

std::optional<ButtonMap> savedButtons(const std::string& device_name) {
  const std::string path = buttonsFile();
  const nlohmann::json maps = readMaps(path);
  const auto found = maps.find(device_name);
  if (found == maps.end()) return std::nullopt;
  try {
    return parseButtons(found->is_string() ? found->get<std::string>() : std::string(), escaped(device_name));
  } catch (const UsageError& error) {
    throw InputError(inShort(path) + ": " + error.what() + "; or run filiform devices --setup again");
  }
}

void saveButtons(const std::string& device_name, const ButtonMap& map) {
  const std::string path = buttonsFile();
  nlohmann::json maps = readMaps(path);
  maps[device_name] = buttonsText(map);
  std::error_code error;
  fs::create_directories(fs::path(path).parent_path(), error);
  if (error) throw IoError(inShort(path), "cannot make the folder of the settings", error.value());
  Output out(path);
  out.stream() << maps.dump(1, ' ', true, nlohmann::json::error_handler_t::replace) << '\n';
  out.finish();
}

}  // namespace filiform
