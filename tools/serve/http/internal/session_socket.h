// SessionSocket: a WebSocket that speaks filiform.v1 through a SessionClient. Included by server.cpp alone, because it
// needs Boost.Asio. Thread rule: the thread of the server's io_context; its AnswerLine makes the answers.
#pragma once

#include "tools/serve/http/answer_line.h"
#include "tools/serve/http/client_address.h"
#include "tools/serve/http/internal/server_socket.h"
#include "tools/serve/session/session_client.h"

#include <atomic>
#include <deque>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace filiform::tools::internal {

// What the sockets share.
struct SessionHall : SocketSet {
  SessionHall(boost::asio::io_context& i, AnswerLine& l) : SocketSet(i), line(l) {}
  AnswerLine& line;
  SessionHouse* house = nullptr;  // nullptr: there are no sessions
  std::string version = {};
  std::atomic<bool> woken{false};  // a call of pump() for all waits
};

class SessionSocket : public ServerSocket {
 public:
  SessionSocket(SocketOrigin origin, SessionHall& hall)
      : ServerSocket(std::move(origin), hall, session_limits::kFrameBytes),
        hall_(hall),
        client_(std::make_shared<SessionClient>(*hall.house, hall.version, person())) {}

  void pump() override {
    ask();
    if (isSending() || isClosing()) return;
    if (texts_.empty() && frames_.empty())
      client_->takeFrames([this](std::span<const unsigned char> bytes) {
        frames_.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
      });
    const bool is_text = !texts_.empty();
    std::deque<std::string>& queue = is_text ? texts_ : frames_;
    if (queue.empty()) return;
    send(queue.front(), is_text);
    queue.pop_front();
  }

 private:
  static constexpr std::size_t kMostAsked = 16, kMostTexts = 8;  // of requests, of answers that wait

  void accepted() override {}

  void take(std::string_view message, bool is_text) override {
    if (is_text) {
      if (asked_.size() >= kMostAsked) return refuse({CloseCode::policy, "more than 16 requests wait"});
      asked_.emplace_back(message);
      ask();
    } else if (const auto refused =
                   client_->receive({reinterpret_cast<const unsigned char*>(message.data()), message.size()})) {
      refuse(*refused);
    } else {
      pump();  // an acknowledgement may let a frame go
    }
  }

  void silent() override { refuse({CloseCode::policy, "no frame for 60 s"}); }

  void tend() override {
    for (std::string& note : client_->takeNotes())
      if (texts_.size() < kMostTexts) texts_.push_back(std::move(note));
    pump();
  }

  void refuse(const SessionRefusal& why) { close(static_cast<unsigned>(why.code), why.reason); }

  // Has the next request answered, unless answers wait to be sent.
  void ask() {
    if (answering_ || isClosing() || asked_.empty() || texts_.size() >= kMostTexts) return;
    answering_ = true;
    std::string text = std::move(asked_.front());
    asked_.pop_front();
    hall_.line.add(share(), [self = self(), text = std::move(text)] {
      std::string answer = self->client_->answer(text);
      post(self->hall_.io, [self, answer = std::move(answer)]() mutable {
        self->answering_ = false;
        if (self->hasEnded()) return self->ended();
        if (!answer.empty()) self->texts_.push_back(std::move(answer));
        if (const auto refused = self->client_->refusal()) return self->refuse(*refused);
        self->pump();
      });
    });
  }

  // The end of a recording may wait for the disk. No answer is made any more, because one worker makes the answers of
  // a socket at a time.
  void ended() override {
    if (!answering_) hall_.line.add(share(), [client = client_] { client->close(); });
  }

  std::string share() const { return workShareOf(clientAddress(), person().get()); }
  std::shared_ptr<SessionSocket> self() { return std::static_pointer_cast<SessionSocket>(shared_from_this()); }

  SessionHall& hall_;
  const std::shared_ptr<SessionClient> client_;
  std::deque<std::string> asked_, texts_, frames_;
  bool answering_ = false;
};

// Called by the ticking thread: the sockets send what they have. Posts at most one call at a time.
inline void wake(SessionHall& hall) {
  if (hall.woken.exchange(true)) return;
  post(hall.io, [&hall] {
    hall.woken = false;
    for (const auto& socket : std::set(hall.sockets)) socket->pump();
  });
}

}  // namespace filiform::tools::internal
