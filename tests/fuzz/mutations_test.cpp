// Each fuzz target on its seeds, then on random mutations of them: as many as kTargets states, or
// FILIFORM_FUZZ_MUTATIONS; drawn with seed 1, or FILIFORM_FUZZ_SEED. A child process runs the inputs. If the child ends
// early, the test makes the current input again and writes it to a file.
#include "tests/fuzz/fuzzers.h"
#include "tests/support/folders.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <new>
#include <random>
#include <set>
#include <string>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>

// The address sanitizer's limits are those of tools/fuzz.
extern "C" const char* __asan_default_options();  // NOLINT
const char* __asan_default_options() {            // NOLINT
  return "max_allocation_size_mb=512:hard_rss_limit_mb=1024:quarantine_size_mb=16";
}

namespace filiform::fuzz {
namespace {

constexpr unsigned kMostSeconds = 20;  // for one input

class Inputs {
 public:
  Inputs(const std::string& target, std::uint64_t random_seed) : random_(random_seed) {
    std::set<std::filesystem::path> paths;
    for (const auto& entry : std::filesystem::directory_iterator(test::inSource("tests/fuzz/seeds/" + target)))
      paths.insert(entry.path());
    for (const auto& path : paths) {
      std::ifstream file(path, std::ios::binary);
      seeds_.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
      most_ = std::max(most_, seeds_.back().size());
    }
    const auto in_word = [](unsigned char byte) { return std::isgraph(byte) != 0; };
    for (const std::string& seed : seeds_)
      for (auto from = seed.begin(), to = from; from != seed.end(); from = to) {
        from = std::find_if(to, seed.end(), in_word);
        to = std::find_if_not(from, seed.end(), in_word);
        tokens_.emplace_back(from, to);
      }
  }

  std::size_t seeds() const { return seeds_.size(); }

  // The seeds one by one, then mutations of them. Every object gives the same sequence.
  std::string next() {
    if (given_ < seeds_.size()) return seeds_[given_++];
    std::string bytes = any(seeds_);
    for (std::size_t changes = 1 + below(5); changes > 0; --changes) change(bytes);
    bytes.resize(std::min(bytes.size(), most_));
    return bytes;
  }

 private:
  std::size_t below(std::size_t end) { return random_() % end; }
  const std::string& any(const std::vector<std::string>& from) { return from[below(from.size())]; }
  std::string part(const std::string& of) {
    return of.substr(below(of.size() + 1), 1 + below(below(4) == 0 ? of.size() + 1 : 16));
  }

  // The bytes of a number at a boundary: 2^n, less one or two, or the negative of that; one to eight bytes.
  std::string boundary() {
    const std::uint64_t number = (std::uint64_t{1} << below(64)) - below(3), value = below(2) == 0 ? number : -number;
    std::string bytes(std::size_t{1} << below(4), '\0');
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(value >> 8 * i);
    return bytes;
  }

  // Flips a bit, erases a part, or puts something in, before or over what is there.
  void change(std::string& bytes) {
    const std::size_t at = below(bytes.size() + 1);
    std::string piece;
    switch (below(8)) {
      case 0:
        if (at < bytes.size()) bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
        return;
      case 1:
        bytes.erase(at, part(bytes).size());
        return;
      case 2:
        piece = std::string(1 + below(8), static_cast<char>(below(256)));
        break;
      case 3:
        piece = part(any(seeds_));
        break;
      case 4: {
        const std::string again = part(bytes);
        for (std::size_t count = 1 + below(32); count > 0; --count) piece += again;
        break;
      }
      case 5:
        piece = boundary();
        break;
      case 6:
        piece = std::to_string(static_cast<std::int64_t>((std::uint64_t{1} << below(64)) - below(3)));
        break;
      default:
        piece = any(tokens_);
    }
    bytes.replace(at, below(2) == 0 ? 0 : piece.size(), piece);
  }

  std::vector<std::string> seeds_, tokens_;
  std::size_t most_ = 1024;  // or as long as the longest seed
  std::size_t given_ = 0;
  std::mt19937_64 random_;
};

std::uint64_t setting(const char* name, std::uint64_t otherwise) {
  const char* const text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

class Survival : public testing::Test {
 public:
  explicit Survival(const Target& target) : target_(target) {}

 private:
  void TestBody() override {
    const std::uint64_t seed = setting("FILIFORM_FUZZ_SEED", 1);
    const std::uint64_t mutations = setting("FILIFORM_FUZZ_MUTATIONS", target_.mutations);
    Inputs inputs(target_.name, seed), again(target_.name, seed);
    const std::uint64_t count = inputs.seeds() + mutations;
    std::cout << target_.name << ": " << inputs.seeds() << " seeds, " << mutations << " mutations, random seed " << seed
              << std::endl;
    using Counter = std::atomic<std::uint64_t>;
    void* const shared = ::mmap(nullptr, sizeof(Counter), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    ASSERT_NE(shared, MAP_FAILED);
    Counter& done = *new (shared) Counter(0);
    std::fflush(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
      for (; done < count; ++done) {
        const std::string bytes = inputs.next();
        ::alarm(kMostSeconds);
        target_.run({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
      }
      std::exit(0);  // the address sanitizer then looks for leaks
    }
    int status = -1;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    if (status == 0) return;
    ASSERT_LT(done, count) << "an input leaks memory; tools/fuzz 60 " << target_.name << " finds which";
    const auto path = std::filesystem::temp_directory_path() / (std::string("filiform-fuzz-") + target_.name);
    for (std::uint64_t i = 0; i < done; ++i) again.next();
    std::ofstream(path, std::ios::binary) << again.next();
    FAIL() << "the process ended at input " << done
           << (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM ? ", which takes too long" : "")
           << "; its bytes are in " << path.string() << "; a copy in tests/fuzz/seeds/" << target_.name
           << " is run first";
  }

  const Target& target_;
};

}  // namespace
}  // namespace filiform::fuzz

// A suite for each target, so that ctest runs them side by side.
int main(int argc, char** argv) {
  using namespace filiform::fuzz;
  testing::InitGoogleTest(&argc, argv);
  for (const Target& target : kTargets)
    testing::RegisterTest((std::string("Fuzz/") + target.name).c_str(), "SurvivesMutations", nullptr, nullptr, __FILE__,
                          __LINE__, [&target] { return new Survival(target); });
  return RUN_ALL_TESTS();
}
