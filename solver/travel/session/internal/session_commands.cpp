#include "solver/travel/session/internal/session_commands.h"

#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"
#include "index/whole_number.h"

#include <cerrno>
#include <fstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace filiform::internal {

namespace {

using SessionJson = nlohmann::ordered_json;
using Kind = NavigationCommand::Kind;

bool hasPlace(Kind kind) { return kind == Kind::jump || kind == Kind::constrain; }
bool hasFactor(Kind kind) { return kind == Kind::zoom || kind == Kind::leap; }

SessionJson toJson(const SessionCommand& commanded) {
  const NavigationCommand& c = commanded.command;
  SessionJson json{{"tick", commanded.tick}, {"kind", static_cast<int>(c.kind)}};
  if (hasPlace(c.kind)) {
    const ProxyPlace& p = c.place;
    json["cell"] = p.segment.cell;
    json["segment"] = p.segment.segment;
    json["t"] = p.t;
    json["at_node"] = p.at_node;
    json["node"] = {p.node.cell, p.node.sample};
    json["tile"] = p.tile;
    json["p_um"] = {p.p_W.x(), p.p_W.y(), p.p_W.z()};
  }
  if (hasFactor(c.kind)) json["factor"] = c.factor;
  if (c.kind == Kind::rotate) json["turn_rad"] = {c.about_x_rad, c.about_y_rad};
  return json;
}

ProxyPlace placeOf(const SessionJson& json) {
  ProxyPlace place;
  place.segment = {wholeNumber<std::uint32_t>(json.at("cell")), wholeNumber<std::uint32_t>(json.at("segment"))};
  place.t = json.at("t").get<double>();
  place.at_node = json.at("at_node").get<bool>();
  place.node = {wholeNumber<std::uint32_t>(json.at("node").at(0)), wholeNumber<std::uint32_t>(json.at("node").at(1))};
  place.tile = wholeNumber<TileId>(json.at("tile"));
  for (int axis = 0; axis < 3; ++axis)
    place.p_W[axis] = json.at("p_um").at(static_cast<std::size_t>(axis)).get<double>();
  return place;
}

SessionCommand fromJson(const SessionJson& json) {
  SessionCommand commanded{wholeNumber<std::uint64_t>(json.at("tick")), {}};
  NavigationCommand& c = commanded.command;
  const int kind = wholeNumber<int>(json.at("kind"));
  if (kind < 0 || kind > static_cast<int>(Kind::leap)) throw InputError("unknown command");
  c.kind = static_cast<Kind>(kind);
  if (hasPlace(c.kind)) c.place = placeOf(json);
  if (hasFactor(c.kind)) c.factor = json.at("factor").get<double>();
  if (c.kind == Kind::rotate) {
    c.about_x_rad = json.at("turn_rad").at(0).get<double>();
    c.about_y_rad = json.at("turn_rad").at(1).get<double>();
  }
  return commanded;
}

}  // namespace

SessionCommands readSessionCommands(const std::string& path, const TileStore& scene) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw IoError(inShort(path), "cannot read the session's commands, which belong to the recording", errno);
  SessionCommands session;
  try {
    const auto json = SessionJson::parse(in);
    session.zoom_um = json.at("zoom_um").get<double>();
    session.method = solverMethod(json.at("method").get<std::string>());
    session.stiffness_N_m = json.at("stiffness_N_m").get<double>();
    session.rate_Hz = json.at("rate_Hz").get<double>();
    session.leap = json.value("leap", 1.0);
    if (json.contains("buttons")) session.buttons = parseButtons(json.at("buttons").get<std::string>(), inShort(path));
    for (const auto& one : json.at("commands")) session.commands.push_back(fromJson(one));
  } catch (const nlohmann::json::exception& error) {
    throw InputError(inShort(path) + ": not the commands of a session: " + error.what());
  } catch (const std::out_of_range& error) {
    throw InputError(inShort(path) + ": not the commands of a session: " + error.what());
  }
  for (const SessionCommand& one : session.commands)
    if (const ProxyPlace& p = one.command.place;
        p.valid() && (p.tile >= scene.tile_count() || p.segment.cell >= scene.cell_count()))
      throw InputError(inShort(path) + ": recorded in another scene, which has more tiles or cells");
  return session;
}

void writeSessionCommands(const std::string& path, const SessionCommands& commands) {
  SessionJson json{{"filiform_session", 1},
                   {"zoom_um", commands.zoom_um},
                   {"method", toString(commands.method)},
                   {"stiffness_N_m", commands.stiffness_N_m},
                   {"rate_Hz", commands.rate_Hz},
                   {"leap", commands.leap}};
  if (commands.buttons) json["buttons"] = buttonsText(*commands.buttons);
  json["commands"] = SessionJson::array();
  for (const SessionCommand& one : commands.commands) json["commands"].push_back(toJson(one));
  Output out(path);
  out.stream() << json.dump(1) << '\n';
  out.finish();
}

}  // namespace filiform::internal
