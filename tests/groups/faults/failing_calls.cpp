#include "tests/groups/faults/failing_calls.h"

#include "tests/support/sanitized.h"

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <fcntl.h>
#include <new>
#include <pthread.h>
#include <sys/stat.h>
#include <unistd.h>

namespace filiform::test {
namespace {

std::atomic<bool> armed{false};
std::atomic<std::uint64_t> met{0};
Kind chosen{};
FailingCalls::Plan plan;

// Returns whether this is the call that fails or ends the process.
bool failsNow(Kind kind) noexcept {
  if (!armed.load(std::memory_order_acquire)) return false;
  const bool counts = chosen == Kind::any_file ? kind != Kind::thread && kind != Kind::memory : kind == chosen;
  if (!counts) return false;
  const std::uint64_t number = met.fetch_add(1) + 1;
  if (plan.at == 0 || number < plan.at || (number > plan.at && !plan.for_ever)) return false;
  if (plan.what == FailingCalls::What::die) ::kill(::getpid(), SIGKILL);
  if (plan.what == FailingCalls::What::stand_still) ::kill(::getpid(), SIGSTOP);
  return plan.what == FailingCalls::What::fail;
}

template <typename Function>
Function next(const char* name) {
  void* const real = ::dlsym(RTLD_NEXT, name);
  Function function = nullptr;
  std::memcpy(&function, &real, sizeof function);
  return function;
}

}  // namespace

const char* toString(Kind kind) {
  static constexpr const char* kNames[] = {"open",        "read",   "write",  "fsync",   "rename",
                                           "make folder", "thread", "memory", "any file"};
  return kNames[static_cast<std::size_t>(kind)];
}

FailingCalls::FailingCalls(Kind kind, Plan wanted) noexcept {
  chosen = kind;
  plan = wanted;
  met = 0;
  armed.store(true, std::memory_order_release);
}

FailingCalls::~FailingCalls() { end(); }

std::uint64_t FailingCalls::end() noexcept {
  armed = false;
  return met;
}

}  // namespace filiform::test

using filiform::test::failsNow;
using filiform::test::Kind;
using filiform::test::next;

