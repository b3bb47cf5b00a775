#include "tools/serve/session/session_log.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>

namespace filiform::tools {

namespace {

constexpr std::string_view kLogMagic = "FILSESS1";
constexpr std::size_t kRecordHead = 12;         // tick, size
constexpr std::uint32_t kMostAbout = 64 << 10;  // bytes of JSON

std::string headOf(std::uint64_t tick, std::uint32_t size) {
  unsigned char head[kRecordHead];
  v1::put(head, tick, 8);
  v1::put(head + 8, size, 4);
  return {reinterpret_cast<const char*>(head), sizeof head};
}

}  // namespace

SessionLog::SessionLog(const std::string& path, const std::string& about) : output_(path) {
  output_.write(kLogMagic);
  output_.write(headOf(0, static_cast<std::uint32_t>(about.size())).substr(8));
  output_.write(about);
}

void SessionLog::note(std::uint64_t tick, std::span<const unsigned char> bytes) noexcept {
  LogRecord record;
  record.tick = tick;
  record.size = static_cast<std::uint32_t>(std::min(bytes.size(), record.bytes.size()));
  std::copy_n(bytes.begin(), record.size, record.bytes.begin());
  if (!noted_.push(record)) lost_.fetch_add(1, std::memory_order_relaxed);
}

void SessionLog::drain() {
  for (LogRecord record; noted_.pop(record);) {
    output_.write(headOf(record.tick, record.size));
    output_.write({reinterpret_cast<const char*>(record.bytes.data()), record.size});
  }
}

void SessionLog::finish() {
  drain();
  if (const std::uint64_t lost = lost_.load(); lost > 0)
    throw IoError(output_.path(), counted(lost, "frame") + " came faster than they could be written", 0);
  output_.write(headOf(UINT64_MAX, 0));
  output_.finish();
}

ReadLog readSessionLog(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw IoError(inShort(path), "cannot open the frames of the session", errno);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const auto damaged = [&](std::size_t at) {
    return InputError(inShort(path) + ": damaged or cut at byte " + std::to_string(at) + "; record the session again");
  };
  const auto* const raw = reinterpret_cast<const unsigned char*>(bytes.data());
  if (!bytes.starts_with(kLogMagic) || bytes.size() < 12) throw damaged(0);
  const std::size_t about = v1::get(raw + 8, 4);
  if (about > kMostAbout || bytes.size() - 12 < about) throw damaged(8);
  ReadLog log{bytes.substr(12, about), {}};
  for (std::size_t at = 12 + about;;) {
    if (bytes.size() - at < kRecordHead) throw damaged(at);
    LogRecord record;
    record.tick = v1::get(raw + at, 8);
    record.size = static_cast<std::uint32_t>(v1::get(raw + at + 8, 4));
    at += kRecordHead;
    if (record.tick == UINT64_MAX && record.size == 0 && at == bytes.size()) return log;
    if (record.size == 0 || record.size > record.bytes.size() || bytes.size() - at < record.size) throw damaged(at);
    std::copy_n(raw + at, record.size, record.bytes.begin());
    at += record.size;
    log.records.push_back(record);
  }
}

}  // namespace filiform::tools
