#include "index/set/internal/pack_writer.h"

#include "index/errors.h"

#include <utility>

namespace filiform::internal {

void PackWriter::endPack() {
  if (pack_ == nullptr) return;
  pack_->close();
  finished_.push_back({kind_.file(packs_ - 1), pack_->bytes(), pack_->digest()});
  pack_.reset();
}

TileLocation PackWriter::add(ByteSpan geometry, ByteSpan appearance, const char* too_large) {
  if (geometry.size() > UINT32_MAX || appearance.size() > UINT32_MAX) throw InputError(too_large);
  if (pack_ != nullptr && pack_->bytes() + geometry.size() + appearance.size() > pack_bytes_) endPack();
  if (pack_ == nullptr) {
    pack_ = std::make_unique<OutputFile>(folder_ + "/" + kind_.file(packs_));
    pack_->write(kind_.header(packs_++));
  }
  TileLocation at;
  at.pack = packs_ - 1;
  at.offset = pack_->bytes();
  at.geometry_bytes = static_cast<std::uint32_t>(geometry.size());
  at.appearance_bytes = static_cast<std::uint32_t>(appearance.size());
  at.geometry_checksum = checksum(geometry);
  at.appearance_checksum = checksum(appearance);
  pack_->write(geometry);
  pack_->write(appearance);
  return at;
}

std::vector<SetFile> PackWriter::close() {
  endPack();
  return std::exchange(finished_, {});
}

}  // namespace filiform::internal
