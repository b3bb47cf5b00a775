// What every function of filiform.h does: no exception leaves, a failure becomes a status and a text of the thread, and
// structs with a size are checked. Thread rule: any thread.
#pragma once

#include "index/errors.h"
#include "tools/c/filiform.h"
#include "tools/c/handle_table.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>
#include <vector>

namespace filiform::c {

// Translates the exception in flight, keeps its text for filiform_error_text(), and returns the status. Does not throw.
int statusOfException() noexcept;

// Calls `run` and returns FILIFORM_OK, or the status of its exception.
template <class Run>
int call(const Run& run) noexcept {
  try {
    run();
    return FILIFORM_OK;
  } catch (...) {
    return statusOfException();
  }
}

// Throws UsageError if the pointer is null. `name`: of the argument.
template <class T>
T* required(T* pointer, const char* name) {
  if (pointer == nullptr) throw UsageError(std::string(name) + ": is NULL");
  return pointer;
}

// The size of a struct in the first version that had it.
template <class T>
inline constexpr std::size_t kFirstSize = sizeof(T);
template <>
inline constexpr std::size_t kFirstSize<filiform_ingest_options> = offsetof(filiform_ingest_options, attributes);

[[noreturn]] inline void refuseSize(std::uint32_t size, std::size_t known, const char* name) {
  throw UsageError(std::string(name) + ": struct_size is " + std::to_string(size) + "; this library knows " +
                   std::to_string(known) + " (use FILIFORM_INIT)");
}

// Throws UsageError unless struct_size is that of this version.
template <class T>
T* sized(T* pointer, const char* name) {
  required(pointer, name);
  if (pointer->struct_size != sizeof(T)) refuseSize(pointer->struct_size, sizeof(T), name);
  return pointer;
}

// The options, or those of all defaults for NULL. Members that an older version lacked are 0.
template <class T>
T optionsOr(const T* options, const char* name) {
  T given{};
  given.struct_size = sizeof(T);
  if (options == nullptr) return given;
  if (options->struct_size != sizeof(T) && options->struct_size != kFirstSize<T>)
    refuseSize(options->struct_size, sizeof(T), name);
  std::memcpy(&given, options, options->struct_size);
  given.struct_size = sizeof(T);
  return given;
}

// An array for the caller, which filiform_free() frees; nullptr if empty.
template <class T>
T* arrayOf(const std::vector<T>& values) {
  if (values.empty()) return nullptr;
  auto* const array = static_cast<T*>(std::malloc(values.size() * sizeof(T)));
  if (array == nullptr) throw std::bad_alloc();
  std::memcpy(array, values.data(), values.size() * sizeof(T));
  return array;
}

// The object of a handle in use.
template <class T, HandleKind kKind>
class Held {
 public:
  Held(const void* handle, const char* name) : use_(HandleTable::ofProcess().use(handle, kKind, name)) {}
  T* operator->() const { return static_cast<T*>(use_.object()); }
  T& operator*() const { return *static_cast<T*>(use_.object()); }

 private:
  HandleTable::Use use_;
};

}  // namespace filiform::c
