// If any call fails during an ingest, the old set or the new set is whole, and nothing else is left.
#include "index/errors.h"
#include "index/ingest/ingest.h"
#include "index/input/input.h"
#include "index/verify/verify.h"
#include "tests/groups/faults/failing_calls.h"
#include "tests/support/campaign.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"

#include <csignal>
#include <cstdlib>
#include <exception>
#include <execinfo.h>
#include <filesystem>
#include <functional>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <sys/wait.h>
#include <system_error>
#include <unistd.h>

#include <gtest/gtest.h>

#if defined(__SANITIZE_ADDRESS__)
extern "C" int __lsan_do_recoverable_leak_check();
// nlohmann::json leaks what it has copied if its memory ends within a list of values.
extern "C" const char* __lsan_default_suppressions() { return "leak:nlohmann::"; }
#endif

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::FailingCalls;
using test::Kind;
using test::wholeCampaign;

bool leaks() {
#if defined(__SANITIZE_ADDRESS__)
  return __lsan_do_recoverable_leak_check() != 0;
#else
  return false;
#endif
}

std::size_t openFiles() {
  std::size_t count = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator("/proc/self/fd")) ++count;
  return count;
}

class FailingIngest : public ::testing::Test {
 protected:
  FailingIngest() {
    fs::create_directory(folder_ / "in");
    for (int i = 0; i < 3; ++i) {
      std::string text = "# " + std::to_string(i) + "\n1 1 0 0 0 5 -1\n";
      for (int s = 2; s < 40; ++s)
        text += std::to_string(s) + " 3 " + std::to_string(7 * s + i) + " " + std::to_string(s * s % 17) + " " +
                std::to_string(i * 3) + " 1 " + std::to_string(s % 5 == 0 ? s / 2 : s - 1) + "\n";
      test::writeBytes(folder_ / "in/" + std::to_string(i) + ".swc", text);
    }
    make(8);
    old_ = revision();
    fs::copy(path_, folder_ / "old", fs::copy_options::recursive);
    make(16);
    new_ = revision();
    restore();
  }

  void make(std::uint32_t capacity) const { makeAt(path_, capacity); }
  void makeAt(const std::string& path, std::uint32_t capacity) const {
    Input input({folder_ / "in"});
    IngestOptions options{.capacity = capacity, .threads = 2, .chunk_segments = 30, .levels = true, .force = true};
    // As with --strict: a file that cannot be read ends the ingest, so that only two sets are possible.
    options.provenance = [&] {
      if (anyRefused(input.reports())) throw InputError(summary(input.reports()));
      return Provenance{};
    };
    ingest(input, path, options);
  }
  std::string revision() const {
    std::string text = test::readBytes(path_ + "/CURRENT");
    text.pop_back();
    return text;
  }
  void restore() const {
    fs::remove_all(path_);
    fs::copy(folder_ / "old", path_, fs::copy_options::recursive);
  }
  static std::set<std::string> namesIn(const std::string& path) {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(path)) names.insert(entry.path().filename().string());
    return names;
  }
  // Expects the old set or the new set, whole. Returns true if it is the new set.
  bool expectWhole() const {
    const std::string now = revision();
    EXPECT_TRUE(now == old_ || now == new_) << now;
    const VerifyReport report = verify(path_);
    EXPECT_TRUE(report.sound()) << report.problems.front();
    return now == new_;
  }
  // An old revision may stay beside the new one: both are needed until the new one is on the disk, and the next ingest
  // removes what cannot be removed now.
  void expectNothingElse(bool old_may_stay = false) const {
    std::set<std::string> names = namesIn(path_);
    if (old_may_stay && revision() == new_) names.erase(old_);
    EXPECT_EQ(names, (std::set<std::string>{"CURRENT", revision()}));
  }

  test::TempFolder folder_;
  std::string path_ = folder_ / "a.fil", old_, new_;
};

