// What libc++ 13 lacks of C++20, for the preset `web` alone: bit_cast, jthread without tokens, and floating numbers as
// text. Included before every source. Thread rule: as in the standard.
#pragma once

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>
#include <thread>
#include <type_traits>
#include <utility>

#define EIGEN_OPTIMIZATION_BARRIER(X)  // Eigen's names a register that WebAssembly lacks

// Linux alone has it. Not called where hard links work.
#define RENAME_NOREPLACE 1
inline int renameat2(int, const char*, int, const char*, unsigned) {
  errno = ENOSYS;
  return -1;
}

namespace std {

template <class To, class From>
constexpr To bit_cast(const From& from) noexcept {
  static_assert(sizeof(To) == sizeof(From) && is_trivially_copyable_v<To> && is_trivially_copyable_v<From>);
  return __builtin_bit_cast(To, from);
}

class jthread {
 public:
  jthread() = default;
  template <class F, class... Args>
  explicit jthread(F&& function, Args&&... args) : thread_(std::forward<F>(function), std::forward<Args>(args)...) {}
  jthread(jthread&&) = default;
  jthread& operator=(jthread&& other) {
    if (thread_.joinable()) thread_.join();
    thread_ = std::move(other.thread_);
    return *this;
  }
  ~jthread() {
    if (thread_.joinable()) thread_.join();
  }

 private:
  thread thread_;
};

// The shortest text that reads back as the same number: scientific if that is shorter.
template <class Real>
requires is_floating_point_v<Real> to_chars_result to_chars(char* first, char* last, Real value) {
  char text[64];
  int length = 0;
  if (value != value || value - value != 0) {
    length = snprintf(text, sizeof text, "%s",
                      value != value ? (signbit(value) ? "-nan" : "nan")
                      : value < 0    ? "-inf"
                                     : "inf");
  } else {
    char digits[40];
    for (int precision = 0; precision < 17; ++precision) {
      snprintf(digits, sizeof digits, "%.*e", precision, static_cast<double>(value));
      if (static_cast<Real>(is_same_v<Real, float> ? strtof(digits, nullptr) : strtod(digits, nullptr)) == value) break;
    }
    const char* const e = strchr(digits, 'e');
    const int exponent = atoi(e + 1);
    const string scientific = string(static_cast<const char*>(digits), e) + (exponent < 0 ? "e-" : "e+") +
                              (abs(exponent) < 10 ? "0" : "") + to_string(abs(exponent));
    string plain = digits[0] == '-' ? "-" : "", mantissa;
    for (const char* at = digits; at < e; ++at)
      if (*at >= '0' && *at <= '9') mantissa += *at;
    if (exponent < 0)
      plain += "0." + string(static_cast<size_t>(-exponent - 1), '0') + mantissa;
    else if (static_cast<size_t>(exponent) + 1 >= mantissa.size())
      // Digits beyond those of the shortest text: those of the exact value.
      plain = [&] {
        char whole[400];
        snprintf(whole, sizeof whole, "%.0f", static_cast<double>(value));
        return string(whole);
      }();
    else
      plain += mantissa.substr(0, static_cast<size_t>(exponent) + 1) + "." +
               mantissa.substr(static_cast<size_t>(exponent) + 1);
    const string& best = plain.size() <= scientific.size() ? plain : scientific;
    length = snprintf(text, sizeof text, "%s", best.c_str());
  }
  if (last - first < length) return {last, errc::value_too_large};
  memcpy(first, text, static_cast<size_t>(length));
  return {first + length, errc()};
}

template <class Real>
requires is_floating_point_v<Real> to_chars_result to_chars(char* first, char* last, Real value, chars_format,
                                                            int decimals) {  // fixed alone
  char text[512];
  const int length = snprintf(text, sizeof text, "%.*f", decimals, static_cast<double>(value));
  if (length >= static_cast<int>(sizeof text) || last - first < length) return {last, errc::value_too_large};
  memcpy(first, text, static_cast<size_t>(length));
  return {first + length, errc()};
}

template <class Real>
requires is_floating_point_v<Real> from_chars_result from_chars(const char* first, const char* last, Real& value) {
  const char* at = first;
  const auto digits = [&] {
    const char* const begin = at;
    while (at < last && *at >= '0' && *at <= '9') ++at;
    return at > begin;
  };
  const auto word = [&](const char* text) {
    const size_t size = strlen(text);
    if (static_cast<size_t>(last - at) < size) return false;
    for (size_t i = 0; i < size; ++i)
      if ((at[i] | 0x20) != text[i]) return false;
    at += size;
    return true;
  };
  if (at < last && *at == '-') ++at;
  if (!word("infinity") && !word("inf") && !word("nan")) {
    bool some = digits();
    if (at < last && *at == '.') {
      const char* const point = at++;
      const bool after = digits();
      if (!some && !after) at = point;
      some = some || after;
    }
    if (!some) return {first, errc::invalid_argument};
    if (at < last && (*at | 0x20) == 'e') {
      const char* const before = at++;
      if (at < last && (*at == '-' || *at == '+')) ++at;
      if (!digits()) at = before;
    }
  }
  const string copy(first, at);
  errno = 0;
  const Real read =
      static_cast<Real>(is_same_v<Real, float> ? strtof(copy.c_str(), nullptr) : strtod(copy.c_str(), nullptr));
  const bool given_infinite = copy.find_first_of("iI") != string::npos;
  if (errno == ERANGE && !given_infinite && (read == 0 || read - read != 0)) return {at, errc::result_out_of_range};
  value = read;
  return {at, errc()};
}

}  // namespace std
