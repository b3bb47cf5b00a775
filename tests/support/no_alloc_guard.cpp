// Fortified headers define some of these functions inline, so fortification is off.
#undef _FORTIFY_SOURCE

#include "tests/support/no_alloc_guard.h"

#include "tests/support/sanitized.h"

#include <cerrno>
#include <cstdarg>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <semaphore.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

namespace {

using filiform::test::ForbiddenCalls;

// Read inside malloc. Constant initialisation and the executable's own thread-local storage ensure that reading does
// not allocate.
thread_local constinit bool guarded = false;
thread_local constinit bool aborts = false;
thread_local constinit ForbiddenCalls seen{};

enum class Call { allocation, lock, system };

void note(Call call, const char* name) noexcept {
  if (!guarded) [[likely]]
    return;
  if (seen.total() == 0) seen.first = name;
  if (call == Call::allocation) ++seen.allocations;
  if (call == Call::lock) ++seen.locks;
  if (call == Call::system) ++seen.system_calls;
  if (!aborts) return;
  guarded = false;
  const char* const parts[] = {"forbidden in a haptic tick: ", name, "\n"};
  for (const char* part : parts) [[maybe_unused]] const auto written = ::write(STDERR_FILENO, part, std::strlen(part));
  std::abort();
}

}  // namespace

#if FILIFORM_UNDER_SANITIZER

extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*malloc_hook)(const volatile void*, std::size_t),
                                                         void (*free_hook)(const volatile void*));

namespace {

[[maybe_unused]] const int hooks_installed = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t) { note(Call::allocation, "malloc"); },
    [](const volatile void*) { note(Call::allocation, "free"); });

}  // namespace

#else

// Weak, so that a test with its own definition (for example of a failing disk) takes precedence.
#define FILIFORM_INTERPOSED extern "C" __attribute__((weak, visibility("default")))

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);
}

FILIFORM_INTERPOSED void* malloc(std::size_t size) {
  note(Call::allocation, "malloc");
  return __libc_malloc(size);
}
FILIFORM_INTERPOSED void* calloc(std::size_t count, std::size_t size) {
  note(Call::allocation, "calloc");
  return __libc_calloc(count, size);
}
FILIFORM_INTERPOSED void* realloc(void* p, std::size_t size) {
  note(Call::allocation, "realloc");
  return __libc_realloc(p, size);
}
FILIFORM_INTERPOSED void* memalign(std::size_t alignment, std::size_t size) {
  note(Call::allocation, "memalign");
  return __libc_memalign(alignment, size);
}
FILIFORM_INTERPOSED void* aligned_alloc(std::size_t alignment, std::size_t size) {
  note(Call::allocation, "aligned_alloc");
  return __libc_memalign(alignment, size);
}
FILIFORM_INTERPOSED int posix_memalign(void** p, std::size_t alignment, std::size_t size) {
  note(Call::allocation, "posix_memalign");
  if (alignment % sizeof(void*) != 0 || (alignment & (alignment - 1)) != 0 || alignment == 0) return EINVAL;
  void* const block = __libc_memalign(alignment, size);
  if (block == nullptr) return ENOMEM;
  *p = block;
  return 0;
}
FILIFORM_INTERPOSED void free(void* p) {
  if (p != nullptr) note(Call::allocation, "free");
  __libc_free(p);
}

namespace {

// dlsym alone would return glibc's oldest version of the condition variables, which have another layout.
void* nextDefinition(const char* name) {
  void* const versioned = dlvsym(RTLD_NEXT, name, "GLIBC_2.3.2");
  return versioned != nullptr ? versioned : dlsym(RTLD_NEXT, name);
}

template <typename Function>
Function nextFunction(const char* name) {
  void* const real = nextDefinition(name);
  Function function = nullptr;
  std::memcpy(&function, &real, sizeof function);
  return function;
}

}  // namespace