int where_to_tell = 2;
constexpr int kEnded = 77;
void endHere(int) {
  void* frames[64];
  ::backtrace_symbols_fd(frames, ::backtrace(frames, 64), where_to_tell);
  ::_exit(kEnded);
}

// Does the work in a child. Returns its message, or nullopt if a library ended the process for lack of memory. Leaks
// end the child with another code.
std::optional<std::string> saidInAChild(const std::function<std::string()>& work) {
  int ends[2];
  if (::pipe(ends) != 0) throw std::runtime_error("no pipe");
  void* frame = nullptr;
  ::backtrace(&frame, 1);  // the first call allocates
  const pid_t child = fork();
  if (child == 0) {
    where_to_tell = ends[1];
    std::set_terminate([] { endHere(SIGABRT); });
    std::signal(SIGABRT, endHere);  // raised by an assertion in that library
    const std::string said = work();
    const bool told = ::write(ends[1], said.data(), said.size()) == static_cast<ssize_t>(said.size());
    _exit(told && !leaks() ? 0 : 1);
  }
  ::close(ends[1]);
  std::string said;
  char some[4096];
  for (ssize_t n; (n = ::read(ends[0], some, sizeof some)) > 0;) said.append(some, static_cast<std::size_t>(n));
  ::close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  EXPECT_TRUE(WIFEXITED(status)) << "ended by signal " << WTERMSIG(status);
  if (WIFEXITED(status) && WEXITSTATUS(status) == kEnded) {
    // basic_json's destructor (inlined into the reader of the manifest) and std::filesystem's iterators allocate where
    // they must not throw.
    const auto names = [&said](const char* part) { return said.find(part) != std::string::npos; };
    EXPECT_TRUE(names("nlohmann") || names("Manifest") || names("Provenance") || names("10filesystem"))
        << "by neither library:\n"
        << said;
    return std::nullopt;
  }
  EXPECT_EQ(status, 0) << "leaks?";
  return said;
}

// Runs the work and returns the message of an error that the program maps to an exit code and one line.
std::string outcomeOf(const std::function<void()>& what) {
  try {
    what();
    return "";
  } catch (const Error& error) {
    return error.what();
  } catch (const std::bad_alloc&) {
    return "out of memory";
  }
}

TEST_F(FailingIngest, TheOldSetOrTheNewWhicheverCallFails) {
  std::uint64_t runs = 0, failed = 0, ended_by_library = 0, of_memory = 0;
  for (const Kind kind : test::kKinds) {
    std::uint64_t calls = 0;
    {
      FailingCalls counting(kind, {});
      make(16);
      calls = counting.end();
    }
    ASSERT_GT(calls, 0u) << test::toString(kind) << ": the shim sees nothing";
    restore();
    const std::uint64_t most = wholeCampaign() ? calls : test::kSanitized ? 8 : 30;
    const std::uint64_t step = std::max<std::uint64_t>(1, calls / most);
    for (const bool for_ever : {false, true}) {
      for (std::uint64_t k = 1; k <= calls; k += k < 4 ? 1 : step) {
        SCOPED_TRACE(std::string(test::toString(kind)) + (for_ever ? " from call " : " call ") + std::to_string(k) +
                     " of " + std::to_string(calls));
        const std::size_t files = openFiles();
        const auto run = [&] {
          FailingCalls faults(kind, {.at = k, .for_ever = for_ever});
          std::string said = outcomeOf([&] { make(16); });
          faults.end();
          return said;
        };
        const std::optional<std::string> answer = kind == Kind::memory ? saidInAChild(run) : run();
        const std::string said = answer.value_or("ended");
        ++runs;
        of_memory += kind == Kind::memory;
        ended_by_library += !answer;
        failed += !said.empty();
        EXPECT_EQ(openFiles(), files) << "files left open";
        const bool is_new = expectWhole();
        EXPECT_TRUE(is_new || !said.empty()) << "it failed and did not say so";
        // Without memory, or without listing folders, nothing can be removed; the next ingest does it.
        if (answer && (!for_ever || (kind != Kind::memory && kind != Kind::open))) expectNothingElse(true);
        if (is_new || namesIn(path_).size() != 2) restore();
        if (HasFatalFailure() || HasNonfatalFailure()) return;
      }
    }
  }
  EXPECT_GT(failed, runs / 2);
  EXPECT_LT(ended_by_library, of_memory / 4);
  test::tell(std::to_string(runs) + " ingests with a failing call: " + std::to_string(failed) + " ended by it, " +
             std::to_string(ended_by_library) + " of these at once");
}

