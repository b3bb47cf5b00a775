#include "device/usb/usb_recording.h"

#include "device/usb/internal/usb_recording_format.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <ostream>
#include <sstream>
#include <system_error>
#include <tuple>
#include <utility>

namespace filiform {

using internal::UsbEvent;
using internal::UsbRecord;

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

std::string_view asText(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::uint8_t outcomeOf(const UsbError& error) { return static_cast<std::uint8_t>(1 + static_cast<int>(error.cause())); }

}  // namespace

class UsbRecorder::Writer {
 public:
  Writer(std::ostream& to, std::size_t capacity) : out_(to) {
    recorded_.reserve(std::max<std::size_t>(capacity, 4096));
    internal::appendUsbHeader(recorded_);
  }

  void add(const UsbRecord& record, std::string_view bytes = {}) noexcept {
    if (finished_) return;
    // After the first loss nothing more is kept: traffic with a gap cannot be replayed.
    if (lost_ > 0 || !internal::appendUsbRecord(recorded_, count_, record, bytes)) {
      ++lost_;
    } else {
      ++count_;
    }
  }

  void finish() {
    if (std::exchange(finished_, true)) return;
    internal::appendUsbClosing(recorded_, count_);
    out_.write(recorded_.data(), static_cast<std::streamsize>(recorded_.size()));
    out_.flush();
    if (!out_) throw DeviceError("cannot write the recording");
    if (lost_ > 0)
      throw DeviceError("the recording holds the first " + std::to_string(count_) + " records; the " +
                        std::to_string(lost_) + " after them exceeded its capacity");
  }

  std::uint32_t connections = 0;

 private:
  std::ostream& out_;
  std::string recorded_;
  std::uint64_t count_ = 0, lost_ = 0;
  bool finished_ = false;
};

class RecordedTransfer;

class RecordedConnection : public UsbConnection {
 public:
  RecordedConnection(UsbRecorder::Writer& writer, std::uint32_t number, std::unique_ptr<UsbConnection> inner)
      : writer_(writer), number_(number), inner_(std::move(inner)) {
    transfers_.reserve(64);
  }

  const UsbDeviceInfo& info() const noexcept override { return inner_->info(); }
  bool gone() const noexcept override { return inner_->gone(); }
  double time_s() const noexcept override { return inner_->time_s(); }
  void release(std::uint8_t interface) noexcept override { inner_->release(interface); }

  void claim(std::uint8_t interface) override {
    UsbRecord record = begin(UsbEvent::claim, interface);
    attempt(record, [&] { inner_->claim(interface); });
  }
  std::size_t control(const UsbSetup& setup, std::span<std::uint8_t> data, double timeout_s) override {
    UsbRecord record = begin(UsbEvent::control, 0);
    record.setup = setup;
    std::size_t moved = 0;
    try {
      moved = inner_->control(setup, data, timeout_s);
    } catch (const UsbError& error) {
      record.outcome = outcomeOf(error);
      finish(record, setup.in() ? std::string_view() : asText(data));
      throw;
    }
    record.moved = static_cast<std::uint32_t>(moved);
    finish(record, asText(setup.in() ? data.first(moved) : data));
    return moved;
  }
  std::unique_ptr<UsbTransfer> makeTransfer(std::uint8_t endpoint, std::size_t capacity) override;
  bool handleEvents(double timeout_s) noexcept override {
    const bool any = inner_->handleEvents(timeout_s);
    note();
    return any;
  }

 private:
  friend class RecordedTransfer;
  UsbRecord begin(UsbEvent event, std::uint8_t endpoint) const {
    UsbRecord record;
    record.event = event;
    record.endpoint = endpoint;
    record.connection = number_;
    return record;
  }
  void finish(UsbRecord& record, std::string_view bytes) noexcept {
    record.time_s = inner_->time_s();
    writer_.add(record, bytes);
    note();
  }
  template <typename Call>
  void attempt(UsbRecord& record, const Call& call) {
    try {
      call();
    } catch (const UsbError& error) {
      record.outcome = outcomeOf(error);
      finish(record, {});
      throw;
    }
    finish(record, {});
  }
  void note() noexcept;  // records what has completed since

