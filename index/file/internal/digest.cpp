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

struct RunningDigest::State {
  State() : xxh(XXH3_createState()) {
    if (xxh == nullptr) throw std::bad_alloc();
  }
  ~State() { XXH3_freeState(xxh); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  XXH3_state_t* const xxh;
};

RunningDigest::RunningDigest() : state_(std::make_unique<State>()) { reset(); }
RunningDigest::RunningDigest(RunningDigest&&) noexcept = default;
RunningDigest& RunningDigest::operator=(RunningDigest&&) noexcept = default;
RunningDigest::~RunningDigest() = default;

void RunningDigest::add(std::span<const std::uint8_t> bytes) {
  XXH3_64bits_update(state_->xxh, bytes.data(), bytes.size());
}
void RunningDigest::add(std::string_view text) { XXH3_64bits_update(state_->xxh, text.data(), text.size()); }
std::uint64_t RunningDigest::value() const { return XXH3_64bits_digest(state_->xxh); }
void RunningDigest::reset() { XXH3_64bits_reset(state_->xxh); }

}  // namespace filiform::internal
