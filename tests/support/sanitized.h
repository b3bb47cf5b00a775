// Whether this test is instrumented. It is then many times slower, and may test a sample of what the plain test tests.
#pragma once

#include <cstdint>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define FILIFORM_UNDER_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define FILIFORM_UNDER_SANITIZER 1
#endif
#endif
#ifndef FILIFORM_UNDER_SANITIZER
#define FILIFORM_UNDER_SANITIZER 0
#endif

namespace filiform::test {

inline constexpr bool kSanitized = FILIFORM_UNDER_SANITIZER;

// How many of `count` seeds or cases to test: all in the release build, a fifth under a sanitizer.
constexpr std::uint64_t sampled(std::uint64_t count) { return kSanitized ? (count + 4) / 5 : count; }

}  // namespace filiform::test