// FORWARD(kind, error, answer, type, name, (parameters), (arguments)).
#define FILIFORM_FORWARD(kind, error, answer, type, name, parameters, arguments) \
  extern "C" __attribute__((visibility("default"))) type name parameters {       \
    if (failsNow(kind)) {                                                        \
      errno = error;                                                             \
      return answer;                                                             \
    }                                                                            \
    static type(*const forward) parameters = next<type(*) parameters>(#name);    \
    return forward arguments;                                                    \
  }

FILIFORM_FORWARD(Kind::read, EIO, -1, ssize_t, read, (int fd, void* p, std::size_t n), (fd, p, n))
FILIFORM_FORWARD(Kind::read, EIO, -1, ssize_t, pread, (int fd, void* p, std::size_t n, off_t at), (fd, p, n, at))
FILIFORM_FORWARD(Kind::read, EIO, -1, ssize_t, pread64, (int fd, void* p, std::size_t n, off64_t at), (fd, p, n, at))
FILIFORM_FORWARD(Kind::write, ENOSPC, -1, ssize_t, write, (int fd, const void* p, std::size_t n), (fd, p, n))
FILIFORM_FORWARD(Kind::write, ENOSPC, -1, ssize_t, pwrite, (int fd, const void* p, std::size_t n, off_t at),
                 (fd, p, n, at))
FILIFORM_FORWARD(Kind::write, ENOSPC, -1, ssize_t, pwrite64, (int fd, const void* p, std::size_t n, off64_t at),
                 (fd, p, n, at))
FILIFORM_FORWARD(Kind::sync, EIO, -1, int, fsync, (int fd), (fd))
FILIFORM_FORWARD(Kind::rename, EIO, -1, int, rename, (const char* from, const char* to) noexcept, (from, to))
FILIFORM_FORWARD(Kind::make_folder, ENOSPC, -1, int, mkdir, (const char* path, mode_t mode) noexcept, (path, mode))

#define FILIFORM_FORWARD_OPEN(name, folder_parameter, folder_argument)                                            \
  extern "C" __attribute__((visibility("default"))) int name(folder_parameter const char* path, int flags, ...) { \
    std::va_list more;                                                                                            \
    va_start(more, flags);                                                                                        \
    const mode_t mode = va_arg(more, mode_t);                                                                     \
    va_end(more);                                                                                                 \
    if (failsNow(Kind::open)) {                                                                                   \
      errno = EMFILE;                                                                                             \
      return -1;                                                                                                  \
    }                                                                                                             \
    static const auto forward = next<int (*)(folder_parameter const char*, int, ...)>(#name);                     \
    return forward(folder_argument path, flags, mode);                                                            \
  }
#define FILIFORM_COMMA ,
FILIFORM_FORWARD_OPEN(open, , )
FILIFORM_FORWARD_OPEN(open64, , )
FILIFORM_FORWARD_OPEN(openat, int folder FILIFORM_COMMA, folder FILIFORM_COMMA)
FILIFORM_FORWARD_OPEN(openat64, int folder FILIFORM_COMMA, folder FILIFORM_COMMA)

extern "C" __attribute__((visibility("default"))) int pthread_create(pthread_t* thread, const pthread_attr_t* how,
                                                                     void* (*run)(void*), void* argument) noexcept {
  if (failsNow(Kind::thread)) return EAGAIN;
  using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  static const auto forward = next<Create>("pthread_create");
  return forward(thread, how, run, argument);
}

#if FILIFORM_UNDER_SANITIZER

// malloc belongs to the sanitizer. Allocations of C++ come through here.
void* operator new(std::size_t size) {
  void* const block = failsNow(Kind::memory) ? nullptr : std::malloc(size);
  if (block == nullptr) throw std::bad_alloc();
  return block;
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return failsNow(Kind::memory) ? nullptr : std::malloc(size);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  void* block = nullptr;
  if (failsNow(Kind::memory) || ::posix_memalign(&block, static_cast<std::size_t>(alignment), size) != 0)
    throw std::bad_alloc();
  return block;
}
void* operator new[](std::size_t size) { return operator new(size); }
void* operator new[](std::size_t size, const std::nothrow_t& tag) noexcept { return operator new(size, tag); }
void* operator new[](std::size_t size, std::align_val_t alignment) { return operator new(size, alignment); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, const std::nothrow_t&) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, const std::nothrow_t&) noexcept { std::free(p); }
void operator delete[](void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

#else

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

__attribute__((visibility("default"))) void* malloc(std::size_t size) {
  if (!failsNow(Kind::memory)) return __libc_malloc(size);
  errno = ENOMEM;
  return nullptr;
}
__attribute__((visibility("default"))) void* calloc(std::size_t count, std::size_t size) {
  if (!failsNow(Kind::memory)) return __libc_calloc(count, size);
  errno = ENOMEM;
  return nullptr;
}
__attribute__((visibility("default"))) void* realloc(void* p, std::size_t size) {
  if (!failsNow(Kind::memory)) return __libc_realloc(p, size);
  errno = ENOMEM;
  return nullptr;
}
__attribute__((visibility("default"))) void* aligned_alloc(std::size_t alignment, std::size_t size) {
  if (!failsNow(Kind::memory)) return __libc_memalign(alignment, size);
  errno = ENOMEM;
  return nullptr;
}
__attribute__((visibility("default"))) int posix_memalign(void** p, std::size_t alignment, std::size_t size) {
  void* const block = failsNow(Kind::memory) ? nullptr : __libc_memalign(alignment, size);
  if (block == nullptr) return ENOMEM;
  *p = block;
  return 0;
}
}

#endif
