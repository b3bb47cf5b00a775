#include "tools/serve/desk/desk_link.h"

#include "device/haptic_device.h"
#include "device/web_socket/web_socket.h"
#include "index/text.h"
#include "index/triple_buffer.h"
#include "tools/serve/desk/desk_rooms.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

using LinkClock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr double kSendEvery_s = 0.016, kRepeatEvery_s = 0.4;  // a place that changes; one that does not
constexpr double kConnecting_s = 5;  // for each step: the connection, the upgrade, the first text
constexpr double kPingEvery_s = 1, kSlow_s = 2, kLost_s = 10;  // without a pong: send no more places; the link is lost
constexpr auto kFirstRetry = 1s, kLastRetry = 8s;
constexpr std::size_t kMostNotes = 8;

}  // namespace

struct DeskLink::Impl {
  Impl(const DeskAddress& a, std::string t) : address(a), token(std::move(t)) {
    thread = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }

  void run(const std::stop_token& stop);
  void follow(const std::string& shown, const std::function<bool()>& is_abandoned);
  void decline(const WebSocket::Answer& answer);
  void leave(const WebSocket::Message& closing);
  void accept();
  void lose(const std::string& why);
  void refuse(const std::string& why);
  std::string wanted() const {
    const std::lock_guard lock(mutex);
    return revision;
  }
  void note(const std::string& line) {
    const std::lock_guard lock(mutex);
    notes.push_back(line);
    if (notes.size() > kMostNotes) notes.pop_front();
  }

  const DeskAddress address;
  const std::string token;
  TripleBuffer<DeskPlace> places;  // the owner -> the thread

  mutable std::mutex mutex;  // of these
  std::deque<std::string> notes;
  std::optional<std::string> first_refusal;
  std::string revision;

  // The thread's.
  std::optional<DeskPlace> place;
  bool refused = false, ever_accepted = false, told_lost = false;
  LinkClock::time_point retry_at{};
  LinkClock::duration retry_after = kFirstRetry;
  std::jthread thread;  // last: ends first
};

void DeskLink::Impl::run(const std::stop_token& stop) {
  for (std::string shown; !stop.stop_requested(); std::this_thread::sleep_for(16ms)) {
    if (std::string now = wanted(); now != shown) {
      shown = std::move(now);
      refused = false;
      retry_at = {};
    }
    if (!shown.empty() && !refused && LinkClock::now() >= retry_at)
      follow(shown, [&] { return stop.stop_requested() || wanted() != shown; });
  }
}

// One try to reach the server, and what follows.
void DeskLink::Impl::follow(const std::string& shown, const std::function<bool()>& is_abandoned) {
  WebSocket socket(DeskPlace::kMostBytes, kLost_s);
  try {
    auto stream = connectTcp(address.host, static_cast<std::uint16_t>(std::stoul(address.port)),
                             {.timeout_s = kConnecting_s, .is_abandoned = is_abandoned});
    const std::string authorization = token.empty() ? "" : "Authorization: Bearer " + token + "\r\n";
    const WebSocket::Answer answer = socket.open(std::move(stream),
                                                 {.host = address.authority(),
                                                  .target = address.path + "?revision=" + shown,
                                                  .headers = "User-Agent: filiform\r\n" + authorization},
                                                 kConnecting_s);
    if (is_abandoned()) return;
    if (!socket.isOpen()) return decline(answer);
  } catch (const DeviceError& error) {
    if (!is_abandoned()) lose(error.what());
    return;
  }
  using Kind = WebSocket::Message::Kind;
  bool accepted = false, unsent = true;
  double ponged_s = socket.stream().time_s(), pinged_s = ponged_s, sent_s = 0, tick_s = ponged_s;
  for (;;) {
    const WebSocket::Message message = socket.receive(tick_s);
    const double now_s = socket.stream().time_s();
    if (is_abandoned()) return;
    if (message.kind == Kind::close) return leave(message);
    if (message.kind == Kind::pong) ponged_s = now_s;
    if (now_s - ponged_s > (accepted ? kLost_s : kConnecting_s)) return lose("no answer");
    if (message.kind == Kind::ended) return lose("the connection has ended");
    if (message.kind == Kind::text && !std::exchange(accepted, true)) accept();  // this desk is in its room
    if (now_s < tick_s) continue;
    tick_s = now_s + kSendEvery_s;
    DeskPlace newest;
    if (places.take(newest)) {
      place = newest;
      unsent = true;
    }
    if (!accepted) continue;
    const double wait_s = ponged_s + kLost_s - now_s;
    if (now_s - pinged_s > kPingEvery_s) {
      pinged_s = now_s;
      socket.send(FrameKind::ping, 0, wait_s);
    }
    const bool due = unsent || now_s - sent_s > kRepeatEvery_s;
    if (!due || !place || now_s - ponged_s > kSlow_s) continue;
    unsent = false;
    sent_s = now_s;
    socket.send(FrameKind::text, toJson(*place), wait_s);
  }
}

// The server may have said why, as problem+json.
void DeskLink::Impl::decline(const WebSocket::Answer& answer) {
  if (answer.status == 0 || answer.status == 101) return lose(answer.trouble);
  const auto problem = nlohmann::json::parse(answer.body, nullptr, false);
  std::string why = "the server answers with status " + std::to_string(answer.status);
  if (problem.is_object() && problem.contains("detail") && problem["detail"].is_string())
    why = escaped(problem["detail"].get<std::string>(), 200);
  if (answer.status == 401) why = "the server wants a token, or another one; give --token-file";
  if (answer.status == 404) why = "the server knows no desks there; is it filiform serve, of this version?";
  if (answer.status >= 500 || answer.status == 429) return lose(why);
  refuse(why);
}

// The server has closed the connection.
void DeskLink::Impl::leave(const WebSocket::Message& closing) {
  const std::string why = escaped(std::string(closing.bytes), 123);
  if (closing.code >= 4000 || closing.code == static_cast<unsigned>(DeskCode::policy)) return refuse(why);
  lose(why.empty() ? "the server has closed the connection" : why);
}

void DeskLink::Impl::accept() {
  retry_after = kFirstRetry;
  note((ever_accepted ? "shown again at " : "shown at ") + address.text);
  ever_accepted = true;
  told_lost = false;
}

void DeskLink::Impl::lose(const std::string& why) {
  retry_at = LinkClock::now() + retry_after;
  retry_after = std::min<LinkClock::duration>(2 * retry_after, kLastRetry);
  if (!std::exchange(told_lost, true)) note(address.text + ": " + why + "; trying again");
}

void DeskLink::Impl::refuse(const std::string& why) {
  refused = true;
  const std::string line = address.text + ": " + why;
  note(line);
  if (ever_accepted) return;
  const std::lock_guard lock(mutex);
  first_refusal = line;
}

DeskLink::DeskLink(const DeskAddress& address, const std::string& token)
    : impl_(std::make_unique<Impl>(address, token)) {}

DeskLink::~DeskLink() = default;

void DeskLink::show(const std::string& revision, const DeskPlace& place) {
  impl_->places.publish(place);
  const std::lock_guard lock(impl_->mutex);
  if (impl_->revision != revision) impl_->revision = revision;
}

std::vector<std::string> DeskLink::takeNotes() {
  const std::lock_guard lock(impl_->mutex);
  std::vector<std::string> taken(impl_->notes.begin(), impl_->notes.end());
  impl_->notes.clear();
  return taken;
}

std::optional<std::string> DeskLink::refusal() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->first_refusal;
}

}  // namespace filiform::tools
