#include "index/file/internal/digest.h"

#include <new>

#include <xxhash.h>

namespace filiform::internal {

std::uint64_t checksum(std::span<const std::uint8_t> bytes, std::uint64_t seed) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), seed);
}
std::uint64_t checksum(std::string_view text, std::uint64_t seed) {
  return XXH3_64bits_withSeed(text.data(), text.size(), seed);
}

RunningDigest::RunningDigest() : state_(XXH3_createState()) {
  if (!state_) throw std::bad_alloc();
  reset();
}
RunningDigest::RunningDigest(RunningDigest&&) noexcept = default;
RunningDigest& RunningDigest::operator=(RunningDigest&&) noexcept = default;
RunningDigest::~RunningDigest() = default;

void RunningDigest::add(std::span<const std::uint8_t> bytes) {
  XXH3_64bits_update(state_.get(), bytes.data(), bytes.size());
}
void RunningDigest::add(std::string_view text) { XXH3_64bits_update(state_.get(), text.data(), text.size()); }
std::uint64_t RunningDigest::value() const { return XXH3_64bits_digest(state_.get()); }
void RunningDigest::reset() { XXH3_64bits_reset(state_.get()); }
void RunningDigest::Free::operator()(XXH3_state_s* state) const { XXH3_freeState(state); }

}  // namespace filiform::internal