  UsbRecorder::Writer& writer_;
  std::uint32_t number_;
  std::unique_ptr<UsbConnection> inner_;
  std::vector<RecordedTransfer*> transfers_;
};

class RecordedTransfer : public UsbTransfer {
 public:
  RecordedTransfer(RecordedConnection& connection, std::uint8_t endpoint, std::unique_ptr<UsbTransfer> inner)
      : connection_(connection), endpoint_(endpoint), inner_(std::move(inner)) {
    connection_.transfers_.push_back(this);
  }
  ~RecordedTransfer() override {
    RecordedTransfer::cancel(kCancelTime_s);
    std::erase(connection_.transfers_, this);
  }
  RecordedTransfer(const RecordedTransfer&) = delete;
  RecordedTransfer& operator=(const RecordedTransfer&) = delete;

  std::span<std::uint8_t> buffer() noexcept override { return inner_->buffer(); }
  UsbStatus status() const noexcept override { return inner_->status(); }
  std::size_t actual() const noexcept override { return inner_->actual(); }

  bool submit(std::size_t length) noexcept override {
    // The buffer must not be read while the transfer is pending, so it is recorded before.
    UsbRecord record = connection_.begin(UsbEvent::submit, endpoint_);
    record.moved = static_cast<std::uint32_t>(length);
    record.time_s = connection_.time_s();
    const bool out = (endpoint_ & 0x80) == 0;
    sent_ = out ? inner_->buffer().first(std::min(length, inner_->buffer().size())) : std::span<std::uint8_t>();
    const bool started = inner_->submit(length);
    record.outcome = static_cast<std::uint8_t>(inner_->status());
    connection_.writer_.add(record, asText(sent_));
    in_flight_ = started;
    note();
    return started;
  }
  bool cancel(double patience_s) noexcept override {
    const bool over = inner_->cancel(patience_s);
    connection_.note();
    return over;
  }
  void note() noexcept {
    if (!in_flight_ || inner_->pending()) return;
    in_flight_ = false;
    UsbRecord record = connection_.begin(UsbEvent::complete, endpoint_);
    record.outcome = static_cast<std::uint8_t>(inner_->status());
    record.moved = static_cast<std::uint32_t>(inner_->actual());
    record.time_s = connection_.time_s();
    connection_.writer_.add(record, (endpoint_ & 0x80) != 0 ? asText(inner_->data()) : std::string_view());
  }

 private:
  RecordedConnection& connection_;
  std::uint8_t endpoint_;
  std::unique_ptr<UsbTransfer> inner_;
  std::span<std::uint8_t> sent_;
  bool in_flight_ = false;
};

void RecordedConnection::note() noexcept {
  for (RecordedTransfer* transfer : transfers_) transfer->note();
}

std::unique_ptr<UsbTransfer> RecordedConnection::makeTransfer(std::uint8_t endpoint, std::size_t capacity) {
  return std::make_unique<RecordedTransfer>(*this, endpoint, inner_->makeTransfer(endpoint, capacity));
}

UsbRecorder::UsbRecorder(UsbTransport& inner, std::ostream& out, std::size_t capacity)
    : inner_(inner), writer_(std::make_unique<Writer>(out, capacity)) {}

UsbRecorder::~UsbRecorder() {
  try {
    writer_->finish();
  } catch (const std::exception&) {
    // A destructor cannot report an error; finish() does.
  }
}

void UsbRecorder::finish() { writer_->finish(); }

std::vector<UsbDeviceInfo> UsbRecorder::devices() {
  std::vector<UsbDeviceInfo> all = inner_.devices();
  UsbRecord record;
  record.event = UsbEvent::devices;
  record.time_s = inner_.time_s();
  writer_->add(record, internal::encodeDevices(all));
  return all;
}

std::unique_ptr<UsbConnection> UsbRecorder::open(const UsbDeviceInfo& info) {
  UsbRecord record;
  record.event = UsbEvent::open;
  record.connection = writer_->connections++;
  try {
    std::unique_ptr<UsbConnection> inner = inner_.open(info);
    record.time_s = inner_.time_s();
    writer_->add(record, internal::encodeDevices({inner->info()}));
    return std::make_unique<RecordedConnection>(*writer_, record.connection, std::move(inner));
  } catch (const UsbError& error) {
    record.outcome = outcomeOf(error);
    record.time_s = inner_.time_s();
    writer_->add(record, internal::encodeDevices({info}));
    throw;
  }
}

struct UsbReplay::Traffic {
  struct Queue {  // records of one kind, on one endpoint
    std::vector<std::size_t> records;
    std::size_t next = 0;
    bool empty() const { return next == records.size(); }
  };
  using Key = std::tuple<UsbEvent, std::uint32_t, std::uint8_t>;

