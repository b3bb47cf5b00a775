#include "tools/serve/session/session_replay.h"

#include "index/errors.h"
#include "index/text.h"
#include "solver/travel/session/session.h"
#include "tools/serve/session/session_frames.h"
#include "tools/serve/session/session_log.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

struct LogAbout {
  std::string set, revision;
  RemoteHandOptions hand;
};

LogAbout parseAbout(const std::string& path, const std::string& text) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    LogAbout about{json.at("set").get<std::string>(), json.at("revision").get<std::string>(), {}};
    about.hand.hold_s = json.at("hold_s").get<double>();
    for (int axis = 0; axis < 3; ++axis) {
      about.hand.lo_D[axis] = json.at("lo_m").at(static_cast<std::size_t>(axis)).get<double>();
      about.hand.hi_D[axis] = json.at("hi_m").at(static_cast<std::size_t>(axis)).get<double>();
    }
    return about;
  } catch (const nlohmann::json::exception&) {
    throw InputError(inShort(path) + ": its description is damaged; record the session again");
  }
}

bool sameBits(const Vector3d& a, const Vector3d& b) { return std::memcmp(a.data(), b.data(), 3 * sizeof(double)) == 0; }

}  // namespace

std::string recordedRevision(const std::string& path) {
  return parseAbout(path + ".frames", readSessionLog(path + ".frames").about).revision;
}

SessionReplay replaySession(const TileStore& store, const std::string& path) {
  const ReadLog log = readSessionLog(path + ".frames");
  const LogAbout about = parseAbout(path + ".frames", log.about);
  SessionReplay result;
  result.set = about.set;
  result.revision = about.revision;
  SessionOptions options;
  options.device = "replay:" + path;
  Session session(store, options);
  RemoteHand hand(about.hand);
  hand.open();
  auto record = log.records.begin();
  for (;;) {
    session.advance(1);
    if (session.replayEnded()) break;
    const NavigationSnapshot& now = session.update();
    ++result.ticks;
    const auto end = std::find_if(record, log.records.end(), [&](const LogRecord& r) { return r.tick > now.tick; });
    for (auto it = record; it != end; ++it) {
      v1::Hand used;
      if (it->size == 1) hand.block(it->bytes[0] != 0);
      if (!v1::decode(it->bytes.data(), it->size, used)) continue;
      hand.receive(used);
      ++result.hands;
    }
    hand.beginPeriod(static_cast<std::uint64_t>(std::llround(now.time_s / RemoteHand::kPeriod_s)));
    result.differing_hands += !sameBits(hand.exchange({}).p_D, now.h_D);
    for (; record != end; ++record) {
      if (record->size != v1::kProxyBytes) continue;
      ++result.proxies;
      unsigned char bytes[v1::kProxyBytes];
      v1::encode(proxyOf(now, hand), bytes);
      result.differing_proxies += std::memcmp(bytes, record->bytes.data(), sizeof bytes) != 0;
    }
  }
  if (const std::string fault = session.fault(); !fault.empty()) throw InputError(inShort(path) + ": " + fault);
  if (result.ticks == 0) throw InputError(inShort(path) + ": holds no tick, so there is nothing to repeat");
  return result;
}

}  // namespace filiform::tools