// Whichever read fails, only this file is refused or the run ends.
TEST_F(FailingIngest, AFileThatCannotBeReadIsRefusedAlone) {
  const auto readAll = [&](std::vector<std::string>& sources) {
    Input input({folder_ / "in"});
    for (Cell cell; input.next(cell);) sources.push_back(cell.source);
    const InputTotals sum = totals(input.reports());
    EXPECT_EQ(sum.accepted, sources.size());
    EXPECT_EQ(sum.refused, 3 - sources.size());
    EXPECT_EQ(sum.codes[InputCode::E_UNREADABLE], 3 - sources.size());
  };
  std::uint64_t calls = 0;
  {
    std::vector<std::string> sources;
    FailingCalls counting(Kind::read, {});
    readAll(sources);
    calls = counting.end();
    ASSERT_EQ(sources.size(), 3u);
  }
  ASSERT_GE(calls, 6u);  // a block and the end of each file
  for (std::uint64_t k = 1; k <= calls; ++k) {
    SCOPED_TRACE("read " + std::to_string(k));
    std::vector<std::string> sources;
    FailingCalls faults(Kind::read, {.at = k});
    readAll(sources);
    faults.end();
    EXPECT_EQ(sources.size(), 2u);
  }
}

TEST_F(FailingIngest, WithoutAnOldSetNothingIsLeft) {
  for (const Kind kind : {Kind::open, Kind::write, Kind::sync, Kind::rename, Kind::make_folder}) {
    for (std::uint64_t k = 1; k < 60; k += 1 + k / 4) {
      SCOPED_TRACE(std::string(test::toString(kind)) + " call " + std::to_string(k));
      const std::string fresh = folder_ / "fresh.fil";
      FailingCalls faults(kind, {.at = k});
      const std::string said = outcomeOf([&] { makeAt(fresh, 16); });
      faults.end();
      if (fs::exists(fresh)) {
        EXPECT_TRUE(verify(fresh).sound());
        EXPECT_EQ(namesIn(fresh), (std::set<std::string>{"CURRENT", new_}));
      } else {
        EXPECT_NE(said, "");
      }
      fs::remove_all(fresh);
    }
  }
}

// Does the work in a child that dies as planned. Returns true if it died.
bool diesDoing(const std::function<void()>& work, const FailingCalls::Plan& plan) {
  const pid_t child = fork();
  if (child == 0) {
    FailingCalls faults(Kind::any_file, plan);
    outcomeOf(work);
    faults.end();
    _exit(0);
  }
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFSIGNALED(status);
}

TEST_F(FailingIngest, KilledAtAnyCallOldOrNew) {
  std::uint64_t killed = 0, new_ones = 0;
  const std::uint64_t step = wholeCampaign() ? 1 : test::kSanitized ? 25 : 7;
  for (std::uint64_t k = 1;; k += step) {
    SCOPED_TRACE("call " + std::to_string(k));
    if (!diesDoing([&] { make(16); }, {.at = k, .what = FailingCalls::What::die})) break;
    ++killed;
    new_ones += expectWhole();
    make(8);  // removes the leftovers; the old set again
    expectNothingElse();
    ASSERT_EQ(revision(), old_);
    ASSERT_FALSE(HasNonfatalFailure());
  }
  EXPECT_GT(killed, 5u);
  test::tell("ingest killed at " + std::to_string(killed) + " calls: " + std::to_string(new_ones) +
             " times the new set, else the old");
}

