#include "tools/serve/desk/desk_place.h"

#include "solver/workspace/workspace.h"

#include <cmath>
#include <span>

#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

constexpr double kFarthest_um = 1e12, kMostForce_N = 1e3;

bool readNumbers(const nlohmann::json& json, const char* name, std::span<double> numbers) {
  const auto found = json.find(name);
  if (found == json.end() || !found->is_array() || found->size() != numbers.size()) return false;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!(*found)[i].is_number()) return false;
    numbers[i] = (*found)[i].get<double>();
    if (!(std::abs(numbers[i]) <= kFarthest_um)) return false;
  }
  return true;
}

bool readNumber(const nlohmann::json& json, const char* name, double least, double most, double& number) {
  const auto found = json.find(name);
  if (found == json.end() || !found->is_number()) return false;
  number = found->get<double>();
  return number >= least && number <= most;
}

}  // namespace

std::string toJson(const DeskPlace& place) {
  const nlohmann::ordered_json json{{"proxy_um", place.proxy_W},       {"hand_um", place.hand_W},
                                    {"centre_um", place.centre_W},     {"rotation", place.rotation_WD},
                                    {"zoom_um", place.zoom_um},        {"force_N", place.force_N},
                                    {"constrained", place.constrained}};
  return json.dump();
}

std::optional<DeskPlace> parseDeskPlace(std::string_view text) {
  if (text.size() > DeskPlace::kMostBytes) return std::nullopt;
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object() || json.size() != 7) return std::nullopt;
  DeskPlace place;
  for (const auto& [name, point] :
       {std::pair{"proxy_um", &place.proxy_W}, {"hand_um", &place.hand_W}, {"centre_um", &place.centre_W}})
    if (!readNumbers(json, name, *point)) return std::nullopt;
  if (!readNumbers(json, "rotation", place.rotation_WD)) return std::nullopt;
  double square = 0;
  for (const double part : place.rotation_WD) square += part * part;
  if (!(std::abs(square - 1) < 1e-3)) return std::nullopt;
  if (!readNumber(json, "zoom_um", Workspace::kMinZoom_um, Workspace::kMaxZoom_um, place.zoom_um)) return std::nullopt;
  if (!readNumber(json, "force_N", 0, kMostForce_N, place.force_N)) return std::nullopt;
  const auto constrained = json.find("constrained");
  if (constrained == json.end() || !constrained->is_boolean()) return std::nullopt;
  place.constrained = constrained->get<bool>();
  return place;
}

}  // namespace filiform::tools
