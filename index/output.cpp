#include "index/output.h"

#include "index/errors.h"
#include "index/internal/descriptor.h"
#include "index/text.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <optional>
#include <ostream>
#include <random>
#include <streambuf>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

namespace filiform {

namespace {

namespace fs = std::filesystem;
using internal::Descriptor;

constexpr std::size_t kOutputBuffer = std::size_t{1} << 16;

// Returns an unused NAME.partial-XXXXXX.ENDING in the same folder, so that a rename suffices.
std::string freshName(const std::string& folder, const std::string& name) {
  static constexpr std::string_view kDigits = "0123456789abcdefghijklmnopqrstuvwxyz";
  constexpr std::size_t kLongestStem = 180, kLongestEnding = 40;  // of at most 255 bytes in a name
  std::random_device random;
  std::string digits(8, '0');
  for (char& digit : digits) digit = kDigits[random() % kDigits.size()];
  const fs::path given(name);
  const std::string ending = given.extension().string();
  std::string fresh = folder;
  fresh += given.stem().string().substr(0, kLongestStem);
  fresh += ".partial-";
  fresh += digits;
  if (ending.size() <= kLongestEnding) fresh += ending;
  return fresh;
}

std::string folderOf(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? std::string() : path.substr(0, slash + 1);
}

// The N of /proc/self/fd/N and of links to it (/dev/stdout, /dev/fd/N); -1 for other names. Opening such a name again
// would start at the file's first byte and overwrite.
int descriptorNamedBy(const std::string& link) {
  std::error_code error;
  const std::string folder = folderOf(link);
  const std::string real = fs::canonical(folder.empty() ? "." : folder, error).string();
  std::string own = "/proc/";
  own += std::to_string(::getpid());
  if (error || real.rfind(own + "/", 0) != 0 || !real.ends_with("/fd")) return -1;
  const std::string number = link.substr(folder.size());
  if (number.empty() || number.size() > 6 || number.find_first_not_of("0123456789") != std::string::npos) return -1;
  return std::atoi(number.c_str());
}

bool isSameFile(int descriptor, const struct stat& what) {
  struct stat open {};
  return ::fstat(descriptor, &open) == 0 && open.st_dev == what.st_dev && open.st_ino == what.st_ino;
}

void writeAll(const Descriptor& file, std::string_view bytes, const std::string& path) {
  if (file.write(bytes.data(), bytes.size())) return;
  if (errno == EPIPE) throw ClosedPipe(inShort(path) + ": the pipe's reader has closed it");
  throw IoError(inShort(path), "cannot write", errno);
}

class DescriptorBuffer : public std::streambuf {
 public:
  DescriptorBuffer() { setp(buffer_.data(), buffer_.data() + buffer_.size()); }

  void begin(const Descriptor& file, const std::string& path) {
    file_ = &file;
    path_ = path;
    by_line_ = ::isatty(file.number()) == 1;
  }
  void flush() {
    const std::string_view bytes(pbase(), static_cast<std::size_t>(pptr() - pbase()));
    setp(buffer_.data(), buffer_.data() + buffer_.size());  // after a failure these bytes are not written again
    writeAll(*file_, bytes, path_);
  }

 protected:
  int_type overflow(int_type c) override {
    flush();
    if (!traits_type::eq_int_type(c, traits_type::eof())) {
      *pptr() = traits_type::to_char_type(c);
      pbump(1);
      if (by_line_ && c == '\n') flush();
    }
    return traits_type::not_eof(c);
  }
  std::streamsize xsputn(const char* text, std::streamsize count) override {
    if (epptr() - pptr() < count) flush();
    if (epptr() - pptr() < count) {
      writeAll(*file_, {text, static_cast<std::size_t>(count)}, path_);
      return count;
    }
    traits_type::copy(pptr(), text, static_cast<std::size_t>(count));
    pbump(static_cast<int>(count));
    if (by_line_ && std::string_view(text, static_cast<std::size_t>(count)).find('\n') != std::string_view::npos)
      flush();
    return count;
  }
  int sync() override {
    flush();
    return 0;
  }

