// Connection: one client of the server: reads a request, has it answered, sends the answer, and so on. Included by
// server.cpp alone, because it needs Boost.Beast. Thread rule: the thread of the server's io_context, except where
// stated.
#pragma once

#include "index/set/tile_set.h"
#include "index/text.h"
#include "tools/serve/http/answer_head.h"
#include "tools/serve/http/internal/hall.h"
#include "tools/serve/http/internal/unread_request.h"
#include "tools/serve/http/log_entry.h"
#include "tools/serve/routes/desk_answer.h"
#include "tools/serve/routes/routes.h"
#include "tools/serve/routes/session_request.h"
#include "tools/serve/sets/limits.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <memory>
#include <optional>
#include <poll.h>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/read_size.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

namespace filiform::tools::internal {

namespace beast = boost::beast;
namespace http = boost::beast::http;
using boost::system::error_code;

inline constexpr std::size_t kPieceBytes = 256 << 10;
inline constexpr std::uint64_t kMostAnswersBytes = std::uint64_t{512} << 20;  // of answers in memory, of all clients
inline constexpr std::uint64_t kShareBytes = std::uint64_t{128} << 20;        // of one client
inline constexpr std::uint64_t kLargeBytes = std::uint64_t{1} << 20;  // smaller answers are sent beyond these limits
inline constexpr double kMostWait_s = 30;                             // in the line
inline constexpr std::size_t kMostId = 64;                            // of a proxy's id of a request
inline constexpr double kWrongToken_s = 1;                            // after many wrong ones
inline constexpr double kCrowded_s = 2;                               // for a request that comes beyond --max-clients
inline constexpr double kLeastBytes_s = 64 << 10;                     // of a client that reads an answer, on average
inline constexpr double kLinger_s = 2;  // for a client to read the last answer before the connection ends
inline constexpr std::size_t kLingerBytes = 32 << 20;  // of an unread body

// The headers that routes read.
inline constexpr std::array<std::string_view, 18> kReadHeaders{"host",
                                                               "origin",
                                                               "authorization",
                                                               "cookie",
                                                               "accept",
                                                               "accept-encoding",
                                                               "content-type",
                                                               "content-encoding",
                                                               "range",
                                                               "if-range",
                                                               "if-none-match",
                                                               "x-forwarded-for",
                                                               "x-forwarded-proto",
                                                               "x-request-id",
                                                               "sec-fetch-site",
                                                               "sec-fetch-mode",
                                                               "sec-fetch-dest",
                                                               "sec-websocket-protocol"};

// No blanks, which would part it in the log.
inline bool isUserName(std::string_view text) {
  constexpr std::size_t kMost = 128;
  return !text.empty() && text.size() <= kMost &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return c > ' ' && c != 0x7f; });
}

