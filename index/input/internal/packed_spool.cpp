#include "index/input/internal/packed_spool.h"

#include "index/errors.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <lz4.h>
#include <unistd.h>
#include <vector>

namespace filiform::internal {
namespace {

constexpr std::size_t kSpoolPiece = std::size_t{1} << 16;

std::string spoolFolder() {
  const char* const folder = std::getenv("TMPDIR");
  return folder != nullptr && *folder != '\0' ? folder : "/tmp";
}

// A failure of the process, not of the archive.
IoError spoolFailure(int error) {
  return IoError(spoolFolder(),
                 "cannot hold the archive's content (the folder of temporary files: TMPDIR names another)", error)
      .asShortage();
}

}  // namespace

PackedSpool::~PackedSpool() {
  if (fd_ >= 0) ::close(fd_);
}

std::uint64_t PackedSpool::begin() {
  if (fd_ < 0) {
    std::string path = spoolFolder() + "/filiform-archive-XXXXXX";
    fd_ = ::mkostemp(path.data(), O_CLOEXEC);
    if (fd_ < 0) throw spoolFailure(errno);
    ::unlink(path.c_str());
  }
  block_.clear();
  return end_;
}

void PackedSpool::add(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::string_view some = bytes.substr(0, kSpoolPiece - block_.size());
    block_ += some;
    bytes.remove_prefix(some.size());
    if (block_.size() == kSpoolPiece) writeBlock();
  }
}

void PackedSpool::end() {
  if (!block_.empty()) writeBlock();
}

// A block on disk: the size of its packed bytes, as u32 of this machine, and these bytes.
void PackedSpool::writeBlock() {
  std::vector<char> packed(sizeof(std::uint32_t) + static_cast<std::size_t>(LZ4_compressBound(kSpoolPiece)));
  const int bytes = LZ4_compress_default(block_.data(), packed.data() + sizeof(std::uint32_t),
                                         static_cast<int>(block_.size()), LZ4_compressBound(kSpoolPiece));
  const auto stated = static_cast<std::uint32_t>(bytes);
  std::memcpy(packed.data(), &stated, sizeof stated);
  std::string_view left(packed.data(), sizeof stated + stated);
  while (!left.empty()) {
    const ssize_t n = ::pwrite(fd_, left.data(), left.size(), static_cast<off_t>(end_));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) throw spoolFailure(errno);
    left.remove_prefix(static_cast<std::size_t>(n));
    end_ += static_cast<std::uint64_t>(n);
  }
  block_.clear();
}

void PackedSpool::read(std::uint64_t place, std::uint64_t bytes, const Container::Reader::Sink& sink) const {
  std::vector<char> packed(static_cast<std::size_t>(LZ4_compressBound(kSpoolPiece))), block(kSpoolPiece);
  const auto fill = [&](char* to, std::size_t n) {
    while (n > 0) {
      const ssize_t got = ::pread(fd_, to, n, static_cast<off_t>(place));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) throw spoolFailure(got < 0 ? errno : EIO);
      to += got;
      n -= static_cast<std::size_t>(got);
      place += static_cast<std::uint64_t>(got);
    }
  };
  while (bytes > 0) {
    std::uint32_t stated = 0;
    fill(reinterpret_cast<char*>(&stated), sizeof stated);
    if (stated > packed.size()) throw spoolFailure(EIO);
    fill(packed.data(), stated);
    const int got =
        LZ4_decompress_safe(packed.data(), block.data(), static_cast<int>(stated), static_cast<int>(kSpoolPiece));
    if (got <= 0 || static_cast<std::uint64_t>(got) > bytes) throw spoolFailure(EIO);
    sink({block.data(), static_cast<std::size_t>(got)});
    bytes -= static_cast<std::uint64_t>(got);
  }
}

}  // namespace filiform::internal