 private:
  std::array<char, kOutputBuffer> buffer_;
  std::string path_;
  const Descriptor* file_ = nullptr;
  bool by_line_ = false;
};

}  // namespace

void cutToWholeLines(const std::string& path) {
  const Descriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  struct stat what {};
  if (!file.isOpen() || ::fstat(file.number(), &what) != 0) throw IoError(escaped(path), "cannot read", errno);
  auto end = static_cast<std::uint64_t>(what.st_size);
  for (char last = 0; end > 0; --end) {
    if (!file.readAt(end - 1, &last, 1)) throw IoError(escaped(path), "cannot read", errno);
    if (last == '\n') break;
  }
  if (::ftruncate(file.number(), static_cast<off_t>(end)) != 0) throw IoError(escaped(path), "cannot write", errno);
}

OutputPlace outputPlace(const std::string& path) {
  if (path.empty()) throw UsageError("the name of an output is empty: give a file, or - for standard output");
  OutputPlace place;
  if (path == "-") {
    place.kind = OutputPlace::Kind::kDescriptor;
    place.descriptor = STDOUT_FILENO;
    place.exists = true;
    return place;
  }
  constexpr int kMostLinks = 40;
  place.target = path;
  for (int links = 0;; ++links) {
    struct stat what {};
    if (::lstat(place.target.c_str(), &what) != 0) {
      if (errno != ENOENT) throw IoError(inShort(path), "cannot write", errno);
      return place;
    }
    if (S_ISLNK(what.st_mode)) {
      if (const int descriptor = descriptorNamedBy(place.target); descriptor >= 0) {
        place.kind = OutputPlace::Kind::kDescriptor;
        place.descriptor = descriptor;
        place.exists = true;
        return place;
      }
      if (links == kMostLinks) throw IoError(inShort(path), "cannot write", ELOOP);
      std::error_code error;
      const fs::path leads_to = fs::read_symlink(place.target, error);
      if (error) throw IoError(inShort(path), "cannot write", error.value());
      place.target = leads_to.is_absolute() ? leads_to.string() : folderOf(place.target) + leads_to.string();
      continue;
    }
    place.exists = true;
    if (S_ISDIR(what.st_mode)) throw IoError(inShort(path), "is a folder; name a file in it");
    if (!S_ISREG(what.st_mode)) {
      place.kind = OutputPlace::Kind::kThrough;
      return place;
    }
    for (const int descriptor : {STDOUT_FILENO, STDERR_FILENO}) {
      if (!isSameFile(descriptor, what)) continue;
      place.kind = OutputPlace::Kind::kDescriptor;
      place.descriptor = descriptor;
      return place;
    }
    return place;
  }
}

struct Output::Impl {
  std::string path;
  OutputOptions options;
  OutputPlace place;
  DescriptorBuffer buffer;
  std::ostream stream{&buffer};
  Descriptor file;
  Descriptor through;   // by_name: the file is copied to it at the end
  std::string partial;  // the file being written; empty: none
  bool finished = false;

  ~Impl() {
    if (!partial.empty()) ::unlink(partial.c_str());
  }

  [[noreturn]] void fail(int error_number) const { throw IoError(inShort(path), "cannot write", error_number); }

