#include "index/remote/web/page_reader.h"

#include <atomic>
#include <emscripten.h>
#include <emscripten/threading.h>
#include <limits>

namespace filiform::internal {

namespace {

// What the program and the reader share.
struct Desk {
  std::atomic<std::uint32_t> asked{0};    // the newest PageRequest that the reader has not taken; 0: none
  std::atomic<std::int32_t> page{0};      // a part of the channels' names, by the reader; 0: it has not begun
  std::atomic<std::uint32_t> senders{0};  // threads that have a channel
};

Desk desk;

// Each thread sends on a channel of its own. Threads of the program receive nothing, so on a shared channel the
// messages of the others would fill their memory.
EM_JS(void, wake, (int page, std::uint32_t* senders), {
  if (!self.filiformReader) {
    const sender = Atomics.add(HEAPU32, senders >> 2, 1);
    self.filiformReader = new BroadcastChannel("filiform-" + page + "-" + (sender % 32));
  }
  self.filiformReader.postMessage(0);
});

}  // namespace

void ask(PageRequest& request) {
  __atomic_store_n(&request.is_answered, 0, __ATOMIC_SEQ_CST);
  const auto address = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(&request));
  request.next = desk.asked.load();
  while (!desk.asked.compare_exchange_weak(request.next, address)) {
  }
  // A reader that begins later looks at `asked` first. One that has been woken for an earlier request takes both.
  if (const std::int32_t page = desk.page.load(); page != 0 && request.next == 0)
    wake(page, reinterpret_cast<std::uint32_t*>(&desk.senders));
  while (__atomic_load_n(&request.is_answered, __ATOMIC_SEQ_CST) == 0)
    emscripten_futex_wait(&request.is_answered, 0, std::numeric_limits<double>::infinity());
}

}  // namespace filiform::internal

// For the reader.
extern "C" EMSCRIPTEN_KEEPALIVE void* filiform_reader_desk() { return &filiform::internal::desk; }