// FORWARD(kind, return type, name, (parameters), (arguments)): counts the call and calls the next definition of the
// name.
#define FILIFORM_FORWARD(kind, type, name, parameters, arguments) \
  FILIFORM_INTERPOSED type name parameters {                      \
    static void* next = nullptr;                                  \
    note(kind, #name);                                            \
    void* real = __atomic_load_n(&next, __ATOMIC_RELAXED);        \
    if (real == nullptr) {                                        \
      real = nextDefinition(#name);                               \
      __atomic_store_n(&next, real, __ATOMIC_RELAXED);            \
    }                                                             \
    type(*forward) parameters = nullptr;                          \
    std::memcpy(&forward, &real, sizeof forward);                 \
    return forward arguments;                                     \
  }

FILIFORM_FORWARD(Call::lock, int, pthread_mutex_lock, (pthread_mutex_t * m), (m))
FILIFORM_FORWARD(Call::lock, int, pthread_mutex_trylock, (pthread_mutex_t * m), (m))
FILIFORM_FORWARD(Call::lock, int, pthread_mutex_timedlock, (pthread_mutex_t * m, const timespec* t), (m, t))
FILIFORM_FORWARD(Call::lock, int, pthread_rwlock_rdlock, (pthread_rwlock_t * l), (l))
FILIFORM_FORWARD(Call::lock, int, pthread_rwlock_wrlock, (pthread_rwlock_t * l), (l))
FILIFORM_FORWARD(Call::lock, int, pthread_cond_wait, (pthread_cond_t * c, pthread_mutex_t* m), (c, m))
FILIFORM_FORWARD(Call::lock, int, pthread_cond_timedwait, (pthread_cond_t * c, pthread_mutex_t* m, const timespec* t),
                 (c, m, t))
FILIFORM_FORWARD(Call::lock, int, pthread_cond_clockwait,
                 (pthread_cond_t * c, pthread_mutex_t* m, clockid_t k, const timespec* t), (c, m, k, t))
FILIFORM_FORWARD(Call::lock, int, pthread_cond_signal, (pthread_cond_t * c), (c))
FILIFORM_FORWARD(Call::lock, int, pthread_cond_broadcast, (pthread_cond_t * c), (c))
FILIFORM_FORWARD(Call::lock, int, sem_wait, (sem_t * s), (s))
FILIFORM_FORWARD(Call::lock, int, sem_post, (sem_t * s), (s))

FILIFORM_FORWARD(Call::system, ssize_t, read, (int fd, void* p, std::size_t n), (fd, p, n))
FILIFORM_FORWARD(Call::system, ssize_t, write, (int fd, const void* p, std::size_t n), (fd, p, n))
FILIFORM_FORWARD(Call::system, ssize_t, pread, (int fd, void* p, std::size_t n, off_t at), (fd, p, n, at))
FILIFORM_FORWARD(Call::system, ssize_t, pread64, (int fd, void* p, std::size_t n, off64_t at), (fd, p, n, at))
FILIFORM_FORWARD(Call::system, ssize_t, pwrite, (int fd, const void* p, std::size_t n, off_t at), (fd, p, n, at))
FILIFORM_FORWARD(Call::system, ssize_t, pwrite64, (int fd, const void* p, std::size_t n, off64_t at), (fd, p, n, at))
FILIFORM_FORWARD(Call::system, int, close, (int fd), (fd))
FILIFORM_FORWARD(Call::system, off_t, lseek, (int fd, off_t at, int whence), (fd, at, whence))
FILIFORM_FORWARD(Call::system, int, fsync, (int fd), (fd))
FILIFORM_FORWARD(Call::system, void*, mmap, (void* p, std::size_t n, int prot, int flags, int fd, off_t at),
                 (p, n, prot, flags, fd, at))
FILIFORM_FORWARD(Call::system, int, munmap, (void* p, std::size_t n), (p, n))
FILIFORM_FORWARD(Call::system, int, madvise, (void* p, std::size_t n, int advice), (p, n, advice))
FILIFORM_FORWARD(Call::system, int, poll, (pollfd * fds, nfds_t n, int timeout), (fds, n, timeout))
FILIFORM_FORWARD(Call::system, int, nanosleep, (const timespec* t, timespec* left), (t, left))
FILIFORM_FORWARD(Call::system, int, clock_nanosleep, (clockid_t k, int flags, const timespec* t, timespec* left),
                 (k, flags, t, left))
FILIFORM_FORWARD(Call::system, int, usleep, (useconds_t us), (us))
FILIFORM_FORWARD(Call::system, int, sched_yield, (), ())

// The last parameters of these functions are optional. On every Linux ABI that the project supports, passing one more
// than was given is harmless.
#define FILIFORM_FORWARD_OPEN(name)                                                \
  FILIFORM_INTERPOSED int name(const char* path, int flags, ...) {                 \
    std::va_list more;                                                             \
    va_start(more, flags);                                                         \
    const mode_t mode = va_arg(more, mode_t);                                      \
    va_end(more);                                                                  \
    note(Call::system, #name);                                                     \
    return nextFunction<int (*)(const char*, int, ...)>(#name)(path, flags, mode); \
  }
FILIFORM_FORWARD_OPEN(open)
FILIFORM_FORWARD_OPEN(open64)

#define FILIFORM_FORWARD_OPENAT(name)                                                           \
  FILIFORM_INTERPOSED int name(int folder, const char* path, int flags, ...) {                  \
    std::va_list more;                                                                          \
    va_start(more, flags);                                                                      \
    const mode_t mode = va_arg(more, mode_t);                                                   \
    va_end(more);                                                                               \
    note(Call::system, #name);                                                                  \
    return nextFunction<int (*)(int, const char*, int, ...)>(#name)(folder, path, flags, mode); \
  }
FILIFORM_FORWARD_OPENAT(openat)
FILIFORM_FORWARD_OPENAT(openat64)

FILIFORM_INTERPOSED int ioctl(int fd, unsigned long request, ...) noexcept {
  std::va_list more;
  va_start(more, request);
  void* const argument = va_arg(more, void*);
  va_end(more);
  note(Call::system, "ioctl");
  return nextFunction<int (*)(int, unsigned long, ...)>("ioctl")(fd, request, argument);
}

FILIFORM_INTERPOSED long syscall(long number, ...) noexcept {
  std::va_list more;
  va_start(more, number);
  long arguments[6];
  for (long& argument : arguments) argument = va_arg(more, long);
  va_end(more);
  note(Call::system, "syscall");
  return nextFunction<long (*)(long, ...)>("syscall")(number, arguments[0], arguments[1], arguments[2], arguments[3],
                                                      arguments[4], arguments[5]);
}

#endif  // FILIFORM_UNDER_SANITIZER

namespace filiform::test {

NoAllocGuard::NoAllocGuard(On on) noexcept {
  seen = ForbiddenCalls{};
  aborts = on == On::abort;
  guarded = true;
}

NoAllocGuard::~NoAllocGuard() { guarded = false; }

ForbiddenCalls NoAllocGuard::calls() noexcept {
  guarded = false;
  return seen;
}

NoAllocGuard::Sight NoAllocGuard::sees() noexcept {
#if FILIFORM_UNDER_SANITIZER
  return {true, false, false, "under a sanitizer the locking and system call wrappers belong to its runtime"};
#else
  return {true, true, true, ""};
#endif
}

namespace {

enum ChildExit { kClean = 0, kFailed = 1, kNoSeal = 2 };

// Allows only exit; any other call ends the process with SIGSYS. Returns false if the kernel refuses.
bool seal() {
  sock_filter rules[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit_group, 2, 0),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  };
  const sock_fprog program{static_cast<unsigned short>(sizeof rules / sizeof rules[0]), rules};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

}  // namespace

SealedRun runSealed(const std::function<void()>& prepare, const std::function<bool()>& work) {
  using Outcome = SealedRun::Outcome;
  if (!NoAllocGuard::sees().system_calls)
    return {Outcome::refused, "a sanitizer's runtime makes system calls of its own"};
  const pid_t child = fork();
  if (child < 0) return {Outcome::refused, std::string("fork: ") + std::strerror(errno)};
  if (child == 0) {
    prepare();
    if (!seal()) _exit(kNoSeal);
    _exit(work() ? kClean : kFailed);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status)) {
    const int signal = WTERMSIG(status);
    return {signal == SIGSYS ? Outcome::system_call : Outcome::failed,
            "ended by signal " + std::to_string(signal) + " (" + strsignal(signal) + ")"};
  }
  switch (WEXITSTATUS(status)) {
    case kClean:
      return {Outcome::clean, "no system call"};
    case kNoSeal:
      return {Outcome::refused, "this kernel refuses a seccomp filter"};
    default:
      return {Outcome::failed, "the work said that it failed"};
  }
}

}  // namespace filiform::test
