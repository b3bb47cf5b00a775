#include "tools/serve/session/session_client.h"

#include "index/text.h"
#include "tools/serve/sets/limits.h"
#include "tools/serve/sets/timed_store.h"
#include "tools/words/answer.h"
#include "tools/words/refusal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace filiform::tools {

namespace {

using PlainJson = nlohmann::json;

constexpr const char* kProtocol = "filiform.v1";
constexpr std::array<const char*, 8> kMethods{"hello",      "open",      "jump",   "mode",
                                              "parameters", "workspace", "follow", "subscribe"};
constexpr double kMostStiffness_N_m = 2000, kMostHold_s = 3600, kMostRadius_um = 1e6;

void requireKnown(const PlainJson& params, std::initializer_list<const char*> known) {
  for (const auto& [name, value] : params.items()) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    std::string names;
    for (const char* one : known) (names += names.empty() ? "" : ", ") += one;
    throw RpcError(RpcError::kParams, "unknown parameter '" + escaped(name, 40) + "'; " +
                                          (names.empty() ? "this method has none" : "known are " + names));
  }
}

[[noreturn]] void refuseValue(const std::string& name, const std::string& wanted) {
  throw RpcError(RpcError::kParams, name + " must be " + wanted);
}

std::optional<double> numberParameter(const PlainJson& params, const std::string& name, double least, double most) {
  const auto found = params.find(name);
  if (found == params.end()) return std::nullopt;
  const double value = found->is_number() ? found->get<double>() : std::nan("");
  if (!(value >= least && value <= most))
    refuseValue(name, "a number from " + jsonText(least) + " to " + jsonText(most));
  return value;
}

std::optional<std::string> textParameter(const PlainJson& params, const std::string& name) {
  const auto found = params.find(name);
  if (found == params.end()) return std::nullopt;
  if (!found->is_string()) refuseValue(name, "a string");
  return found->get<std::string>();
}

std::optional<bool> truthParameter(const PlainJson& params, const std::string& name) {
  const auto found = params.find(name);
  if (found == params.end()) return std::nullopt;
  if (!found->is_boolean()) refuseValue(name, "true or false");
  return found->get<bool>();
}

template <int kCount>
std::optional<Eigen::Matrix<double, kCount, 1>> numbersParameter(const PlainJson& params, const std::string& name) {
  const auto found = params.find(name);
  if (found == params.end()) return std::nullopt;
  const std::string wanted = "an array of " + std::to_string(kCount) + " finite numbers";
  if (!found->is_array() || found->size() != kCount) refuseValue(name, wanted);
  Eigen::Matrix<double, kCount, 1> values;
  for (int i = 0; i < kCount; ++i) {
    const PlainJson& value = found->at(static_cast<std::size_t>(i));
    values[i] = value.is_number() ? value.get<double>() : std::nan("");
    if (!std::isfinite(values[i])) refuseValue(name, wanted);
  }
  return values;
}

