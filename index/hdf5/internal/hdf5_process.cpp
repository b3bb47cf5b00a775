#include "index/hdf5/internal/hdf5_process.h"

#include "index/errors.h"
#include "index/file/internal/bytes.h"
#include "index/file/internal/digest.h"
#include "index/hdf5/hdf5_program.h"
#include "index/text.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <poll.h>
#include <pthread.h>
#include <spawn.h>
#include <sstream>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

namespace filiform::internal {
namespace {

namespace fs = std::filesystem;
constexpr const char* kProgram = "filiform-hdf5";
constexpr std::size_t kPipeBytes = std::size_t{1} << 16;
constexpr std::chrono::milliseconds kWaitStep{100};

int secondsWithoutBytes() {
  const char* const given = std::getenv("FILIFORM_HDF5_SECONDS");
  const int seconds = given != nullptr ? std::atoi(given) : 0;
  return seconds > 0 ? seconds : Hdf5Process::kSeconds;
}

struct NamedProgram {
  std::mutex mutex;
  std::string path;
};
NamedProgram& namedProgram() {
  static NamedProgram program;
  return program;
}

// The program's path; its bare name if it is nowhere.
std::string programPath() {
  if (const char* const given = std::getenv("FILIFORM_HDF5"); given != nullptr && *given != '\0') return given;
  std::vector<fs::path> folders;
  std::error_code error;
  folders.push_back(fs::read_symlink("/proc/self/exe", error).parent_path());
  Dl_info place{};
  if (dladdr(reinterpret_cast<const void*>(&programPath), &place) != 0 && place.dli_fname != nullptr)
    folders.push_back(fs::absolute(place.dli_fname, error).parent_path());
  const char* const path = std::getenv("PATH");
  std::istringstream listed(path != nullptr ? path : "");
  for (std::string folder; std::getline(listed, folder, ':');)
    if (fs::path(folder).is_absolute()) folders.emplace_back(folder);
  std::vector<fs::path> candidates;
  for (const fs::path& folder : folders) {
    candidates.push_back(folder / kProgram);
    candidates.push_back(folder / ".." / "libexec" / "filiform" / kProgram);
  }
  {
    const std::lock_guard lock(namedProgram().mutex);
    candidates.emplace_back(namedProgram().path);
  }
#ifdef FILIFORM_INSTALLED_HDF5
  candidates.emplace_back(FILIFORM_INSTALLED_HDF5);
#endif
  for (const fs::path& candidate : candidates)
    if (!candidate.empty() && ::access(candidate.c_str(), X_OK) == 0) return candidate;
  return kProgram;
}

// The program is not there, or is none. Other failures to start it are a lack of memory or processes.
bool isAbsent(int error) {
  return error == ENOENT || error == ENOTDIR || error == EACCES || error == ENOEXEC || error == ELOOP;
}

// Blocks SIGPIPE for this thread, and discards one that a write has caused.
class NoPipeSignal {
 public:
  NoPipeSignal() {
    sigemptyset(&pipe_);
    sigaddset(&pipe_, SIGPIPE);
    sigset_t pending;
    sigpending(&pending);
    was_pending_ = sigismember(&pending, SIGPIPE) == 1;
    pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  NoPipeSignal(const NoPipeSignal&) = delete;
  NoPipeSignal& operator=(const NoPipeSignal&) = delete;
  ~NoPipeSignal() {
    const timespec now{};
    if (!was_pending_)
      while (sigtimedwait(&pipe_, nullptr, &now) < 0 && errno == EINTR) {
      }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }

 private:
  sigset_t pipe_{}, before_{};
  bool was_pending_ = false;
};

// How long a process has waited for a processor; 0 if the system does not say.
std::chrono::nanoseconds queuedTime(pid_t process) {
  std::ifstream in("/proc/" + std::to_string(process) + "/schedstat");
  std::int64_t ran = 0, queued = 0;
  in >> ran >> queued;
  return std::chrono::nanoseconds(in ? queued : 0);
}

// Waits for the end of a child process.
void reap(pid_t child) {
  while (::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
}

// The program died or hangs.
struct Ended {};

}  // namespace

void readAnswer(const std::function<void(std::span<std::uint8_t>)>& read, const UseRecord& use) {
  Bytes payload;
  for (;;) {
    std::array<std::uint8_t, 16> head{};
    read(head);
    ByteReader in(head);
    const std::uint32_t kind = in.u32(), size = in.u32();
    const std::uint64_t sum = in.u64();
    in.require(kind <= static_cast<std::uint32_t>(hdf5::RecordKind::skipped), "a record of an unknown kind");
    in.require(size <= hdf5::kMostPayload, "a record that is too large");
    payload.resize(size);
    read(payload);
    in.require(checksum(payload, kind) == sum, "a record whose checksum is wrong");
    const auto record = static_cast<hdf5::RecordKind>(kind);
    if (record == hdf5::RecordKind::end) return;
    if (record == hdf5::RecordKind::failure) throw Hdf5Failure{std::string(payload.begin(), payload.end())};
    use(record, payload);
  }
}

void splitNames(Hdf5Bytes payload, const std::function<void(std::string_view)>& use) {
  ByteReader in(payload);
  while (in.left() > 0) {
    const ByteSpan text = in.take(in.u32());
    use({reinterpret_cast<const char*>(text.data()), text.size()});
  }
}

void Hdf5Process::start() {
  const std::string program = programPath();
  Descriptor its_input, its_output;
  for (const auto& [reader, writer] : {std::pair(&its_input, &to_), std::pair(&from_, &its_output)}) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) throw IoError(program, "cannot start it", errno).asShortage();
    *reader = Descriptor(ends[0]);
    *writer = Descriptor(ends[1]);
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, its_input.number(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, its_output.number(), STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawnattr_t attributes;  // no blocked signals
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  std::string name = kProgram;
  char* arguments[] = {name.data(), nullptr};
  const int error = posix_spawnp(&child_, program.c_str(), &actions, &attributes, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  ::fcntl(to_.number(), F_SETFL, O_NONBLOCK);  // a program that hangs reads nothing
  if (error == 0) return;
  child_ = -1;
  IoError failure(program, "cannot start the program that reads HDF5 files; set FILIFORM_HDF5 to its path", error);
  if (!isAbsent(error)) throw failure.asShortage();
  throw failure;
}

void Hdf5Process::stop() noexcept {
  to_ = {};
  from_ = {};
  if (child_ > 0) {
    ::kill(child_, SIGKILL);
    reap(child_);
  }
  child_ = -1;
  buffer_.clear();
  at_ = 0;
}

// Waits for an event of a pipe. Returns false if none came in time.
bool Hdf5Process::waitFor(const Descriptor& file, short events) const {
  using std::chrono::steady_clock;
  std::chrono::nanoseconds waited{0}, queued = queuedTime(child_);
  while (waited < std::chrono::seconds(secondsWithoutBytes())) {
    const auto begun = steady_clock::now();
    pollfd waiting{file.number(), events, 0};
    const int ready = ::poll(&waiting, 1, static_cast<int>(kWaitStep.count()));
    if (ready > 0) return true;
    if (ready < 0 && errno != EINTR) return false;
    const auto now_queued = queuedTime(child_);
    const std::chrono::nanoseconds step = std::min<std::chrono::nanoseconds>(steady_clock::now() - begun, kWaitStep);
    waited += step - std::clamp<std::chrono::nanoseconds>(now_queued - queued, std::chrono::nanoseconds(0), step);
    queued = now_queued;
  }
  return false;
}

void Hdf5Process::send(Hdf5Bytes bytes) {
  const NoPipeSignal guard;
  while (!bytes.empty()) {
    const ssize_t n = ::write(to_.number(), bytes.data(), bytes.size());
    if (n > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(n));
    } else if (n == 0 || (errno != EINTR && errno != EAGAIN) || !waitFor(to_, POLLOUT)) {
      throw Ended();
    }
  }
}

void Hdf5Process::close() noexcept {
  to_ = {};
  if (child_ > 0 && waitFor(from_, POLLIN)) {
    pollfd ended{from_.number(), POLLIN, 0};
    if (::poll(&ended, 1, 0) > 0 && (ended.revents & POLLIN) == 0) {  // it closed its pipe, so it ends
      reap(child_);
      child_ = -1;
    }
  }
  stop();
}

void Hdf5Process::readSome(std::span<std::uint8_t> bytes) {
  while (!bytes.empty()) {
    if (at_ < buffer_.size()) {
      const std::size_t n = std::min(bytes.size(), buffer_.size() - at_);
      std::memcpy(bytes.data(), buffer_.data() + at_, n);
      at_ += n;
      bytes = bytes.subspan(n);
      continue;
    }
    buffer_.clear();
    at_ = 0;
    if (!waitFor(from_, POLLIN)) throw Ended();
    buffer_.resize(kPipeBytes);
    const ssize_t n = ::read(from_.number(), buffer_.data(), buffer_.size());
    const bool again = n < 0 && errno == EINTR;
    buffer_.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    if (n <= 0 && !again) throw Ended();
  }
}

// Why the program ended: its signal, or that it hangs. Ends it.
std::string Hdf5Process::deathOf() {
  int status = 0;
  // A program that crashed has ended, or ends within a moment after its pipe closed.
  for (int i = 0; child_ > 0 && i < 100; ++i) {
    const pid_t ended = ::waitpid(child_, &status, WNOHANG);
    if (ended == child_) {
      child_ = -1;
      stop();
      if (WIFSIGNALED(status)) {
        const char* const signal = sigabbrev_np(WTERMSIG(status));
        return std::string("the HDF5 library crashed on it (SIG") + (signal != nullptr ? signal : "?") +
               "): the file is damaged";
      }
      return "filiform-hdf5 ended on it with exit code " + std::to_string(WEXITSTATUS(status)) +
             (WEXITSTATUS(status) == 127 ? "; set FILIFORM_HDF5 to the path of the program" : "");
    }
    pollfd waiting{from_.number(), POLLIN, 0};
    if (::poll(&waiting, 1, 0) == 0) break;  // the pipe is open: it hangs
    ::usleep(10'000);
  }
  stop();
  return "the HDF5 library did not answer for " + std::to_string(secondsWithoutBytes()) + " s: the file is damaged";
}

void Hdf5Process::ask(const std::string& op, const std::string& file, const std::vector<std::string>& arguments,
                      const UseRecord& use, Hdf5Bytes values) {
  const bool writes = op == "write";
  std::vector<std::string> texts{op};
  if (!writes && op != "finish") texts.push_back(file);
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  ByteWriter request;
  request.u32(static_cast<std::uint32_t>(texts.size()));
  for (const std::string& text : texts) {
    if (text.size() > hdf5::kMostTextBytes) throw IoError(escaped(file, 200), "a name of it is too long");
    request.u32(static_cast<std::uint32_t>(text.size()));
    request.text(text);
  }
  if (child_ <= 0) start();
  std::string failure;
  try {
    send(request.bytes());
    for (bool more = writes; more;) {
      const Hdf5Bytes block = values.first(std::min<std::size_t>(values.size(), hdf5::kMostPayload));
      more = !block.empty();
      ByteWriter size;
      size.u32(static_cast<std::uint32_t>(block.size()));
      send(size.bytes());
      send(block);
      values = values.subspan(block.size());
    }
    readAnswer([this](std::span<std::uint8_t> part) { readSome(part); }, use);
    return;
  } catch (const Hdf5Failure& said) {  // the program waits for the next request
    failure = said.what;
  } catch (const Ended&) {
    failure = deathOf();
  } catch (const Damage& damage) {
    stop();
    failure = "filiform-hdf5 sent bytes that cannot be read: " + damage.what;
  } catch (...) {
    stop();
    throw;
  }
  throw IoError(inShort(file), escaped(failure, 400));
}

}  // namespace filiform::internal

bool filiform::nameHdf5Program(const std::string& path) {
  const std::lock_guard lock(internal::namedProgram().mutex);
  internal::namedProgram().path = path;
  return true;
}