  Queue& queueOf(UsbEvent event, std::uint32_t connection = 0, std::uint8_t endpoint = 0) {
    return queues[Key(event, connection, endpoint)];
  }
  const UsbRecord& head(const Queue& queue) const { return records[queue.records[queue.next]]; }
  // Requires that the queue is not empty.
  const UsbRecord& take(Queue& queue) {
    const UsbRecord& record = records[queue.records[queue.next++]];
    time_s = std::max(time_s, record.time_s);
    return record;
  }
  static UsbError errorOf(const UsbRecord& record, const UsbDeviceInfo& info, const char* what) {
    const auto cause = static_cast<UsbCause>(record.outcome - 1);
    std::string text = describe(info) + ": " + what + " failed when this was recorded";
    if (cause == UsbCause::no_permission) (text += " for lack of permission: install ") += kUdevRule;
    return {cause, text};
  }

  std::vector<UsbRecord> records;
  std::map<Key, Queue> queues;
  double time_s = 0;
  std::size_t differing = 0;
};

class ReplayedTransfer;

class ReplayedConnection : public UsbConnection {
 public:
  ReplayedConnection(UsbReplay::Traffic& traffic, std::uint32_t number, UsbDeviceInfo info)
      : traffic_(traffic), number_(number), info_(std::move(info)) {
    pending_.reserve(64);
  }

  const UsbDeviceInfo& info() const noexcept override { return info_; }
  bool gone() const noexcept override { return gone_; }
  double time_s() const noexcept override { return traffic_.time_s; }
  void release(std::uint8_t) noexcept override {}

  void claim(std::uint8_t interface) override {
    const UsbRecord* record = next(UsbEvent::claim, interface);
    if (record == nullptr) throw ended();
    if (record->outcome != 0) throw UsbReplay::Traffic::errorOf(*record, info_, "a claim");
  }

  std::size_t control(const UsbSetup& setup, std::span<std::uint8_t> data, double) override {
    const UsbRecord* record = next(UsbEvent::control, 0);
    if (record == nullptr) throw ended();
    const UsbSetup& was = record->setup;
    if (std::tie(setup.request_type, setup.request, setup.value, setup.index) !=
        std::tie(was.request_type, was.request, was.value, was.index)) {
      ++traffic_.differing;
      throw UsbError(UsbCause::failed, describe(info_) + ": the recording has another request here");
    }
    if (!setup.in() && asText(data) != record->bytes) ++traffic_.differing;
    if (record->outcome != 0) throw UsbReplay::Traffic::errorOf(*record, info_, "a request");
    if (!setup.in()) return record->moved;
    const std::size_t moved = std::min(data.size(), record->bytes.size());
    std::copy_n(record->bytes.begin(), moved, data.begin());
    return moved;
  }

  std::unique_ptr<UsbTransfer> makeTransfer(std::uint8_t endpoint, std::size_t capacity) override;
  bool handleEvents(double timeout_s) noexcept override;