  void makePartial(const std::string& folder, const std::string& name) {
    for (int tries = 0;; ++tries) {
      const std::string fresh = freshName(folder, name);
      file = Descriptor(::open(fresh.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
      if (file.isOpen()) {
        partial = fresh;
        return;
      }
      if (errno != EEXIST || tries == 100) fail(errno);
    }
  }

  void openThrough() {
    struct stat what {};
    const bool is_pipe = ::stat(place.target.c_str(), &what) == 0 && S_ISFIFO(what.st_mode);
    // Does not wait inside open(), which no signal would interrupt.
    for (;;) {
      file = Descriptor(::open(place.target.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC | (is_pipe ? O_NONBLOCK : 0)));
      if (file.isOpen()) break;
      if (errno == EINTR) continue;
      if (!is_pipe || errno != ENXIO) fail(errno);
      if (options.cancel != nullptr && options.cancel->load(std::memory_order_relaxed))
        throw Interrupted("interrupted");
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    if (is_pipe) ::fcntl(file.number(), F_SETFL, ::fcntl(file.number(), F_GETFL) & ~O_NONBLOCK);
  }

  void open() {
    place = outputPlace(path);
    const std::string ending = fs::path(path).extension().string();
    switch (place.kind) {
      case OutputPlace::Kind::kFile: {
        if (place.exists && ::access(place.target.c_str(), W_OK) != 0) fail(errno);
        const std::string folder = folderOf(place.target);
        std::string name = fs::path(place.target).filename().string();
        if (options.by_name) name = fs::path(name).stem().string() + ending;  // some writers need the ending
        makePartial(folder, name);
        break;
      }
      case OutputPlace::Kind::kThrough:
        openThrough();
        break;
      case OutputPlace::Kind::kDescriptor:
        file = Descriptor(::fcntl(place.descriptor, F_DUPFD_CLOEXEC, 3));
        if (!file.isOpen()) fail(errno);
        break;
    }
    buffer.begin(file, path == "-" ? "standard output" : path);
    stream.exceptions(std::ios::badbit);  // exceptions of the buffer propagate
    if (!options.by_name) return;
    if (place.kind != OutputPlace::Kind::kFile) {
      through = std::move(file);
      makePartial(fs::temp_directory_path().string() + "/", "filiform" + ending);
    }
    file = {};
  }

  // The complete file replaces the target.
  void publish(bool aside) {
    if (options.by_name) {  // another writer filled it, and may have replaced it
      file = Descriptor(::open(partial.c_str(), O_WRONLY | O_CLOEXEC));
      if (!file.isOpen()) fail(errno);
    }
    struct stat old {};
    if (::lstat(place.target.c_str(), &old) == 0) {
      if (!S_ISREG(old.st_mode)) throw IoError(inShort(path), "is no longer a regular file; not replaced");
      if (!aside) {
        // Change the owner first: this clears special permissions.
        [[maybe_unused]] const int ignored = ::fchown(file.number(), old.st_uid, old.st_gid);
        if (::fchmod(file.number(), old.st_mode & 07777) != 0) fail(errno);
      }
    }
    if (options.sync && file.isOpen() && ::fsync(file.number()) != 0 && errno != EINVAL && errno != EROFS) fail(errno);
    if (!file.close()) fail(errno);
    if (!aside) {
      if (::rename(partial.c_str(), place.target.c_str()) != 0) fail(errno);
      partial.clear();
    }
  }

  // Copies the file to the descriptor.
  void copyThrough() {
    const Descriptor from(::open(partial.c_str(), O_RDONLY | O_CLOEXEC));
    if (!from.isOpen()) fail(errno);
    std::vector<char> bytes(kOutputBuffer);
    for (;;) {
      const std::optional<std::size_t> n = from.read(bytes.data(), bytes.size());
      if (!n) fail(errno);
      if (*n == 0) break;
      writeAll(through, {bytes.data(), *n}, path);
    }
    if (!through.close()) fail(errno);
  }

  void complete(bool aside) {
    if (!options.by_name && stream) stream.flush();
    if (place.kind == OutputPlace::Kind::kFile) {
      publish(aside);
    } else if (options.by_name) {
      copyThrough();
    } else {
      if (!file.close()) fail(errno);
    }
  }
};

Output::Output(const std::string& path, const OutputOptions& options) : impl_(std::make_unique<Impl>()) {
  impl_->path = path;
  impl_->options = options;
  impl_->open();
}

Output::~Output() = default;

std::ostream& Output::stream() noexcept { return impl_->stream; }

void Output::write(std::string_view bytes) {
  impl_->stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

const std::string& Output::partialPath() const noexcept { return impl_->partial; }

void Output::finish() {
  if (std::exchange(impl_->finished, true)) return;
  impl_->complete(false);
}

std::string Output::finishAside() {
  Impl& d = *impl_;
  const bool failed = !d.stream || (d.finished && !d.partial.empty());
  if (std::exchange(d.finished, true) && !failed) return d.path;
  const bool mendable = d.place.kind == OutputPlace::Kind::kFile && d.options.mend;
  if (failed && !mendable) throw IoError(inShort(d.path), "was not written completely");
  if (failed) d.options.mend(d.partial);
  try {
    d.complete(true);
  } catch (const IoError&) {  // the last rows do not fit
    if (failed || !mendable) throw;
    d.options.mend(d.partial);
    d.complete(true);
  }
  if (d.place.kind != OutputPlace::Kind::kFile) return d.path;
  // Use the first unused name: neither call replaces a file.
  const fs::path target(d.place.target);
  for (int n = 0;; ++n) {
    std::string name = d.place.target;
    if (n > 0) {
      name = folderOf(d.place.target) + target.stem().string() + ".unfinished";
      if (n > 1) name += "-" + std::to_string(n);
      name += target.extension().string();
    }
    if (::link(d.partial.c_str(), name.c_str()) == 0) {
      ::unlink(std::exchange(d.partial, {}).c_str());  // now: the process may end without destructors
      return name;
    }
    const bool no_links = errno == EPERM || errno == EOPNOTSUPP || errno == ENOSPC;  // or no room for a second name
    if (no_links && ::renameat2(AT_FDCWD, d.partial.c_str(), AT_FDCWD, name.c_str(), RENAME_NOREPLACE) == 0)
      return name;
    if (errno != EEXIST || n == 1000) d.fail(errno);
  }
}

const std::string& Output::path() const noexcept { return impl_->path; }
bool Output::isFile() const noexcept { return impl_->place.kind == OutputPlace::Kind::kFile; }
bool Output::isStandardOutput() const noexcept {
  return impl_->place.kind == OutputPlace::Kind::kDescriptor && impl_->place.descriptor == STDOUT_FILENO;
}

void refuseInputName(const std::string& folder) {
  std::string name = folder;
  while (name.size() > 1 && name.back() == '/') name.pop_back();
  for (const std::string_view ending : {".swc", ".eswc", ".swc.txt", ".asc", ".edges", ".obj", ".vtk", ".h5", ".json",
                                        ".shard", ".zip", ".tar", ".tgz", ".gz"})
    if (endsWithNoCase(name, ending))
      throw InputError(escaped(name) + ": is the name of an input (" + std::string(ending) +
                       "), not of a folder to write; choose another name, such as " +
                       escaped(name.substr(0, name.size() - ending.size())) + ".fil");
}

}  // namespace filiform
