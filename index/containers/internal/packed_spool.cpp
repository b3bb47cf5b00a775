#include "index/containers/internal/packed_spool.h"

#include <cerrno>
#include <cstring>
#include <lz4.h>
#include <vector>

namespace filiform::internal {
namespace {

constexpr std::size_t kSpoolPiece = std::size_t{1} << 16;

}  // namespace

std::uint64_t PackedSpool::begin() {
  file_.create();
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
  file_.write(end_, packed.data(), sizeof stated + stated);
  end_ += sizeof stated + stated;
  block_.clear();
}

void PackedSpool::read(std::uint64_t place, std::uint64_t bytes, const Container::Reader::Sink& sink) const {
  std::vector<char> packed(static_cast<std::size_t>(LZ4_compressBound(kSpoolPiece))), block(kSpoolPiece);
  const auto fill = [&](char* to, std::size_t n) {
    file_.read(place, to, n);
    place += n;
  };
  while (bytes > 0) {
    std::uint32_t stated = 0;
    fill(reinterpret_cast<char*>(&stated), sizeof stated);
    if (stated > packed.size()) file_.failReading(EIO);
    fill(packed.data(), stated);
    const int got =
        LZ4_decompress_safe(packed.data(), block.data(), static_cast<int>(stated), static_cast<int>(kSpoolPiece));
    if (got <= 0 || static_cast<std::uint64_t>(got) > bytes) file_.failReading(EIO);
    sink({block.data(), static_cast<std::size_t>(got)});
    bytes -= static_cast<std::uint64_t>(got);
  }
}

}  // namespace filiform::internal
