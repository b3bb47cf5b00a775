#include "viewer/scene/view_state.h"

#include "index/text.h"

#include <cmath>
#include <functional>

#include <nlohmann/json.hpp>

namespace filiform {
namespace {

using Json = nlohmann::ordered_json;  // written
using Read = nlohmann::json;

Json listOf(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

double finite(const Read& json) {
  const double number = json.get<double>();
  if (!std::isfinite(number) || std::abs(number) > 1e12) throw UsageError("not a usual number");
  return number;
}
Vector3d vectorOf(const Read& json) { return {finite(json.at(0)), finite(json.at(1)), finite(json.at(2))}; }

Json jsonOf(const Camera& camera) {
  Json rotation = Json::array();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) rotation.push_back(camera.rotation_VW(row, column));
  return {{"eye_um", listOf(camera.eye_W)}, {"rotation", rotation},      {"height_angle_rad", camera.height_angle_rad},
          {"focus_um", camera.focus_um},    {"near_um", camera.near_um}, {"far_um", camera.far_um}};
}

Camera cameraOf(const Read& json) {
  Camera camera;
  camera.eye_W = vectorOf(json.at("eye_um"));
  for (int i = 0; i < 9; ++i)
    camera.rotation_VW(i / 3, i % 3) = finite(json.at("rotation").at(static_cast<std::size_t>(i)));
  const bool turns =
      (camera.rotation_VW * camera.rotation_VW.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-6 &&
      camera.rotation_VW.determinant() > 0;
  camera.height_angle_rad = finite(json.at("height_angle_rad"));
  camera.focus_um = finite(json.at("focus_um"));
  camera.near_um = finite(json.at("near_um"));
  camera.far_um = finite(json.at("far_um"));
  if (!turns || camera.height_angle_rad <= 0 || camera.height_angle_rad > 3 || camera.near_um <= 0 ||
      camera.far_um <= camera.near_um || camera.focus_um <= 0)
    throw UsageError("not a camera");
  return camera;
}

Eigen::Quaterniond rotationOf(const Read& json) {
  const Eigen::Quaterniond q(finite(json.at(0)), finite(json.at(1)), finite(json.at(2)), finite(json.at(3)));
  if (std::abs(q.norm() - 1) > 1e-6) throw UsageError("not a rotation");
  return q;
}

}  // namespace

std::string toJson(const ViewState& v) {
  Json json{{"filiform_view", ViewState::kVersion}, {"set", v.set}, {"revision", v.revision}};
  if (v.place)
    json["place"] = {{"cell", v.place->cell}, {"p_um", listOf(v.place->p_W)}, {"heading", listOf(v.place->heading_W)}};
  const Eigen::Quaterniond& q = v.rotation_WD;
  json["workspace"] = {
      {"centre_um", listOf(v.centre_W)}, {"rotation", {q.w(), q.x(), q.y(), q.z()}}, {"zoom_um", v.zoom_um}};
  json["overview"] = v.overview;
  json["look"] = {{"far", v.look.far},
                  {"turn_rad", {v.look.yaw_rad, v.look.pitch_rad}},
                  {"factor", v.look.factor},
                  {"shift", {v.look.shift_x, v.look.shift_y}}};
  if (v.camera) json["camera"] = jsonOf(*v.camera);
  json["size_px"] = {v.size.width, v.size.height};
  json["orthographic"] = v.orthographic;
  json["theme"] = toString(v.theme);
  json["colour_by"] = v.colour_by;
  if (v.shows_some) json["shown"] = v.shown;
  json["hidden"] = v.hidden;
  json["dimmed"] = v.dimmed;
  json["chosen"] = v.chosen;
  json["highlighted"] = v.highlighted;
  json["hidden_types"] = v.hidden_types;
  json["bookmarks"] = Json::array();
  for (const ViewState::Bookmark& b : v.bookmarks)
    json["bookmarks"].push_back({{"name", b.name}, {"p_um", listOf(b.p_W)}});
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

ViewState viewStateOf(const std::string& text, const std::string& file, std::vector<std::string>& notes) {
  const Read json = Read::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("filiform_view") || !json["filiform_view"].is_number())
    throw InputError(inShort(file) + ": is no view; save one with V in the window");
  ViewState v;
  std::string odd;
  const auto take = [&](const char* name, const std::function<void(const Read&)>& use) {
    const auto found = json.find(name);
    if (found == json.end()) return;
    try {
      use(*found);
    } catch (const std::exception&) {
      odd += (odd.empty() ? "" : ", ") + std::string(name);
    }
  };
  if (json["filiform_view"].get<double>() > ViewState::kVersion)
    notes.push_back(inShort(file) + ": a view of a newer version; what this version knows is used");
  const auto text_of = [&](const char* name, std::string& value) {
    take(name, [&](const Read& j) { value = j.get<std::string>(); });
  };
  const auto names_of = [&](const char* name, std::vector<std::string>& value) {
    take(name, [&](const Read& j) { value = j.get<std::vector<std::string>>(); });
  };
  text_of("set", v.set);
  text_of("revision", v.revision);
  take("place", [&](const Read& j) {
    const ViewState::Place place{j.at("cell").get<std::string>(), vectorOf(j.at("p_um")), vectorOf(j.at("heading"))};
    v.place = place;
  });
  take("workspace", [&](const Read& j) {
    const Vector3d centre_W = vectorOf(j.at("centre_um"));
    const Eigen::Quaterniond rotation_WD = rotationOf(j.at("rotation"));
    const double zoom_um = finite(j.at("zoom_um"));
    if (zoom_um <= 0) throw UsageError("not a zoom");
    v.centre_W = centre_W, v.rotation_WD = rotation_WD, v.zoom_um = zoom_um;
  });
  take("overview", [&](const Read& j) { v.overview = j.get<bool>(); });
  take("look", [&](const Read& j) {
    ViewState::Look look{j.at("far").get<bool>(), finite(j.at("turn_rad").at(0)), finite(j.at("turn_rad").at(1)),
                         finite(j.at("factor")),  finite(j.at("shift").at(0)),    finite(j.at("shift").at(1))};
    if (look.factor <= 0) throw UsageError("not a factor");
    v.look = look;
  });
  take("camera", [&](const Read& j) { v.camera = cameraOf(j); });
  take("size_px", [&](const Read& j) {
    const double width = finite(j.at(0)), height = finite(j.at(1));
    if (width < 1 || height < 1 || width > 8192 || height > 8192) throw UsageError("not a size");
    v.size = {static_cast<int>(width), static_cast<int>(height)};
  });
  take("orthographic", [&](const Read& j) { v.orthographic = j.get<bool>(); });
  take("theme", [&](const Read& j) { v.theme = themeOf(j.get<std::string>()); });
  text_of("colour_by", v.colour_by);
  take("shown", [&](const Read& j) {
    v.shown = j.get<std::vector<std::string>>();
    v.shows_some = true;
  });
  names_of("hidden", v.hidden);
  names_of("dimmed", v.dimmed);
  names_of("chosen", v.chosen);
  names_of("highlighted", v.highlighted);
  take("hidden_types", [&](const Read& j) {
    const double types = finite(j);
    if (types < 0 || types > 31) throw UsageError("not a set of types");
    v.hidden_types = static_cast<std::uint8_t>(types);
  });
  take("bookmarks", [&](const Read& j) {
    for (const Read& b : j) v.bookmarks.push_back({b.at("name").get<std::string>(), vectorOf(b.at("p_um"))});
  });
  if (!odd.empty()) notes.push_back(inShort(file) + ": has another form in " + odd + "; the rest is used");
  return v;
}

}  // namespace filiform
