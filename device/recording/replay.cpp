#include "device/recording/replay.h"

#include "device/recording/internal/exchange_ring.h"
#include "device/recording/internal/recording_format.h"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <ostream>
#include <sstream>
#include <system_error>
#include <thread>
#include <utility>

namespace filiform {

namespace {

std::string printable(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte != 0x7f) {
      out += c;
    } else {
      char escaped[8];
      std::snprintf(escaped, sizeof escaped, "\\x%02x", byte);
      out += escaped;
    }
  }
  return out;
}

DeviceError systemFailure(const std::string& path, const std::string& what, int error_number) {
  return DeviceError(printable(path) + ": " + what + ": " + std::generic_category().message(error_number));
}

// The bytes of a recording, and its whole exchanges.
struct ReadRecording {
  std::string bytes;
  internal::RecordingHeader header;
  std::vector<internal::RecordedExchange> exchanges;
  std::size_t end = 0;  // of the last whole exchange
};

ReadRecording readRecording(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw systemFailure(path, "cannot open the recording", errno);
  std::ostringstream whole;
  if (in.peek() != std::ifstream::traits_type::eof()) whole << in.rdbuf();
  if (in.bad() || whole.bad()) throw DeviceError(printable(path) + ": cannot read the recording");
  ReadRecording read;
  read.bytes = std::move(whole).str();
  const std::string_view bytes = read.bytes;
  read.end = internal::readHeader(printable(path), bytes, read.header);
  const bool oriented = read.header.capabilities.senses_orientation;
  const std::size_t exchange_bytes = internal::exchangeBytes(oriented);
  read.exchanges.reserve((bytes.size() - read.end) / exchange_bytes);
  internal::RecordedExchange exchange;
  while (bytes.size() - read.end >= exchange_bytes &&
         internal::readExchange(bytes.substr(read.end), read.exchanges.size(), exchange, oriented)) {
    read.exchanges.push_back(exchange);
    read.end += exchange_bytes;
  }
  return read;
}

// Compares bits: -0 differs from 0, and a NaN equals itself.
bool sameBits(const RecordedForces& a, const Wrench& b) {
  // NOLINTBEGIN(bugprone-suspicious-memory-comparison)
  return std::memcmp(a.force_N.data(), b.force_N.data(), 3 * sizeof(double)) == 0 &&
         std::memcmp(a.torque_Nm.data(), b.torque_Nm.data(), 3 * sizeof(double)) == 0;
  // NOLINTEND(bugprone-suspicious-memory-comparison)
}

}  // namespace

struct RecordingDevice::Impl {
  using Exchange = internal::RecordedExchange;

  Impl(std::unique_ptr<HapticDevice> device, std::ostream& to, const RecordingOptions& with)
      : inner(std::move(device)), out(to), options(with), waiting(options.capacity) {}

  void write(const std::string& bytes) {
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.flush();
    if (!out) throw DeviceError("cannot write the recording");
  }

  // The functions below require the mutex.
  //
  // Empties the queue even after the file failed, so that no exchange counts as lost.
  void writeWaiting() {
    constexpr std::size_t kBatch = 1024;
    Exchange exchange;
    for (bool more = true; more;) {
      batch.clear();
      std::size_t taken = 0;
      while (taken < kBatch && (more = waiting.pop(exchange))) {
        internal::appendExchange(batch, written + taken, exchange, oriented);
        ++taken;
      }
      if (!writing) continue;
      write(batch);
      written += taken;
    }
  }

  void keepLast() noexcept {
    if (!has_last) return;
    has_last = false;
    // After the first loss nothing more is kept: a recording with a gap cannot be replayed.
    if (lost.load(std::memory_order_relaxed) > 0 || !waiting.push(last)) lost.fetch_add(1, std::memory_order_relaxed);
  }

  void drain() {
    try {
      writeWaiting();
    } catch (...) {
      writing = false;
      throw;
    }
  }

  void stopWriter() noexcept {
    if (!writer.joinable()) return;
    {
      const std::lock_guard lock(mutex);
      stop = true;
    }
    wake.notify_one();
    writer.join();
  }

