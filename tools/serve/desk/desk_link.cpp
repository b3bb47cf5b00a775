#include "tools/serve/desk/desk_link.h"

#include "index/text.h"
#include "index/triple_buffer.h"
#include "tools/serve/desk/desk_rooms.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace net = boost::asio;
namespace websocket = boost::beast::websocket;
using boost::system::error_code;
using net::ip::tcp;
using LinkClock = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kSendEvery = 16ms, kRepeatEvery = 400ms;  // a place that changes; one that does not
constexpr auto kConnecting = 5s;
constexpr auto kPingEvery = 1s, kSlow = 2s, kLost = 10s;  // without a pong: send no more places; the link is lost
constexpr auto kFirstRetry = 1s, kLastRetry = 8s;
constexpr std::size_t kMostNotes = 8;

}  // namespace

struct DeskLink::Impl {
  Impl(const DeskAddress& a, std::string t) : address(a), token(std::move(t)) {
    thread = std::thread([this] {
      tick();
      io.run();
    });
  }
  ~Impl() {
    net::post(io, [this] {
      stopping = true;
      drop();
      timer.cancel();
    });
    thread.join();
  }

  struct Connection;
  void tick();
  void drop();
  void lose(const std::string& why);
  void refuse(const std::string& why);
  void accepted();
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
  net::io_context io{1};
  net::steady_timer timer{io};
  std::shared_ptr<Connection> connection;
  std::string shown_revision;  // of the connection, or of the refusal
  std::optional<DeskPlace> place;
  bool stopping = false, refused = false, ever_accepted = false, told_lost = false;
  LinkClock::time_point retry_at{};
  LinkClock::duration retry_after = kFirstRetry;
  std::thread thread;
};

// One try to reach the server, and what follows.
struct DeskLink::Impl::Connection : std::enable_shared_from_this<Connection> {
  Connection(Impl& l, std::string r) : link(&l), revision(std::move(r)), resolver(l.io), socket(l.io) {}

  void begin() {
    resolver.async_resolve(link->address.host, link->address.port,
                           [self = shared_from_this()](error_code error, const tcp::resolver::results_type& found) {
                             if (error) return self->fail(error);
                             self->connect(found);
                           });
  }

  // The link drops it: no callback uses the link any more.
  void end() {
    link = nullptr;
    resolver.cancel();
    beast::get_lowest_layer(socket).close();
  }

  void tick(LinkClock::time_point now, bool fresh) {
    const bool awaited = !open && ponged != LinkClock::time_point{};  // the first text
    if (awaited && now - ponged > kConnecting) return fail(beast::error::timeout);
    if (!open) return;
    if (now - ponged > kLost) return fail(beast::error::timeout);
    if (now - pinged > kPingEvery && !std::exchange(pinging, true)) {
      pinged = now;
      socket.async_ping({}, [self = shared_from_this()](error_code) { self->pinging = false; });
    }
    unsent |= fresh;
    const bool due = unsent || now - sent > kRepeatEvery;
    if (!due || writing || !link->place || now - ponged > kSlow) return;
    writing = true;
    unsent = false;
    sent = now;
    out = toJson(*link->place);
    socket.async_write(net::buffer(out), [self = shared_from_this()](error_code error, std::size_t) {
      self->writing = false;
      if (error && error != websocket::error::closed) self->fail(error);  // else read() has the reason
    });
  }

 private:
  void connect(const tcp::resolver::results_type& found) {
    if (link == nullptr) return;
    auto& stream = beast::get_lowest_layer(socket);
    stream.expires_after(kConnecting);
    stream.async_connect(found, [self = shared_from_this()](error_code error, const tcp::endpoint&) {
      if (error) return self->fail(error);
      self->shake();
    });
  }

  void shake() {
    if (link == nullptr) return;
    auto& stream = beast::get_lowest_layer(socket);
    error_code ignored;
    stream.socket().set_option(tcp::no_delay(true), ignored);
    stream.expires_after(kConnecting);
    socket.set_option(
        websocket::stream_base::timeout{websocket::stream_base::none(), websocket::stream_base::none(), false});
    socket.set_option(websocket::stream_base::decorator([token = link->token](websocket::request_type& request) {
      request.set(http::field::user_agent, "filiform");
      if (!token.empty()) request.set(http::field::authorization, "Bearer " + token);
    }));
    socket.control_callback([this](websocket::frame_type kind, beast::string_view) {
      if (kind == websocket::frame_type::pong) ponged = LinkClock::now();
    });
    socket.read_message_max(DeskPlace::kMostBytes);
    socket.async_handshake(answer, link->address.authority(), link->address.path + "?revision=" + revision,
                           [self = shared_from_this()](error_code error) {
                             if (error) return self->declined(error);
                             self->begun();
                           });
  }