TEST_F(FailingIngest, KilledAtAnyTimeOldOrNew) {
  std::mt19937_64 random(8);
  const int times = wholeCampaign() ? 1000 : test::kSanitized ? 5 : 20;
  int killed = 0, new_ones = 0;
  for (int i = 0; i < times; ++i) {
    const pid_t child = fork();
    if (child == 0) {
      for (std::uint32_t capacity = 16;; capacity = 24 - capacity) make(capacity);
    }
    ::usleep(static_cast<useconds_t>(random() % 20000));
    ::kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    killed += WIFSIGNALED(status);
    new_ones += expectWhole();
    ASSERT_FALSE(HasNonfatalFailure()) << "after " << i;
  }
  make(8);
  expectNothingElse();
  EXPECT_EQ(killed, times);
  test::tell("ingest killed " + std::to_string(killed) + " times at random: " + std::to_string(new_ones) +
             " times the new set, else the old");
}

int shell(const std::string& line) { return std::system(("( " + line + " ) >/dev/null 2>&1").c_str()); }

// The disk at the moment of a power cut: a copy of a mounted file system's image. After the end of an ingest, the new
// set must be there.
TEST_F(FailingIngest, OldOrNewAfterAPowerCut) {
  if (test::kSanitized) GTEST_SKIP() << "the plain test looks at it";
  const test::TempFolder place;
  const std::string image = place / "disk", cut = place / "cut", mount = place / "mount", after = place / "after";
  fs::create_directory(mount);
  fs::create_directory(after);
  if (shell("truncate -s 16M " + image + " && mkfs.ext4 -q " + image + " && mount -o loop " + image + " " + mount) != 0)
    GTEST_SKIP() << "no loop mount here (it needs root and a loop device)";
  const auto unmount = [&] { shell("umount " + after + "; umount " + mount); };
  const std::string path = mount + "/a.fil";
  makeAt(path, 8);
  std::uint64_t calls = 0;
  {
    FailingCalls counting(Kind::any_file, {});
    makeAt(path, 16);
    calls = counting.end();
  }
  std::mt19937_64 random(9);
  const int times = wholeCampaign() ? 200 : 3;
  int new_ones = 0;
  for (int i = 0; i < times && !HasFailure(); ++i) {
    makeAt(path, 8);
    shell("sync -f " + mount);
    // The last calls publish the set. Half of the cuts are among them or after the end. Their number varies a little.
    const std::uint64_t at =
        i % 2 == 0 ? 1 + random() % calls : calls + 8 - random() % std::min<std::uint64_t>(calls, 24);
    SCOPED_TRACE("call " + std::to_string(at) + " of " + std::to_string(calls));
    const pid_t child = fork();
    if (child == 0) {
      FailingCalls faults(Kind::any_file, {.at = at, .what = FailingCalls::What::stand_still});
      outcomeOf([&] { makeAt(path, 16); });
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, WUNTRACED);
    const bool ended = WIFEXITED(status);
    const bool copied =
        shell("cp --sparse=always " + image + " " + cut + " && mount -o loop " + cut + " " + after) == 0;
    ::kill(child, SIGKILL);
    if (!ended) waitpid(child, &status, 0);
    EXPECT_TRUE(copied);
    if (!copied) break;
    std::string now = test::readBytes(after + "/a.fil/CURRENT");
    EXPECT_TRUE(now == new_ + "\n" || (now == old_ + "\n" && !ended)) << now << "; ingest had ended: " << ended;
    new_ones += now == new_ + "\n";
    const VerifyReport report = verify(after + "/a.fil");
    EXPECT_TRUE(report.sound()) << report.problems.front();
    shell("umount " + after);
  }
  unmount();
  test::tell(std::to_string(times) + " power cuts: " + std::to_string(new_ones) + " times the new set, else the old");
}

}  // namespace
}  // namespace filiform