  void runWriter() {
    std::unique_lock lock(mutex);
    while (!wake.wait_for(lock, std::chrono::milliseconds(5), [this] { return stop; })) {
      try {
        drain();
      } catch (...) {
        failure = std::current_exception();
        return;
      }
    }
  }

  std::unique_ptr<HapticDevice> inner;
  std::ostream& out;
  RecordingOptions options;
  // The last exchange, kept until no more marks can come. Used by the haptic thread, then by finish().
  Exchange last;
  bool has_last = false;
  internal::ExchangeRing<Exchange> waiting;  // from the haptic thread to the holder of the mutex
  std::atomic<std::uint64_t> lost{0};        // exchanges since the queue was first full
  std::atomic<bool> recording{false};

  std::mutex mutex;  // guards the stream and the reading end of the ring
  std::condition_variable wake;
  std::thread writer;
  bool stop = false;
  std::exception_ptr failure;            // of the writer thread
  bool writing = false, opened = false;  // the header is written, and no write has failed since
  bool whole = false;
  std::uint64_t written = 0;
  bool oriented = false;  // the device senses its orientation
  std::string batch;
};

RecordingDevice::RecordingDevice(std::unique_ptr<HapticDevice> inner, std::ostream& out,
                                 const RecordingOptions& options)
    : impl_(std::make_unique<Impl>(std::move(inner), out, options)) {
  if (impl_->inner == nullptr) throw DeviceError("recording: there is no device to record");
  if (options.capacity == 0) throw DeviceError("recording: the capacity must be at least 1");
}

RecordingDevice::~RecordingDevice() {
  close();
  try {
    finish();
  } catch (const std::exception&) {
    // A destructor cannot report an error; finish() does.
  }
}

HapticDevice& RecordingDevice::inner() noexcept { return *impl_->inner; }

const DeviceCapabilities& RecordingDevice::capabilities() const { return impl_->inner->capabilities(); }

DeviceStatus RecordingDevice::status() const noexcept { return impl_->inner->status(); }

void RecordingDevice::open() {
  Impl& d = *impl_;
  if (std::exchange(d.opened, true)) throw DeviceError("a recording can be opened only once");
  try {
    d.inner->open();
    std::string header;
    internal::appendHeader(
        header, {d.inner->capabilities(), d.inner->status(), d.options.marked, d.options.device, d.options.options});
    d.write(header);
    d.oriented = d.inner->capabilities().senses_orientation;
    d.writing = true;
    d.recording = true;
    if (d.options.writer_thread) d.writer = std::thread([&d] { d.runWriter(); });
  } catch (...) {
    d.recording = d.writing = false;
    d.inner->close();
    throw;
  }
}

void RecordingDevice::close() noexcept { impl_->inner->close(); }

DeviceState RecordingDevice::exchange(const Wrench& wrench) noexcept {
  Impl& d = *impl_;
  DeviceState state = d.inner->exchange(wrench);
  if (!state.sent_N) state.sent_N = wrench.force_N;  // as a replay will report it
  if (!d.recording.load(std::memory_order_relaxed)) return state;
  d.keepLast();
  d.last = {{wrench.force_N, wrench.torque_Nm}, state, {}};
  d.has_last = true;
  return state;
}

const char* RecordingDevice::advice() const noexcept { return impl_->inner->advice(); }

void RecordingDevice::relax() noexcept { impl_->inner->relax(); }

void RecordingDevice::lead(const Eigen::Vector3d& target_D) noexcept { impl_->inner->lead(target_D); }

void RecordingDevice::mark(const RunMarks& marks) noexcept { impl_->last.marks = marks; }

void RecordingDevice::drain() {
  const std::lock_guard lock(impl_->mutex);
  impl_->drain();
}

