// TcpWire: the TCP connection of a client, with a time limit that its owner checks. Its callbacks are std::function and
// its executor has a plain type, so that Boost.Asio's templates are compiled once. Included by server.cpp alone. Thread
// rule: the thread of the server's io_context.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <string_view>
#include <utility>

#include <boost/asio/basic_stream_socket.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>

namespace filiform::tools::internal {

using Job = std::function<void()>;

inline void post(boost::asio::io_context& io, Job job) { boost::asio::post(io, std::move(job)); }

class TcpWire {
 public:
  using ErrorCode = boost::system::error_code;
  using Clock = std::chrono::steady_clock;
  using Executor = boost::asio::io_context::executor_type;
  using Socket = boost::asio::basic_stream_socket<boost::asio::ip::tcp, Executor>;
  // Called at the end of the work, also after close(). It must keep the owner of the wire alive.
  using Done = std::function<void(ErrorCode error, std::size_t bytes)>;

  explicit TcpWire(Socket socket) : socket_(std::move(socket)) {}

  Socket& socket() { return socket_; }
  void close() {
    ErrorCode ignored;
    socket_.close(ignored);
  }

  // The time limit of what is read and written from now on.
  void expireAfter(Clock::duration time) { limit_ = Clock::now() + time; }
  void expireNever() { limit_ = Clock::time_point::max(); }
  // True if something is being read or written after the limit. The owner then closes the wire.
  bool isLate(Clock::time_point now) const { return works_ > 0 && now >= limit_; }

  // Reads what comes.
  void read(const boost::asio::mutable_buffer& into, Done done) {
    ++works_;
    socket_.async_read_some(into, [this, done = std::move(done)](ErrorCode error, std::size_t bytes) {
      --works_;
      done(error, bytes);
    });
  }

  // Writes both texts, which must live until `done`.
  void write(std::string_view first, std::string_view second, Done done) {
    ++works_;
    const std::array<boost::asio::const_buffer, 2> parts{boost::asio::buffer(first.data(), first.size()),
                                                         boost::asio::buffer(second.data(), second.size())};
    socket_.async_write_some(parts,
                             [this, first, second, done = std::move(done)](ErrorCode error, std::size_t bytes) mutable {
                               --works_;
                               if (error || bytes == first.size() + second.size()) return done(error, bytes);
                               const std::size_t of_first = std::min(bytes, first.size());
                               write(first.substr(of_first), second.substr(bytes - of_first), std::move(done));
                             });
  }

 private:
  Socket socket_;
  int works_ = 0;
  Clock::time_point limit_ = Clock::time_point::max();
};

}  // namespace filiform::tools::internal