class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(TcpWire::Socket socket, Hall& hall) : hall_(hall), metrics_(hall.metrics), wire_(std::move(socket)) {
    error_code ignored;
    const auto peer = wire_.socket().remote_endpoint(ignored);
    peer_ = peer.address().to_string(ignored);
    setClient(peer_);
    wire_.socket().set_option(tcp::no_delay(true), ignored);
    ++metrics_.connections;
  }
  ~Connection() { --metrics_.connections; }

  bool isIdle() const { return idle_; }
  bool hasRequest() const { return has_request_; }  // a whole one, whose answer is not yet sent
  Clock::time_point since() const { return has_request_ ? began_ : waits_since_; }
  const std::string& share() const { return share_; }
  // True if the client ended the connection while its request is in work.
  bool hasLeft() {
    if (!in_work_) return false;
    ::pollfd file{wire_.socket().native_handle(), POLLRDHUP, 0};
    return ::poll(&file, 1, 0) == 1 && (file.revents & (POLLRDHUP | POLLHUP | POLLERR)) != 0;
  }
  bool isLate(Clock::time_point now) const { return wire_.isLate(now); }

  void waitForRequest() {
    if (hall_.stopping && buffer_.size() == 0) return close();
    parser_.emplace();
    parser_->header_limit(limits::kHeaderBytes);
    parser_->body_limit(limits::kBodyBytes);
    reads_body_ = false;
    request_ = {};
    id_.clear();
    has_request_ = false;
    waits_since_ = Clock::now();
    if (buffer_.size() > 0) return readHeader();
    idle_ = true;
    wire_.expireAfter(steadySeconds(hall_.options.idle_s));
    readSome(4096, [](Connection& self) {
      self.idle_ = false;
      self.readHeader();
    });
  }

  // Reads a request, although there are too many clients: one that needs no place in the line is answered.
  void waitCrowded() {
    crowded_ = true;
    waitForRequest();
    wire_.expireAfter(steadySeconds(std::min(kCrowded_s, hall_.options.header_s)));
  }

  // Sends one answer and ends the connection.
  void turnAway(Answer answer) {
    began_ = Clock::now();
    keep_ = false;
    send({std::move(answer)});
  }

  void close() {
    *left_ = true;
    releaseAnswer();
    wire_.close();
    hall_.endOf(shared_from_this());
  }

 private:
  using Next = void (*)(Connection& self);

  // Reads what comes into the buffer, then calls `next`. Ends the connection after an error.
  void readSome(std::size_t most, Next next) {
    wire_.read(buffer_.prepare(most), [self = shared_from_this(), next](error_code error, std::size_t bytes) {
      if (error) return self->close();
      self->buffer_.commit(bytes);
      next(*self);
    });
  }

  // Writes the head and these bytes, then calls `next`. Ends the connection after an error.
  void write(std::string_view bytes, Next next) {
    wire_.write(head_, bytes, [self = shared_from_this(), next](error_code error, std::size_t) {
      error ? self->close() : next(*self);
    });
  }

  void setClient(const std::string& address) {
    client_ = address;
    share_ = work_share_ = shareOf(address);
  }

  void readHeader() {
    wire_.expireAfter(steadySeconds(crowded_ ? std::min(kCrowded_s, hall_.options.header_s) : hall_.options.header_s));
    parse();
  }

  void readBody() {
    wire_.expireAfter(steadySeconds(hall_.options.body_s));
    reads_body_ = true;
    parser_->eager(true);
    parse();
  }

  // Parses what has come; reads on until the header, or then the body, is there.
  void parse() {
    while (reads_body_ ? !parser_->is_done() : !parser_->is_header_done()) {
      error_code error = http::error::need_more;
      if (buffer_.size() > 0) buffer_.consume(parser_->put(buffer_.data(), error));
      if (error == http::error::need_more)
        return readSome(beast::read_size(buffer_, 65536), [](Connection& self) { self.parse(); });
      if (!error) continue;
      const unsigned status = statusOf(error);
      return status == 0 ? close() : turnAway(problem(status, detailOf(status)));
    }
    reads_body_ ? answer() : judgeHead();
  }

  // Copies the head. Returns why it is wrong; nullptr: it is right. Two ids are none.
  const char* copyHead() {
    const auto& head = parser_->get();
    const bool is_proxy = hall_.proxies.has(peer_);
    request_.method = std::string(head.method_string());
    request_.target = std::string(head.target());
    for (const auto& field : head) {
      std::string name(field.name_string());
      for (char& c : name) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
      if (is_proxy && name == hall_.options.user_header) {  // from all others, it is not read
        if (field.value().empty()) continue;
        if (!request_.user.empty()) return "the proxy names two users";
        request_.user = std::string(field.value());
        if (!isUserName(request_.user)) return "the proxy's name of the user must have 1 to 128 bytes without blanks";
        continue;
      }
      if (std::find(kReadHeaders.begin(), kReadHeaders.end(), name) == kReadHeaders.end()) continue;
      const auto [header, fresh] = request_.headers.emplace(name, std::string(field.value()));
      if (fresh) continue;
      if (name == "x-request-id") {
        header->second.clear();
        continue;
      }
      if (name != "x-forwarded-for") return "a header is given twice";
      header->second += ',' + std::string(field.value());
    }
    setClient(hall_.proxies.clientOf(peer_, request_.header("x-forwarded-for")));
    request_.client = share_;
    const std::string_view id = is_proxy ? request_.header("x-request-id") : std::string_view();
    constexpr std::string_view kOfIds = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz._-";
    const bool is_plain = id.find_first_not_of(kOfIds) == std::string_view::npos;
    id_ = id.empty() || id.size() > kMostId || !is_plain ? hall_.start + '-' + std::to_string(++hall_.requests)
                                                         : std::string(id);
    request_.is_tls = is_proxy && request_.header("x-forwarded-proto") == "https";
    return nullptr;
  }

  void judgeHead() {
    began_ = Clock::now();
    keep_ = parser_->keep_alive() && !crowded_;
    const bool body_follows = !parser_->is_done();
    if (const char* const wrong = copyHead()) return turnAway(problem(400, wrong));
    auto refused = hall_.routes.refuse(request_);
    if (!request_.capability) work_share_ = workShareOf(client_, request_.person.get());  // a link may be in many hands
    if (!refused && crowded_ && !hall_.routes.isShort(request_))
      return turnAway(problem(503, "too many clients; ask again"));
    if (refused) {
      keep_ = keep_ && !body_follows;
      if (refused->answer.status != 429) return send(std::move(*refused));
      // Whoever tries tokens waits for each answer.
      wire_.expireNever();
      pause_.emplace(hall_.io, steadySeconds(kWrongToken_s));
      return pause_->async_wait([self = shared_from_this(), routed = std::move(*refused)](error_code) mutable {
        self->send(std::move(routed));
      });
    }
    if (isSession(request_) && boost::beast::websocket::is_upgrade(parser_->get())) return becomeSession();
    const auto desk = hall_.options.desks == nullptr ? std::nullopt : deskRequest(request_);
    if (desk && boost::beast::websocket::is_upgrade(parser_->get())) return becomeDesk(*desk);
    if (!body_follows) return answer();
    const auto expected = parser_->get()[http::field::expect];
    if (expected.empty()) return readBody();
    if (!beast::iequals(expected, "100-continue")) return turnAway(problem(417, "only Expect: 100-continue is known"));
    static constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
    write(kContinue, [](Connection& self) { self.readBody(); });
  }

  static Answer otherVersion() {
    Answer answer = problem(426, "WebSockets of version 13 only");
    answer.headers.emplace_back("Sec-WebSocket-Version", "13");
    return answer;
  }

  // True if the request cannot become a WebSocket; the answer is then on its way.
  bool refuseUpgrade() {
    if (hall_.stopping)
      turnAway(problem(503, "the server ends"));
    else if (hall_.socketsOf(share_) >= std::max<std::size_t>(1, hall_.options.most_clients / 2))
      turnAway(problem(503, "your address has half of all connections as WebSockets; close one"));
    else if (buffer_.size() > 0)
      turnAway(problem(400, "wait for the answer to the upgrade before you send"));
    else if (parser_->get()[http::field::sec_websocket_version] != "13")
      turnAway(otherVersion());
    else if (const std::size_t key = parser_->get()[http::field::sec_websocket_key].size(); key == 0 || key > 24)
      turnAway(problem(400, "Sec-WebSocket-Key has 24 characters"));
    else
      return false;
    return true;
  }

  void becomeDesk(const DeskRequest& desk) {
    if (refuseUpgrade()) return;
    const auto refused = refuseRoom(*hall_.options.desks, desk.room, request_.person.get());
    std::make_shared<DeskSocket>(origin(), hall_.desks, desk.room, desk.role, refused)->begin();
    hall_.endOf(shared_from_this());
  }

  // The socket goes on as a WebSocket.
  void becomeSession() {
    if (hall_.sessions.house == nullptr) return turnAway(problem(404, "this server has no sessions"));
    if (refuseUpgrade()) return;
    // Of the subprotocols, only filiform.v1 is repeated: another may be a token.
    const auto offered = http::token_list(parser_->get()[http::field::sec_websocket_protocol]);
    const bool named = std::find(offered.begin(), offered.end(), "filiform.v1") != offered.end();
    std::make_shared<SessionSocket>(origin(), hall_.sessions)->begin(named ? "filiform.v1" : "");
    hall_.endOf(shared_from_this());
  }

  SocketOrigin origin() {
    return {std::move(wire_), std::string(parser_->get()[http::field::sec_websocket_key]), client_,
            redacted(request_.target), request_.person};
  }

  void answer() {
    has_request_ = true;
    wire_.expireNever();
    request_.body = std::move(parser_->get().body());
    if (hall_.routes.isShort(request_)) return send(hall_.routes.answer(request_));
    if (const auto own = hall_.share_bytes.find(work_share_);
        own != hall_.share_bytes.end() && own->second > kShareBytes)
      return send(
          {problem(503, "more than 128 MiB of answers are still being sent to you; read them, then ask again")});
    in_work_ = true;
    addJob([self = shared_from_this(), added = Clock::now()] {
      if (*self->left_) return void(++self->metrics_.left_answers);
      const double waited_s = std::chrono::duration<double>(Clock::now() - added).count();
      Routed routed = waited_s > kMostWait_s
                          ? Routed{problem(503, "the question waited in the line for more than 30 s; ask again")}
                          : self->hall_.routes.answer(self->request_, &*self->left_);
      post(self->hall_.io, [self, routed = std::move(routed)]() mutable {
        if (*self->left_) return void(++self->metrics_.left_answers);
        self->in_work_ = false;
        self->hold(routed);
        self->send(std::move(routed));
      });
    });
  }

  // Into the line of the client, from which requests go whose client has left.
  void addJob(AnswerLine::Job job) { metrics_.left_answers += hall_.line.add(work_share_, std::move(job), left_); }

  // Counts a large answer, which is refused if those of all clients are too many.
  void hold(Routed& routed) {
    const std::uint64_t bytes = routed.answer.body.size();
    if (bytes <= kLargeBytes) return;
    if (metrics_.answer_bytes + bytes > kMostAnswersBytes) {
      routed.answer =
          problem(503, "more than 512 MiB of large answers are being sent to clients; ask for less, or ask again");
      return;
    }
    held_ = bytes;
    metrics_.answer_bytes += bytes;
    hall_.share_bytes[work_share_] += bytes;
  }

  void send(Routed routed) {
    routed_ = std::move(routed);
    if (hall_.stopping) keep_ = false;
    if (!id_.empty()) routed_.answer.headers.emplace_back("X-Request-Id", id_);
    head_ = answerHead(routed_.answer, keep_, std::time(nullptr));
    sent_ = 0;
    sending_ = Clock::now();
    to_send_ = request_.method == "HEAD" ? 0 : routed_.answer.contentBytes();
    sendPiece();
  }

  void sendPiece() {
    const double taken_s = std::chrono::duration<double>(Clock::now() - sending_).count();
    if (taken_s > hall_.options.piece_s + static_cast<double>(sent_) / kLeastBytes_s) return close();
    const auto bytes = static_cast<std::size_t>(std::min<std::uint64_t>(to_send_ - sent_, kPieceBytes));
    if (!routed_.answer.file || bytes == 0) return writePiece(routed_.answer.body.data() + sent_, bytes);
    addJob([self = shared_from_this(), bytes] {
      if (*self->left_) return void(++self->metrics_.left_answers);
      const FileRange& range = *self->routed_.answer.file;
      self->piece_.resize(bytes);
      bool read = true;
      try {
        range.set->read(range.file, range.first + self->sent_, self->piece_);
      } catch (const std::exception&) {
        read = false;  // the client sees that the content is cut
      }
      post(self->hall_.io, [self, read, bytes] {
        if (!read) return self->close();
        self->writePiece(reinterpret_cast<const char*>(self->piece_.data()), bytes);
      });
    });
  }

  // The head goes with the first piece.
  void writePiece(const char* data, std::size_t bytes) {
    wire_.expireAfter(steadySeconds(hall_.options.piece_s));
    piece_bytes_ = bytes;
    write({data, bytes}, [](Connection& self) {
      self.head_.clear();
      self.sent_ += self.piece_bytes_;
      self.sent_ < self.to_send_ ? self.sendPiece() : self.finishAnswer();
    });
  }

  void finishAnswer() {
    const double seconds = std::chrono::duration<double>(Clock::now() - began_).count();
    const Person* const person = request_.person.get();
    metrics_.count(routed_.route, routed_.answer.status, seconds, request_.body.size(), sent_,
                   person != nullptr ? person->entry : "");
    if (hall_.options.log && (routed_.answer.status != 200 || !hall_.routes.isShort(request_)))
      hall_.options.log({std::time(nullptr), client_, request_.method.empty() ? "-" : request_.method,
                         request_.target.empty() ? "-" : request_.target, routed_.answer.status, sent_, seconds, id_,
                         person != nullptr ? person->name : request_.user});
    releaseAnswer();
    routed_ = {};
    if (keep_) return waitForRequest();
    linger();
  }

  // If the connection ended with data unread, the client might lose the answer.
  void linger() {
    error_code ignored;
    wire_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    wire_.expireAfter(steadySeconds(kLinger_s));
    has_request_ = false;
    waits_since_ = Clock::now();
    discarded_ = 0;
    buffer_.clear();
    discard();
  }
  void discard() {
    discarded_ += buffer_.size();
    buffer_.clear();
    if (discarded_ > kLingerBytes) return close();
    readSome(kPieceBytes, [](Connection& self) { self.discard(); });
  }

  void releaseAnswer() {
    if (held_ == 0) return;
    metrics_.answer_bytes -= held_;
    const auto own = hall_.share_bytes.find(work_share_);
    if ((own->second -= held_) == 0) hall_.share_bytes.erase(own);
    held_ = 0;
  }

  Hall& hall_;
  Metrics& metrics_;
  TcpWire wire_;
  beast::flat_buffer buffer_;
  std::string peer_, client_;       // addresses
  std::string share_, work_share_;  // under which connections are counted; and memory and work
  std::string id_;                  // of the request
  const std::shared_ptr<std::atomic<bool>> left_ =
      std::make_shared<std::atomic<bool>>(false);  // the client; any thread
  std::optional<http::request_parser<http::string_body>> parser_;
  Request request_;
  Routed routed_;
  std::optional<Timer> pause_;
  std::string head_;
  std::vector<std::uint8_t> piece_;
  std::size_t piece_bytes_ = 0, discarded_ = 0;
  std::uint64_t sent_ = 0, to_send_ = 0, held_ = 0;  // held_: counted in Metrics::answer_bytes
  bool keep_ = false, idle_ = false, reads_body_ = false, has_request_ = false, in_work_ = false, crowded_ = false;
  Clock::time_point began_{}, sending_{}, waits_since_{};
};

}  // namespace filiform::tools::internal
