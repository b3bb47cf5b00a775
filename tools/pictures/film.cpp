#include "tools/pictures/film.h"

#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"
#include "tools/pictures/png.h"
#include "tools/program/interruption.h"
#include "tools/words/numbers.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace filiform::tools {

namespace {

namespace fs = std::filesystem;

// The position of the number in the name of a sequence.
struct Number {
  std::size_t begin, end;
  int digits;
};
std::optional<Number> numberIn(const std::string& name) {
  const std::size_t begin = name.find('%');
  if (begin == std::string::npos || name.find('%', begin + 1) != std::string::npos) return std::nullopt;
  std::size_t end = begin + 1;
  int digits = 0;
  for (; end < name.size() && name[end] >= '0' && name[end] <= '9'; ++end) digits = 10 * digits + (name[end] - '0');
  if (end >= name.size() || name[end] != 'd' || digits > 9) return std::nullopt;
  return Number{begin, end + 1, digits};
}

bool isFileName(const std::string& name) {
  const std::string end = fs::path(name).extension().string();
  return end == ".mp4" || end == ".mkv" || end == ".webm" || end == ".mov";
}

bool isOnPath(const std::string& program) {
  const char* const path = std::getenv("PATH");
  std::string rest = path != nullptr ? path : "";
  while (!rest.empty()) {
    const std::size_t colon = std::min(rest.find(':'), rest.size());
    std::string full = rest.substr(0, colon);
    full += '/';
    full += program;
    if (::access(full.c_str(), X_OK) == 0) return true;
    rest.erase(0, colon + 1);
  }
  return false;
}

}  // namespace

bool isFilmName(const std::string& name) { return isFileName(name) || numberIn(name).has_value(); }

bool isSequenceName(const std::string& name) { return !isFileName(name) && numberIn(name).has_value(); }

std::vector<std::string> filesOfSequence(const std::string& name) {
  const std::optional<Number> number = isSequenceName(name) ? numberIn(name) : std::nullopt;
  std::vector<std::string> files;
  if (!number) return files;
  const fs::path pattern(name);
  const std::string folder = pattern.parent_path().empty() ? "." : pattern.parent_path().string();
  const std::size_t skipped = name.size() - pattern.filename().string().size();
  if (number->begin < skipped) return files;  // the number is in the folder's name
  const std::string before = name.substr(skipped, number->begin - skipped), after = name.substr(number->end);
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string file = at->path().filename().string();
    if (file.size() <= before.size() + after.size() || !file.starts_with(before) || !file.ends_with(after)) continue;
    const std::string digits = file.substr(before.size(), file.size() - before.size() - after.size());
    if (digits.find_first_not_of("0123456789") == std::string::npos) files.push_back(at->path().string());
  }
  return files;
}

struct Film::Impl {
  std::string out, note;
  std::optional<Output> file;  // filled by ffmpeg
  int width, height;
  std::uint64_t pictures = 0;
  std::optional<Number> number;  // for a sequence
  pid_t encoder = -1;
  int to_encoder = -1, from_encoder = -1;

  void start(double pictures_s);
  // Closes the pipe and waits for the encoder. Returns the encoder's last messages; empty if it succeeded.
  std::string end();
};

void Film::Impl::start(double pictures_s) {
  file.emplace(out, OutputOptions{.by_name = true, .cancel = &interruptFlag()});

  // A socket, not a pipe: writing to an encoder that has ended must not end this program.
  std::array<int, 2> pictures_in{}, words_out{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pictures_in.data()) != 0 ||
      ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, words_out.data()) != 0)
    throw IoError(inShort(out), "cannot start ffmpeg", errno);
  std::string size = std::to_string(width);
  size += 'x';
  size += std::to_string(height);
  // Players need even sides. Their colours have half the resolution.
  std::vector<std::string> words{"ffmpeg",
                                 "-nostdin",
                                 "-loglevel",
                                 "error",
                                 "-y",
                                 "-f",
                                 "rawvideo",
                                 "-pix_fmt",
                                 "rgb24",
                                 "-s",
                                 size,
                                 "-r",
                                 formatNumber(pictures_s),
                                 "-i",
                                 "pipe:0",
                                 "-vf",
                                 "crop=trunc(iw/2)*2:trunc(ih/2)*2",
                                 "-pix_fmt",
                                 "yuv420p",
                                 file->partialPath()};
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pictures_in[1], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, words_out[1], STDERR_FILENO);
  const int failed = ::posix_spawnp(&encoder, "ffmpeg", &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(pictures_in[1]);
  ::close(words_out[1]);
  to_encoder = pictures_in[0];
  from_encoder = words_out[0];
  if (failed != 0) {
    encoder = -1;
    throw IoError(inShort(out), "cannot start ffmpeg", failed);
  }
}

