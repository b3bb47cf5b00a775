#include "index/set/internal/patches_file.h"

namespace filiform::internal {
namespace {

constexpr std::string_view kPatchesMagic = "FILIPTCH";
constexpr std::size_t kPatchBytes = 56;

}  // namespace

Bytes encodePatches(const std::vector<Patch>& patches) {
  ByteWriter out;
  writeMagic(out, kPatchesMagic);
  out.u32(static_cast<std::uint32_t>(patches.size()));
  for (const Patch& p : patches) {
    out.u32(p.tile);
    out.u32(p.stored);
    out.u64(p.decoded_bytes);
    out.u32(p.at.pack);
    out.u32(p.owned);
    out.u32(p.at.geometry_bytes);
    out.u32(p.at.appearance_bytes);
    out.u64(p.at.offset);
    out.u64(p.at.geometry_checksum);
    out.u64(p.at.appearance_checksum);
  }
  return out.take();
}

std::vector<Patch> decodePatches(ByteSpan bytes) {
  ByteReader in(bytes);
  checkMagic(in, kPatchesMagic);
  const std::uint32_t n = in.u32();
  in.require(in.left() == std::uint64_t{n} * kPatchBytes, "the number of patches does not fit the file");
  std::vector<Patch> patches(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    Patch& p = patches[i];
    p.tile = in.u32();
    in.require(i == 0 || patches[i - 1].tile < p.tile, "the patches are out of order");
    p.stored = in.u32();
    p.decoded_bytes = in.u64();
    p.at.pack = in.u32();
    p.owned = in.u32();
    p.at.geometry_bytes = in.u32();
    p.at.appearance_bytes = in.u32();
    p.at.offset = in.u64();
    p.at.geometry_checksum = in.u64();
    p.at.appearance_checksum = in.u64();
  }
  return patches;
}

}  // namespace filiform::internal