 private:
  friend class ReplayedTransfer;
  const UsbRecord* next(UsbEvent event, std::uint8_t endpoint) {
    UsbReplay::Traffic::Queue& queue = traffic_.queueOf(event, number_, endpoint);
    if (!queue.empty()) return &traffic_.take(queue);
    ++traffic_.differing;
    gone_ = true;
    return nullptr;
  }
  UsbError ended() const { return {UsbCause::gone, describe(info_) + ": the recording of this device ends here"}; }

  UsbReplay::Traffic& traffic_;
  std::uint32_t number_;
  UsbDeviceInfo info_;
  std::vector<ReplayedTransfer*> pending_;
  bool gone_ = false;
};

class ReplayedTransfer : public UsbTransfer {
 public:
  ReplayedTransfer(ReplayedConnection& connection, std::uint8_t endpoint, std::size_t capacity)
      : connection_(connection),
        submits_(connection.traffic_.queueOf(UsbEvent::submit, connection.number_, endpoint)),
        completes_(connection.traffic_.queueOf(UsbEvent::complete, connection.number_, endpoint)),
        in_((endpoint & 0x80) != 0),
        buffer_(capacity) {}
  ~ReplayedTransfer() override { ReplayedTransfer::cancel(0); }
  ReplayedTransfer(const ReplayedTransfer&) = delete;
  ReplayedTransfer& operator=(const ReplayedTransfer&) = delete;

  std::span<std::uint8_t> buffer() noexcept override { return buffer_; }
  UsbStatus status() const noexcept override { return status_; }
  std::size_t actual() const noexcept override { return actual_; }

  bool submit(std::size_t length) noexcept override {
    if (pending()) return false;
    UsbReplay::Traffic& traffic = connection_.traffic_;
    actual_ = 0;
    length_ = std::min(length, buffer_.size());
    if (submits_.empty()) {
      status_ = UsbStatus::gone;
      connection_.gone_ = true;
      return false;
    }
    const UsbRecord& record = traffic.take(submits_);
    const bool same = in_ ? record.moved == length : asText({buffer_.data(), length_}) == record.bytes;
    traffic.differing += same ? 0 : 1;
    status_ = static_cast<UsbStatus>(record.outcome);
    connection_.gone_ = connection_.gone_ || status_ == UsbStatus::gone;
    if (!pending()) return false;
    connection_.pending_.push_back(this);
    return true;
  }

  bool cancel(double) noexcept override {
    if (!pending()) return true;
    if (dueTime() <= connection_.traffic_.time_s) {
      complete();
      return true;
    }
    if (!completes_.empty() && isCancelled(connection_.traffic_.head(completes_)))
      connection_.traffic_.take(completes_);
    finish(UsbStatus::cancelled);
    return true;
  }

  double dueTime() const noexcept {
    const UsbReplay::Traffic& traffic = connection_.traffic_;
    if (completes_.empty()) return traffic.records.back().time_s;
    const UsbRecord& record = traffic.head(completes_);
    return isCancelled(record) ? kNever : record.time_s;
  }

  void complete() noexcept {
    if (completes_.empty()) return finish(UsbStatus::gone);
    const UsbRecord& record = connection_.traffic_.take(completes_);
    actual_ = in_ ? std::min(record.bytes.size(), length_) : record.moved;
    if (in_) std::copy_n(record.bytes.begin(), actual_, buffer_.begin());
    finish(in_ && record.bytes.size() > length_ ? UsbStatus::overflow : static_cast<UsbStatus>(record.outcome));
  }

  void finish(UsbStatus status) noexcept {
    std::erase(connection_.pending_, this);
    status_ = status;
    connection_.gone_ = connection_.gone_ || status == UsbStatus::gone;
  }

 private:
  static bool isCancelled(const UsbRecord& record) {
    return record.outcome == static_cast<std::uint8_t>(UsbStatus::cancelled);
  }

