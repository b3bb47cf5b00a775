#include "device/process/process_device.h"

#include "device/bridge/bridge_device.h"
#include "device/internal/owned_descriptor.h"

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <mutex>
#include <optional>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <spawn.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

extern char** environ;

namespace filiform {

namespace {

using internal::OwnedDescriptor;

constexpr const char* kDeviceProgram = "filiform-device";
constexpr int kChildSocket = 3;
constexpr double kOpening_s = 15;  // of a device: loading a Falcon's firmware takes 3 s
constexpr int kEnd_ms = 500, kDoubtfulEnd_ms = 150, kLost_ms = 200, kRescue_ms = 1000, kRescues = 3;
constexpr int kLook_ms = 20, kLooks = 6;  // the watcher looks so often at an exchange that does not end

// The path beside the running program, or the bare name, which PATH then resolves.
std::string deviceProgramPath() {
  std::array<char, 4096> self{};
  const ssize_t size = ::readlink("/proc/self/exe", self.data(), self.size() - 1);
  const std::string path(self.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  const std::string beside = path.substr(0, path.rfind('/') + 1) + kDeviceProgram;
  return ::access(beside.c_str(), X_OK) == 0 ? beside : kDeviceProgram;
}

int statusOf(pid_t process) noexcept {
  int status = -1;
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

// A started process. What it prints comes through a pipe, whose end is the end of the process.
struct Child {
  pid_t id = -1;
  OwnedDescriptor output;
};

}  // namespace

struct ProcessDevice::Impl {
  ProcessDeviceOptions options;
  std::mutex mutex;  // of what follows; never taken by exchange()
  Child child;
  bool watched = false;  // the end of the child is a death
  std::atomic<int> process_id{-1};
  std::atomic<std::uint64_t> begun{0}, zeroed{0};
  // Last lines of processes that died, by turns: readers on other threads hold pointers to them.
  std::array<std::array<char, 512>, 4> spoken{};
  std::size_t deaths = 0;
  std::atomic<const char*> last_words{""};
  std::atomic<bool> lost{false}, silent{false}, ends{false};  // silent: lost because it did not answer
  std::atomic<bool> placed{false};                            // the first exchange() since open() has been
  std::atomic<std::uint64_t> begins_and_ends{0};              // of exchanges; odd: one is under way
  OwnedDescriptor wake{::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)};
  std::optional<BridgeDevice> bridge;
  std::thread watcher;

  Child start(std::vector<std::string> words, int socket) {
    int ends_of[2];
    if (::pipe2(ends_of, O_CLOEXEC) != 0) throw DeviceError(std::string("no pipe: ") + std::strerror(errno));
    Child started;
    started.output = OwnedDescriptor(ends_of[0]);
    const OwnedDescriptor written(ends_of[1]);
    ::fcntl(started.output.number, F_SETFL, O_NONBLOCK);
    words.insert(words.begin(), options.program.empty() ? deviceProgramPath() : options.program);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawnattr_init(&attributes);
    ::posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_adddup2(&actions, written.number, 1);
    ::posix_spawn_file_actions_adddup2(&actions, written.number, 2);
    if (socket >= 0) ::posix_spawn_file_actions_adddup2(&actions, socket, kChildSocket);
    ::posix_spawn_file_actions_addclosefrom_np(&actions, kChildSocket + 1);
    // A session of its own: Ctrl-C and Ctrl-Z in a terminal are for the program, which ends the process.
    sigset_t all, none;
    sigfillset(&all);
    sigdelset(&all, SIGKILL);
    sigdelset(&all, SIGSTOP);
    sigemptyset(&none);
    ::posix_spawnattr_setsigdefault(&attributes, &all);
    ::posix_spawnattr_setsigmask(&attributes, &none);
    ::posix_spawnattr_setflags(&attributes,
                               static_cast<short>(POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSIGMASK));
    const int error =
        ::posix_spawnp(&started.id, words.front().c_str(), &actions, &attributes, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    ::posix_spawnattr_destroy(&attributes);
    if (error != 0)
      throw DeviceError(std::string("the program filiform-device, which drives ") + options.device +
                        ", cannot be started (" + std::strerror(error) +
                        "): install it beside filiform, or give --device " + options.device +
                        ",direct: the last force may then stay if filiform is killed");
    return started;
  }

  // Called by the bridge's connect(), by the owner's thread.
  int connect() {
    int pair[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair) != 0)
      throw DeviceError(std::string("no socket: ") + std::strerror(errno));
    OwnedDescriptor mine(pair[0]);
    const OwnedDescriptor theirs(pair[1]);
    ::fcntl(mine.number, F_SETFL, O_NONBLOCK);
    const std::lock_guard lock(mutex);
    end(kEnd_ms);
    child = start({options.device, "fd:" + std::to_string(kChildSocket)}, theirs.number);
    process_id = child.id;
    return std::exchange(mine.number, -1);
  }

  // Waits until the child's output ends. Returns the last line; nullopt: it still runs after that time.
  static std::optional<std::string> outputOf(const Child& of, int within_ms) {
    std::string text;
    std::array<char, 512> part;
    for (pollfd ready{of.output.number, POLLIN, 0};;) {
      const int readable = ::poll(&ready, 1, within_ms);
      if (readable < 0 && errno == EINTR) continue;
      if (readable <= 0) return std::nullopt;
      const ssize_t size = ::read(of.output.number, part.data(), part.size());
      if (size == 0) break;
      if (size > 0) text.append(part.data(), static_cast<std::size_t>(size));
    }
    while (!text.empty() && text.back() == '\n') text.pop_back();
    text.erase(0, text.rfind('\n') + 1);
    for (const std::string& prefix : {std::string(kDeviceProgram) + ": ", std::string("bridge: ")})
      if (text.starts_with(prefix)) text.erase(0, prefix.size());
    return text;
  }

  // Kills the child if it still runs. Returns whether it was killed.
  bool reap(bool ended) noexcept {
    if (child.id < 0) return false;
    if (!ended) ::kill(child.id, SIGKILL);
    const bool by_signal = WIFSIGNALED(statusOf(child.id));
    child = {};
    process_id = -1;
    watched = false;
    return !ended || by_signal;
  }

  // Opens the device in another process, which sends zero and ends; again if the device cannot be opened yet.
  void rescue() noexcept {
    begun.fetch_add(1);
    for (int i = 0; i < kRescues; ++i) {
      int status = -1;
      try {
        child = start({"--zero", options.device}, -1);
        if (!outputOf(child, kRescue_ms)) ::kill(child.id, SIGKILL);
        status = statusOf(child.id);
      } catch (const std::exception&) {
        // The next attempt may succeed.
      }
      child = {};
      if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
        zeroed.fetch_add(1);
        return;
      }
    }
  }

