#include "index/hdf5/program/record_pipe.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <unistd.h>

#include <xxhash.h>

namespace filiform::hdf5 {
namespace {

// False at the end of the input before the first byte.
bool readFully(void* to, std::size_t bytes) {
  auto* at = static_cast<char*>(to);
  for (std::size_t got = 0; got < bytes;) {
    const ssize_t n = ::read(STDIN_FILENO, at + got, bytes - got);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      if (got == 0 && n == 0) return false;
      std::exit(1);
    }
    got += static_cast<std::size_t>(n);
  }
  return true;
}

void writeFully(const void* from, std::size_t bytes) {
  const auto* at = static_cast<const char*>(from);
  while (bytes > 0) {
    const ssize_t n = ::write(STDOUT_FILENO, at, bytes);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) std::exit(1);
    at += n;
    bytes -= static_cast<std::size_t>(n);
  }
}

bool readU32(std::uint32_t& value) {
  unsigned char bytes[4];
  if (!readFully(bytes, 4)) return false;
  value = bytes[0] | bytes[1] << 8 | bytes[2] << 16 | static_cast<std::uint32_t>(bytes[3]) << 24;
  return true;
}

}  // namespace

bool RecordPipe::readRequest(std::vector<std::string>& request) {
  request.clear();
  std::uint32_t texts = 0;
  if (!readU32(texts)) return false;
  if (texts > kMostTexts) std::exit(1);
  for (std::uint32_t i = 0; i < texts; ++i) {
    std::uint32_t bytes = 0;
    if (!readU32(bytes) || bytes > kMostTextBytes) std::exit(1);
    std::string text(bytes, '\0');
    if (bytes > 0 && !readFully(text.data(), bytes)) std::exit(1);
    request.push_back(std::move(text));
  }
  return true;
}

bool RecordPipe::readBlock(std::string& block) {
  std::uint32_t bytes = 0;
  if (!readU32(bytes) || bytes > kMostPayload) std::exit(1);
  block.resize(bytes);
  if (bytes > 0 && !readFully(block.data(), bytes)) std::exit(1);
  return bytes > 0;
}

void RecordPipe::putU32(std::string& out, std::uint32_t value) {
  for (int i = 0; i < 4; ++i) out += static_cast<char>(value >> (8 * i));
}

void RecordPipe::putU64(std::string& out, std::uint64_t value) {
  for (int i = 0; i < 8; ++i) out += static_cast<char>(value >> (8 * i));
}

void RecordPipe::putText(std::string& out, const std::string& text) {
  putU32(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

void RecordPipe::send(RecordKind kind, const void* payload, std::size_t bytes) {
  std::string head;
  putU32(head, static_cast<std::uint32_t>(kind));
  putU32(head, static_cast<std::uint32_t>(bytes));
  putU64(head, XXH3_64bits_withSeed(payload, bytes, static_cast<std::uint64_t>(kind)));
  writeFully(head.data(), head.size());
  writeFully(payload, bytes);
  last_ = std::chrono::steady_clock::now();
}

void RecordPipe::alive() {
  if (std::chrono::steady_clock::now() - last_ > std::chrono::seconds(1)) send(RecordKind::names, nullptr, 0);
}

void RecordPipe::sendAll(RecordKind kind, const void* bytes, std::size_t count, std::size_t unit) {
  const std::size_t most = (std::size_t{1} << 20) / unit * unit;
  for (std::size_t at = 0; at < count; at += most)
    send(kind, static_cast<const char*>(bytes) + at, std::min(most, count - at));
}

}  // namespace filiform::hdf5