  void begun() {
    if (link == nullptr) return;
    beast::get_lowest_layer(socket).expires_never();
    socket.text(true);
    ponged = pinged = LinkClock::now();
    read();
  }

  // The server may have said why, as problem+json.
  void declined(error_code error) {
    if (link == nullptr) return;
    const unsigned status = answer.result_int();
    if (error != websocket::error::upgrade_declined) return fail(error);
    const auto problem = nlohmann::json::parse(answer.body(), nullptr, false);
    std::string why = "the server answers with status " + std::to_string(status);
    if (problem.is_object() && problem.contains("detail") && problem["detail"].is_string())
      why = escaped(problem["detail"].get<std::string>(), 200);
    if (status == 401) why = "the server wants a token, or another one; give --token-file";
    if (status == 404) why = "the server knows no desks there; is it filiform serve, of this version?";
    if (status >= 500 || status == 429) return link->lose(why);
    link->refuse(why);
  }

  void read() {
    socket.async_read(buffer, [self = shared_from_this()](error_code error, std::size_t) {
      if (self->link == nullptr) return;
      self->buffer.clear();
      if (!error) {
        if (!std::exchange(self->open, true)) self->link->accepted();  // the first text: this desk is in its room
        return self->read();
      }
      if (error != websocket::error::closed) return self->fail(error);
      const auto& reason = self->socket.reason();
      const std::string text = escaped(std::string(reason.reason.c_str()), 123);
      if (reason.code >= 4000 || reason.code == static_cast<unsigned>(DeskCode::policy))
        return self->link->refuse(text);
      self->link->lose(text.empty() ? "the server has closed the connection" : text);
    });
  }

  void fail(error_code error) {
    if (link != nullptr) link->lose(error == beast::error::timeout ? "no answer" : escaped(error.message(), 120));
  }

  Impl* link;  // nullptr: dropped
  const std::string revision;
  tcp::resolver resolver;
  websocket::stream<beast::tcp_stream> socket;
  websocket::response_type answer;
  beast::flat_buffer buffer;
  std::string out;
  bool open = false, writing = false, pinging = false, unsent = true;
  LinkClock::time_point ponged{}, pinged{}, sent{};
};

void DeskLink::Impl::drop() {
  if (const auto dropped = std::exchange(connection, nullptr)) dropped->end();
}

void DeskLink::Impl::accepted() {
  retry_after = kFirstRetry;
  note((ever_accepted ? "shown again at " : "shown at ") + address.text);
  ever_accepted = true;
  told_lost = false;
}

void DeskLink::Impl::lose(const std::string& why) {
  drop();
  retry_at = LinkClock::now() + retry_after;
  retry_after = std::min<LinkClock::duration>(2 * retry_after, kLastRetry);
  if (!std::exchange(told_lost, true)) note(address.text + ": " + why + "; trying again");
}

void DeskLink::Impl::refuse(const std::string& why) {
  drop();
  refused = true;
  const std::string line = address.text + ": " + why;
  note(line);
  if (ever_accepted) return;
  const std::lock_guard lock(mutex);
  first_refusal = line;
}

void DeskLink::Impl::tick() {
  if (stopping) return;
  const auto now = LinkClock::now();
  DeskPlace newest;
  const bool fresh = places.take(newest);
  if (fresh) place = newest;
  std::string wanted;
  {
    const std::lock_guard lock(mutex);
    wanted = revision;
  }
  if (wanted != shown_revision) {
    drop();
    shown_revision = wanted;
    refused = false;
    retry_at = now;
  }
  if (connection != nullptr) {
    const auto held = connection;  // which tick() may drop
    held->tick(now, fresh);
  } else if (!wanted.empty() && !refused && now >= retry_at) {
    connection = std::make_shared<Connection>(*this, wanted);
    connection->begin();
  }
  timer.expires_after(kSendEvery);
  timer.async_wait([this](error_code) { tick(); });
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