void RecordingDevice::finish() {
  Impl& d = *impl_;
  d.recording = false;
  d.stopWriter();
  const std::lock_guard lock(d.mutex);
  if (!d.writing) {
    if (d.failure) std::rethrow_exception(std::exchange(d.failure, nullptr));
    return;
  }
  d.drain();
  d.keepLast();
  d.drain();
  d.writing = false;
  std::string closing;
  internal::appendClosing(closing, d.written);
  d.write(closing);
  d.whole = true;
  if (const std::uint64_t lost = d.lost; lost > 0)
    throw DeviceError("the recording holds the first " + std::to_string(d.written) + " exchanges; the " +
                      std::to_string(lost) + " after them came faster than they were written");
}

bool RecordingDevice::whole() const noexcept { return impl_->whole; }

RecordingWords readRecordingWords(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw systemFailure(path, "cannot open the recording", errno);
  constexpr std::size_t kMostHeader = 1 << 20;
  std::string bytes(kMostHeader, '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (in.bad()) throw DeviceError(printable(path) + ": cannot read the recording");
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  internal::RecordingHeader header;
  internal::readHeader(printable(path), bytes, header);
  return {header.device, header.options};
}

std::size_t closeRecording(const std::string& path) {
  ReadRecording read = readRecording(path);
  std::size_t count = read.exchanges.size();
  const std::string_view after = std::string_view(read.bytes).substr(read.end);
  if (after.size() == internal::kClosingBytes && internal::isClosing(after, count)) return count;
  const std::size_t exchange_bytes = internal::exchangeBytes(read.header.capabilities.senses_orientation);
  for (; count > 0 && read.end + internal::kClosingBytes > read.bytes.size(); --count) read.end -= exchange_bytes;
  std::string closing;
  internal::appendClosing(closing, count);
  std::fstream out(path, std::ios::binary | std::ios::in | std::ios::out);
  out.seekp(static_cast<std::streamoff>(read.end));
  out << closing << std::flush;
  std::error_code error;
  if (out) std::filesystem::resize_file(path, read.end + closing.size(), error);
  if (!out || error) throw DeviceError(printable(path) + ": cannot close the recording");
  return count;
}

ReplayDevice::ReplayDevice(const std::string& path) {
  ReadRecording read = readRecording(path);
  const std::string file = printable(path);
  const std::string_view bytes = read.bytes;
  const std::size_t count = read.exchanges.size(), left = bytes.size() - read.end;
  const std::string place = std::to_string(read.end) + ", after " + std::to_string(count) + " whole exchanges";
  if (left < internal::kClosingBytes)
    throw DeviceError(file + ": cut short at byte " + std::to_string(bytes.size()) + ": no closing mark after " +
                      std::to_string(count) + " whole exchanges");
  if (left > internal::kClosingBytes && left < internal::exchangeBytes(read.header.capabilities.senses_orientation))
    throw DeviceError(file + ": cut short or damaged at byte " + place);
  if (left != internal::kClosingBytes || !internal::isClosing(bytes.substr(read.end), count))
    throw DeviceError(file + ": damaged at byte " + place + ": the checksum does not match");

  exchanges_ = std::move(read.exchanges);
  capabilities_ = read.header.capabilities;
  capabilities_.paces_loop = capabilities_.keeps_time = capabilities_.is_led = false;
  status_at_open_ = read.header.status_at_open;
  device_ = read.header.device;
  marked_ = read.header.marked;
}

void ReplayDevice::open() {
  next_ = 0;
  differing_wrenches_ = 0;
  marks_ = {};
  state_ = DeviceState();
  state_.status = exchanges_.empty() ? DeviceStatus::closed : status_at_open_;
}

void ReplayDevice::close() noexcept {
  next_ = exchanges_.size();
  state_.status = DeviceStatus::closed;
}

DeviceState ReplayDevice::exchange(const Wrench& wrench) noexcept {
  if (next_ == exchanges_.size()) {
    state_.status = DeviceStatus::closed;
    return state_;
  }
  const internal::RecordedExchange& exchange = exchanges_[next_++];
  if (!sameBits(exchange.wrench, wrench)) ++differing_wrenches_;
  state_ = exchange.state;
  marks_ = exchange.marks;
  return state_;
}

}  // namespace filiform