std::string Film::Impl::end() {
  if (to_encoder >= 0) ::close(to_encoder);
  to_encoder = -1;
  std::string words;
  std::array<char, 512> some{};
  for (ssize_t n = 0; (n = ::read(from_encoder, some.data(), some.size())) > 0;)
    if (words.size() < 2000) words.append(some.data(), static_cast<std::size_t>(n));
  ::close(from_encoder);
  from_encoder = -1;
  int status = 0;
  while (::waitpid(encoder, &status, 0) < 0 && errno == EINTR) {
  }
  encoder = -1;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  std::replace(words.begin(), words.end(), '\n', ' ');
  return words.empty() ? "it ended without a message" : words;
}

Film::Film(const std::string& out, int width, int height, double pictures_s) : impl_(std::make_unique<Impl>()) {
  impl_->out = out;
  impl_->width = width;
  impl_->height = height;
  if (!(pictures_s > 0) || !std::isfinite(pictures_s))
    throw UsageError("the rate of a film must be more than 0 pictures a second");
  impl_->number = numberIn(out);
  if (impl_->number) return;
  if (!isFileName(out)) {
    std::string text = inShort(out);
    text += ": a film is FILE.mp4, .mkv, .webm or .mov, or a sequence of pictures such as FILE-%05d.png";
    throw UsageError(text);
  }
  if (width < 2 || height < 2) throw UsageError("a film must be at least 2 x 2 pixels large");
  if (isOnPath("ffmpeg")) {
    impl_->start(pictures_s);
    return;
  }
  impl_->out = fs::path(out).replace_extension().string();
  impl_->out += "-%05d.png";
  impl_->number = numberIn(impl_->out);
  if (!impl_->number) throw UsageError(inShort(out) + ": without ffmpeg the name must not contain %");
  impl_->note = "no ffmpeg found (apt-get install ffmpeg), so there is no film; the pictures are ";
  impl_->note += inShort(impl_->out);
}

Film::~Film() {
  if (impl_->encoder < 0) return;
  ::kill(impl_->encoder, SIGTERM);
  impl_->end();
}

void Film::add(const Picture& picture) {
  ++impl_->pictures;
  if (impl_->number) {
    std::string digits = std::to_string(impl_->pictures);
    const auto wanted = static_cast<std::size_t>(impl_->number->digits);
    if (digits.size() < wanted) digits.insert(0, wanted - digits.size(), '0');
    std::string name = impl_->out;
    name.replace(impl_->number->begin, impl_->number->end - impl_->number->begin, digits);
    writePng(picture, name);
    return;
  }
  for (std::size_t sent = 0; sent < picture.rgb.size();) {
    const ssize_t n = ::send(impl_->to_encoder, picture.rgb.data() + sent, picture.rgb.size() - sent, MSG_NOSIGNAL);
    if (n > 0) {
      sent += static_cast<std::size_t>(n);
      continue;
    }
    if (errno == EINTR) continue;
    const std::string words = impl_->end();
    throw IoError(inShort(impl_->out), "ffmpeg failed: " + escaped(words, 600));
  }
}

void Film::finish() {
  if (impl_->encoder < 0) return;
  const std::string words = impl_->end();
  if (!words.empty()) throw IoError(inShort(impl_->out), "ffmpeg failed: " + escaped(words, 600));
  impl_->file->finish();
}

const std::string& Film::out() const noexcept { return impl_->out; }
const std::string& Film::note() const noexcept { return impl_->note; }
std::uint64_t Film::pictures() const noexcept { return impl_->pictures; }

}  // namespace filiform::tools