  // The child has closed its socket or was asked to. A child that hangs is killed, and the device sent zero.
  void end(int within_ms) noexcept {
    if (child.id < 0) return;
    watched = false;
    const std::optional<std::string> words = outputOf(child, silent ? 0 : within_ms);
    if (reap(words.has_value())) rescue();
  }

  void say(const std::string& said) noexcept {
    auto& place = spoken[deaths++ % spoken.size()];
    std::strncpy(place.data(), said.c_str(), place.size() - 1);
    last_words.store(place.data(), std::memory_order_release);
  }

  void watch() noexcept {
    std::uint64_t seen_before = 0;
    int looks = 0;
    while (!ends) {
      int output = -1;
      {
        const std::lock_guard lock(mutex);
        if (watched) output = child.output.number;
      }
      std::array<pollfd, 2> ready{pollfd{wake.number, POLLIN, 0}, pollfd{output, 0, 0}};  // POLLHUP alone
      const int events = ::poll(ready.data(), ready.size(), output < 0 ? -1 : kLook_ms);
      std::uint64_t count = 0;
      (void)!::read(wake.number, &count, sizeof count);
      const std::lock_guard lock(mutex);
      if (!watched || child.output.number != output) continue;
      // A driver that spins keeps the core from the thread that waits for it: that thread cannot tell. Looks are
      // counted, not time: this program may have been stopped.
      const std::uint64_t seen = begins_and_ends.load(std::memory_order_acquire);
      looks = events == 0 && seen % 2 == 1 && seen == seen_before ? looks + 1 : 0;
      seen_before = seen;
      if (looks >= kLooks) silent = lost = true;
      const bool ended = (ready[1].revents & (POLLHUP | POLLERR)) != 0;
      if (!ended && !lost) continue;
      // A driver that says that its device is lost is closing it, with zero force; one that is silent hangs.
      const std::optional<std::string> words = outputOf(child, silent ? 0 : kLost_ms);
      say(words.value_or(""));
      reap(words.has_value());
      rescue();
    }
  }