  ReplayedConnection& connection_;
  UsbReplay::Traffic::Queue& submits_;
  UsbReplay::Traffic::Queue& completes_;
  bool in_;
  std::vector<std::uint8_t> buffer_;
  std::size_t length_ = 0, actual_ = 0;
  UsbStatus status_ = UsbStatus::idle;
};

std::unique_ptr<UsbTransfer> ReplayedConnection::makeTransfer(std::uint8_t endpoint, std::size_t capacity) {
  for (const UsbInterface& interface : info_.interfaces)
    for (const UsbEndpoint& e : interface.endpoints)
      if (e.address == endpoint) return std::make_unique<ReplayedTransfer>(*this, endpoint, capacity);
  throw UsbError(UsbCause::failed, describe(info_) + ": no such endpoint");
}

bool ReplayedConnection::handleEvents(double timeout_s) noexcept {
  double until_s = traffic_.time_s + std::max(timeout_s, 0.0);
  for (const ReplayedTransfer* transfer : pending_) until_s = std::min(until_s, transfer->dueTime());
  traffic_.time_s = std::max(traffic_.time_s, until_s);
  bool any = false;
  for (std::size_t left = pending_.size(), i = 0; left > 0; --left) {
    if (pending_[i]->dueTime() <= traffic_.time_s) {
      pending_[i]->complete();
      any = true;
    } else {
      ++i;
    }
  }
  return any;
}

UsbReplay::UsbReplay(const std::string& path) : traffic_(std::make_unique<Traffic>()) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw DeviceError(path + ": cannot open the recording: " + std::generic_category().message(errno));
  std::ostringstream whole;
  if (in.peek() != std::ifstream::traits_type::eof()) whole << in.rdbuf();
  if (in.bad() || whole.bad()) throw DeviceError(path + ": cannot read the recording");
  traffic_->records = internal::readUsbRecording(path, whole.str());
  for (std::size_t i = 0; i < traffic_->records.size(); ++i) {
    const UsbRecord& record = traffic_->records[i];
    const bool common = record.event == UsbEvent::devices || record.event == UsbEvent::open;
    traffic_->queueOf(record.event, common ? 0 : record.connection, record.endpoint).records.push_back(i);
  }
  if (!traffic_->records.empty()) traffic_->time_s = traffic_->records.front().time_s;
}

UsbReplay::~UsbReplay() = default;

std::size_t UsbReplay::differing() const noexcept { return traffic_->differing; }

bool UsbReplay::finished() const noexcept {
  return std::all_of(traffic_->queues.begin(), traffic_->queues.end(),
                     [](const auto& entry) { return entry.second.empty(); });
}

double UsbReplay::time_s() const noexcept { return traffic_->time_s; }

void UsbReplay::pause(double seconds) noexcept { traffic_->time_s += std::max(seconds, 0.0); }

std::vector<UsbDeviceInfo> UsbReplay::devices() {
  Traffic::Queue& queue = traffic_->queueOf(UsbEvent::devices);
  if (queue.empty()) return {};
  return *internal::decodeDevices(traffic_->take(queue).bytes);
}

std::unique_ptr<UsbConnection> UsbReplay::open(const UsbDeviceInfo& info) {
  Traffic::Queue& queue = traffic_->queueOf(UsbEvent::open);
  if (queue.empty()) throw UsbError(UsbCause::not_found, describe(info) + ": the recording of this device ends here");
  const UsbRecord& record = traffic_->take(queue);
  UsbDeviceInfo opened = internal::decodeDevices(record.bytes)->front();
  if (!opened.samePlug(info)) {
    ++traffic_->differing;
    throw UsbError(UsbCause::not_found, describe(info) + ": the recording opens another device here");
  }
  if (record.outcome != 0) throw Traffic::errorOf(record, info, "opening");
  return std::make_unique<ReplayedConnection>(*traffic_, record.connection, std::move(opened));
}

}  // namespace filiform