nlohmann::ordered_json coordinatesJson(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace

SessionClient::SessionClient(SessionHouse& house, std::string version, PersonPointer who)
    : house_(house), version_(std::move(version)), who_(std::move(who)) {}

SessionClient::~SessionClient() { close(); }

void SessionClient::close() {
  std::shared_ptr<RemoteSession> session;
  {
    const std::lock_guard lock(mutex_);
    session = std::exchange(session_, nullptr);
  }
  house_.close(session);
}

std::shared_ptr<RemoteSession> SessionClient::session() const {
  const std::lock_guard lock(mutex_);
  return session_;
}

RemoteSession& SessionClient::opened() const {
  const std::shared_ptr<RemoteSession> session = this->session();
  if (session == nullptr) throw RpcError(RpcError::kOutOfOrder, "call open first");
  return *session;
}

// ---- text

std::string SessionClient::answer(std::string_view text) {
  RpcAnswer answer = answerRpc(text, [this](const std::string& method, const Params& params) {
    try {
      return call(method, params);
    } catch (const RpcError&) {
      throw;
    } catch (const Refusal&) {
      throw;
    } catch (const UsageError&) {
      throw;
    } catch (const std::exception& error) {
      house_.tell(error.what());
      throw;
    }
  });
  count(answer.errors, answer.calls);
  return std::move(answer.text);
}

void SessionClient::count(std::size_t errors, std::size_t calls) {
  const std::lock_guard lock(mutex_);
  errors_ = errors < calls ? errors : errors_ + errors;
}

std::optional<SessionRefusal> SessionClient::refusal() const {
  const std::lock_guard lock(mutex_);
  if (errors_ < session_limits::kErrors) return std::nullopt;
  return SessionRefusal{CloseCode::policy, "100 wrong requests or frames in a row"};
}

SessionClient::Json SessionClient::call(const std::string& method, const Params& params) {
  const TimedStore::Limit limit(limits::kQuery_s);
  if (method == "hello") return hello(params);
  if (std::find(kMethods.begin(), kMethods.end(), method) == kMethods.end()) {
    std::string names;
    for (const char* one : kMethods) (names += names.empty() ? "" : ", ") += one;
    throw RpcError(RpcError::kNoMethod, "unknown method '" + escaped(method, 40) + "'; known are " + names);
  }
  if (!greeted_) throw RpcError(RpcError::kOutOfOrder, "call hello first");
  if (method == "open") return open(params);
  if (method == "jump") return jump(params);
  if (method == "mode") return mode(params);
  if (method == "parameters") return parameters(params);
  if (method == "workspace") return workspace(params);
  if (method == "follow") return follow(params);
  return subscribe(params);
}

SessionClient::Json SessionClient::hello(const Params& params) {
  requireKnown(params, {"protocol", "client"});
  const std::string protocol = textParameter(params, "protocol").value_or(kProtocol);
  textParameter(params, "client");
  if (protocol != kProtocol)
    throw RpcError(RpcError::kParams, "this server speaks filiform.v1, not '" + escaped(protocol, 40) + "'");
  greeted_ = true;
  Json sets = Json::array();
  for (const auto& served : house_.shelf().all(who_.get())) {
    const TileSet& set = served->set();
    const GridBox& bounds = set.bounds();
    const bool empty = set.segmentCount() == 0;
    sets.push_back({{"name", served->name()},
                    {"revision", set.revision()},
                    {"cells", set.cell_count()},
                    {"segments", set.segmentCount()},
                    {"lo_um", empty ? Json(nullptr) : coordinatesJson(set.grid().toWorld(bounds.lo))},
                    {"hi_um", empty ? Json(nullptr) : coordinatesJson(set.grid().toWorld(bounds.hi))}});
  }
  return {{"protocol", kProtocol},
          {"server", "filiform " + version_},
          {"tick_Hz", 1 / RemoteHand::kPeriod_s},
          {"unacknowledged", static_cast<int>(v1::kMostUnacknowledged)},
          {"frame_bytes", session_limits::kFrameBytes},
          {"idle_s", session_limits::kIdle_s},
          {"sets", std::move(sets)}};
}

SessionClient::Json SessionClient::open(const Params& params) {
  requireKnown(params, {"set", "at", "cell", "sample", "zoom_um", "method", "stiffness_N_m", "hold_s", "lo_m", "hi_m"});
  const std::optional<std::string> set = textParameter(params, "set");
  if (!set) refuseValue("set", "the name of a set");
  RemoteSessionOptions options;
  options.zoom_um = numberParameter(params, "zoom_um", Workspace::kMinZoom_um, Workspace::kMaxZoom_um).value_or(300);
  if (const auto method = textParameter(params, "method")) options.method = solverMethod(*method);
  options.stiffness_N_m = numberParameter(params, "stiffness_N_m", 0.001, kMostStiffness_N_m);
  options.hand.hold_s = numberParameter(params, "hold_s", 0.01, kMostHold_s).value_or(0.1);
  options.hand.lo_D = numbersParameter<3>(params, "lo_m").value_or(options.hand.lo_D);
  options.hand.hi_D = numbersParameter<3>(params, "hi_m").value_or(options.hand.hi_D);
  const Eigen::Array3d size_m = (options.hand.hi_D - options.hand.lo_D).array();
  if (!(size_m > 0).all() || options.hand.lo_D.cwiseAbs().maxCoeff() > RemoteHand::kMost_m ||
      options.hand.hi_D.cwiseAbs().maxCoeff() > RemoteHand::kMost_m)
    throw RpcError(RpcError::kParams, "lo_m must be below hi_m, both within 10 m");
  const std::shared_ptr<RemoteSession> before = this->session();
  const std::shared_ptr<RemoteSession> session = house_.open(*set, options, before != nullptr, who_.get());
  ProxyPlace place;
  try {
    if (params.contains("at") || params.contains("cell")) place = placeOf(*session, params);
  } catch (...) {
    house_.close(session);
    throw;
  }
  if (place.valid()) session->jump(place, true);
  {
    const std::lock_guard lock(mutex_);
    session_ = session;
  }
  house_.close(before);
  const TileSet& tiles = session->scene().set();
  return {{"session", session->options().number},
          {"set", *set},
          {"revision", tiles.revision()},
          {"cells", tiles.cell_count()},
          {"segments", tiles.segmentCount()},
          {"zoom_um", options.zoom_um},
          {"method", toString(options.method)},
          {"stiffness_N_m", session->stiffness_N_m()},
          {"most_N", RemoteSession::most_force_N()},
          {"hold_s", options.hand.hold_s},
          {"place", place.valid() ? placeJson(*session, place) : Json(nullptr)}};
}

ProxyPlace SessionClient::placeOf(const RemoteSession& session, const Params& params) const {
  const PlaceFinder& places = session.scene().places();
  const auto at_W = numbersParameter<3>(params, "at");
  const auto name = textParameter(params, "cell");
  if (at_W.has_value() == name.has_value())
    throw RpcError(RpcError::kParams, "give either at ([x, y, z] in um) or cell (a name)");
  if (at_W) {
    const auto found = places.nearest(*at_W);
    if (!found) throw RpcError(RpcError::kNotFound, "the set has no segments");
    return found->place;
  }
  const TileStore& store = session.scene().served().store();
  const auto cell = store.findCell(*name);
  if (!cell) throw RpcError(RpcError::kNotFound, "the set has no cell '" + escaped(*name, 60) + "'");
  if (store.cell(*cell).samples > limits::kCellSamples)
    throw RpcError(RpcError::kParams, "the cell has more than 1000000 samples; give a point (at)");
  const auto sample = params.find("sample");
  if (sample == params.end()) return places.soma(*cell);
  if (!sample->is_number_integer()) refuseValue("sample", "a whole number");
  const auto walk = places.walk(*cell);
  const std::vector<std::int64_t>& ids = walk->graph().sample_ids;
  const auto found = std::find(ids.begin(), ids.end(), sample->get<std::int64_t>());
  if (found == ids.end()) throw RpcError(RpcError::kNotFound, "the cell has no sample " + jsonText(Json(*sample)));
  return places.atSample(*walk, *cell, static_cast<std::uint32_t>(found - ids.begin()));
}

SessionClient::Json SessionClient::placeJson(const RemoteSession& session, const ProxyPlace& place) const {
  return {{"cell", session.scene().served().store().cell(place.segment.cell).name},
          {"cell_id", place.segment.cell},
          {"segment", place.segment.segment},
          {"t", place.t},
          {"p_um", coordinatesJson(place.p_W)}};
}

SessionClient::Json SessionClient::jump(const Params& params) {
  requireKnown(params, {"at", "cell", "sample", "under_hand"});
  RemoteSession& session = opened();
  const bool under_hand = truthParameter(params, "under_hand").value_or(true);
  const ProxyPlace place = placeOf(session, params);
  if (!place.valid()) throw RpcError(RpcError::kNotFound, "there is no segment");
  session.jump(place, under_hand);
  return {{"place", placeJson(session, place)}};
}

SessionClient::Json SessionClient::mode(const Params& params) {
  requireKnown(params, {"mode"});
  RemoteSession& session = opened();
  const std::string wanted = textParameter(params, "mode").value_or("");
  if (wanted == "free") {
    NavigationCommand free;
    free.kind = NavigationCommand::Kind::free;
    if (!session.send(free)) throw RpcError(RpcError::kBusy, "too many commands wait; ask again");
    return {{"mode", "free"}};
  }
  if (wanted != "constrained") refuseValue("mode", "constrained or free");
  const NavigationSnapshot now = session.now();
  if (now.mode == NavigationMode::constrained && now.place.valid()) return {{"mode", "constrained"}};
  const auto found = session.scene().places().nearest(now.h_W);
  if (!found) throw RpcError(RpcError::kNotFound, "the set has no segments");
  session.jump(found->place, false);
  return {{"mode", "constrained"}, {"place", placeJson(session, found->place)}};
}

SessionClient::Json SessionClient::parameters(const Params& params) {
  requireKnown(params, {"zoom_um"});
  RemoteSession& session = opened();
  double zoom_um = session.now().zoom_um;
  if (const auto wanted_um = numberParameter(params, "zoom_um", Workspace::kMinZoom_um, Workspace::kMaxZoom_um)) {
    if (!(zoom_um > 0)) zoom_um = session.options().zoom_um;
    NavigationCommand zoom;
    zoom.kind = NavigationCommand::Kind::zoom;
    zoom.factor = *wanted_um / zoom_um;
    if (!session.send(zoom)) throw RpcError(RpcError::kBusy, "too many commands wait; ask again");
    zoom_um = *wanted_um;
  }
  return {{"zoom_um", zoom_um},
          {"method", toString(session.options().method)},
          {"stiffness_N_m", session.stiffness_N_m()},
          {"most_N", RemoteSession::most_force_N()},
          {"hold_s", session.options().hand.hold_s}};
}

SessionClient::Json SessionClient::workspace(const Params& params) {
  requireKnown(params, {"rotate_rad", "centre"});
  RemoteSession& session = opened();
  if (const auto about_rad = numbersParameter<2>(params, "rotate_rad")) {
    NavigationCommand rotate;
    rotate.kind = NavigationCommand::Kind::rotate;
    rotate.about_x_rad = (*about_rad)[0];
    rotate.about_y_rad = (*about_rad)[1];
    if (!session.send(rotate)) throw RpcError(RpcError::kBusy, "too many commands wait; ask again");
  }
  if (truthParameter(params, "centre").value_or(false)) {
    NavigationCommand centre;
    centre.kind = NavigationCommand::Kind::centre;
    if (!session.send(centre)) throw RpcError(RpcError::kBusy, "too many commands wait; ask again");
  }
  const NavigationSnapshot now = session.now();
  const Eigen::Vector4d rotation = now.rotation_WD.coeffs();
  const bool placed = now.mode == NavigationMode::constrained && now.place.valid();
  return {{"tick", now.tick},
          {"zoom_um", now.zoom_um},
          {"um_m", now.zoom_um / Workspace::kZoomSpan_m},
          {"rotation_WD", {rotation[0], rotation[1], rotation[2], rotation[3]}},
          {"p_um", coordinatesJson(now.p_W)},
          {"p_m", coordinatesJson(now.p_D)},
          {"centre_um", coordinatesJson(now.centre_W)},
          {"mode", toString(now.mode)},
          {"place", placed ? placeJson(session, now.place) : Json(nullptr)}};
}

SessionClient::Json SessionClient::follow(const Params& params) {
  requireKnown(params, {"cell"});
  RemoteSession& session = opened();
  const auto given = params.find("cell");
  if (given != params.end() && given->is_null()) {
    session.follow(std::nullopt);
    return {{"cell", nullptr}, {"tiles", 0}};
  }
  const std::string name = textParameter(params, "cell").value_or("");
  const TileStore& store = session.scene().served().store();
  const auto cell = store.findCell(name);
  if (!cell) throw RpcError(RpcError::kNotFound, "the set has no cell '" + escaped(name, 60) + "'");
  return {{"cell", name}, {"tiles", session.follow(cell)}};
}

SessionClient::Json SessionClient::subscribe(const Params& params) {
  requireKnown(params, {"proxy_Hz", "model_Hz", "radius_um"});
  RemoteSession& session = opened();
  Subscription wanted = session.subscription();
  wanted.proxy_Hz = numberParameter(params, "proxy_Hz", 0, 1000).value_or(wanted.proxy_Hz);
  wanted.model_Hz = numberParameter(params, "model_Hz", 0, 100).value_or(wanted.model_Hz);
  wanted.radius_um = numberParameter(params, "radius_um", 0, kMostRadius_um).value_or(wanted.radius_um);
  session.subscribe(wanted);
  return {{"proxy_Hz", wanted.proxy_Hz}, {"model_Hz", wanted.model_Hz}, {"radius_um", wanted.radius_um}};
}

// ---- binary frames

std::optional<SessionRefusal> SessionClient::receive(std::span<const unsigned char> bytes) {
  v1::Hand hand;
  if (!v1::decode(bytes.data(), bytes.size(), hand))
    return SessionRefusal{CloseCode::unsupported, "a binary frame must be a HAND of 64 bytes, version 1"};
  outbox_.acknowledge(hand.ack);
  const std::shared_ptr<RemoteSession> session = this->session();
  if (session != nullptr) count(session->receive(hand) ? 0 : 1, 1);
  return refusal();
}

bool SessionClient::takeFrames(const std::function<void(std::span<const unsigned char>)>& send) {
  const std::shared_ptr<RemoteSession> session = this->session();
  if (session != shown_) {
    shown_ = session;
    model_waits_ = false;
  }
  if (session == nullptr) return false;
  for (v1::Proxy proxy; session->takeProxy(proxy);) outbox_.put(proxy);
  bool sent = false;
  if (const std::optional<v1::Proxy> proxy = outbox_.next()) {
    std::array<unsigned char, v1::kProxyBytes> bytes{};
    v1::encode(*proxy, bytes.data());
    send(bytes);
    sent = true;
  }
  model_waits_ = session->takeModel(model_) || model_waits_;
  if (model_waits_ && outbox_.maySend()) {
    model_waits_ = false;
    send(std::span(model_.bytes).first(model_.size));
    sent = true;
  }
  return sent;
}

std::vector<std::string> SessionClient::takeNotes() {
  const std::shared_ptr<RemoteSession> session = this->session();
  std::vector<std::string> notes;
  if (session == nullptr) return notes;
  for (const std::string& note : house_.takeNotes(*session)) notes.push_back(rpcNotification("note", {{"text", note}}));
  return notes;
}

}  // namespace filiform::tools