  void rouse() noexcept {
    const std::uint64_t one = 1;
    (void)!::write(wake.number, &one, sizeof one);
  }

  // A process that sleeps on another core takes 60 us longer to wake. A thread without real-time priority may have to
  // leave the core to one that has it, so it is not kept there.
  void placeOnOneCore() const noexcept {
    int policy = SCHED_OTHER;
    sched_param priority{};
    const int core = ::sched_getcpu();
    if (::pthread_getschedparam(::pthread_self(), &policy, &priority) != 0 || policy == SCHED_OTHER || core < 0) return;
    cpu_set_t only;
    CPU_ZERO(&only);
    CPU_SET(core, &only);
    if (::sched_setaffinity(process_id, sizeof only, &only) == 0)
      static_cast<void>(::pthread_setaffinity_np(::pthread_self(), sizeof only, &only));
  }

  void setWatched() {
    const std::lock_guard lock(mutex);
    watched = child.id >= 0;
    lost = silent = placed = false;
    last_words = "";
    rouse();
  }

  // Runs what connects. If it fails, the driver's own words are the reason.
  template <class Connects>
  void connected(const Connects& connects) {
    try {
      connects();
      setWatched();
    } catch (const DeviceError&) {
      const std::lock_guard lock(mutex);
      const std::optional<std::string> words = child.id >= 0 ? outputOf(child, 200) : std::nullopt;
      if (child.id >= 0) reap(words.has_value());
      if (words && !words->empty()) throw DeviceError(*words);
      throw;
    }
  }
};

ProcessDevice::ProcessDevice(ProcessDeviceOptions options) : impl_(std::make_unique<Impl>()) {
  Impl& d = *impl_;
  d.options = std::move(options);
  BridgeOptions bridge;
  bridge.address = d.options.device;
  bridge.period_s = d.options.period_s;
  bridge.answer_s = kAnswer_s;
  bridge.silence_s = kSilence_s;
  bridge.connect_s = kOpening_s;
  bridge.connect = [&d] { return d.connect(); };
  d.connected([&] { d.bridge.emplace(bridge); });
  d.watcher = std::thread([&d] { d.watch(); });
}

ProcessDevice::~ProcessDevice() {
  close();
  impl_->ends = true;
  impl_->rouse();
  if (impl_->watcher.joinable()) impl_->watcher.join();
}

const DeviceCapabilities& ProcessDevice::capabilities() const { return impl_->bridge->capabilities(); }

DeviceStatus ProcessDevice::status() const noexcept { return impl_->bridge->status(); }

void ProcessDevice::open() {
  impl_->connected([this] { impl_->bridge->open(); });
}

void ProcessDevice::close() noexcept {
  {
    const std::lock_guard lock(impl_->mutex);
    impl_->watched = false;
  }
  const std::uint64_t unanswered = impl_->bridge->counters().unanswered;
  impl_->bridge->close();
  const bool took_zero = impl_->bridge->counters().unanswered == unanswered;
  const std::lock_guard lock(impl_->mutex);
  impl_->end(took_zero ? kEnd_ms : kDoubtfulEnd_ms);
}

DeviceState ProcessDevice::exchange(const Wrench& wrench) noexcept {
  if (!impl_->placed.exchange(true, std::memory_order_relaxed)) impl_->placeOnOneCore();
  impl_->begins_and_ends.fetch_add(1, std::memory_order_relaxed);
  const DeviceState state = impl_->bridge->exchange(wrench);
  impl_->begins_and_ends.fetch_add(1, std::memory_order_release);
  if (state.status == DeviceStatus::fault && !impl_->lost) {
    impl_->silent = impl_->bridge->isSilent();
    impl_->lost = true;
    impl_->rouse();
  }
  return state;
}

void ProcessDevice::lead(const Eigen::Vector3d& target_D) noexcept { impl_->bridge->lead(target_D); }

const char* ProcessDevice::advice() const noexcept {
  if (const char* const last = impl_->last_words.load(std::memory_order_acquire); *last != '\0') return last;
  const char* const own = impl_->bridge->advice();
  if (*own != '\0' || !impl_->lost) return own;
  return impl_->silent ? "the process that drives the device did not answer" : "the device or its process was lost";
}

int ProcessDevice::processId() const noexcept { return impl_->process_id; }

ProcessRescues ProcessDevice::rescues() const noexcept { return {impl_->begun, impl_->zeroed}; }

}  // namespace filiform
