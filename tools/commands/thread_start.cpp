// Every thread that the program starts, also a library's, gets a stack for signal handlers (solver/force/force_hold.h):
// so a stack overflow in any thread ends in zero force. Sanitizers start threads in their own way.
#ifndef __has_feature
#define __has_feature(name) 0
#endif
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && !__has_feature(address_sanitizer) && \
    !__has_feature(thread_sanitizer)

#include "solver/force/force_hold.h"

#include <cerrno>
#include <dlfcn.h>
#include <new>
#include <pthread.h>

namespace {

struct Start {
  void* (*run)(void*);
  void* argument;
};

void* runStarted(void* given) {
  const Start start = *static_cast<Start*>(given);
  delete static_cast<Start*>(given);
  filiform::giveSignalStack();
  return start.run(start.argument);
}

}  // namespace

// Takes the place of the C library's function, and calls it.
extern "C" int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*),
                              void* argument) noexcept {
  using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  static const auto create = reinterpret_cast<Create>(dlsym(RTLD_NEXT, "pthread_create"));
  auto* const start = new (std::nothrow) Start{run, argument};
  if (start == nullptr || create == nullptr) return EAGAIN;
  const int error = create(thread, attributes, runStarted, start);
  if (error != 0) delete start;
  return error;
}

#endif
