#include "index/containers/internal/tar_archive.h"

#include "index/containers/internal/entry_names.h"
#include "index/containers/internal/gunzip.h"
#include "index/containers/internal/packed_spool.h"
#include "index/errors.h"
#include "index/file/internal/digest.h"
#include "index/file/internal/file_parts.h"
#include "index/text.h"

#include <algorithm>
#include <archive.h>
#include <archive_entry.h>
#include <array>
#include <cerrno>
#include <cstring>
#include <exception>
#include <fcntl.h>
#include <locale.h>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>

namespace filiform {
namespace {

using internal::FileParts;
using internal::Gunzip;

constexpr std::size_t kTarRecord = 512, kTarBlock = std::size_t{1} << 16;

struct CloseTar {
  void operator()(archive* tar) const { archive_read_free(tar); }
};
using OpenTar = std::unique_ptr<archive, CloseTar>;

// libarchive converts names to the character set of the thread's locale; UTF-8 leaves them as they are.
class Utf8Names {
 public:
  Utf8Names() : utf8_(::newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr)) {
    if (utf8_ != nullptr) before_ = ::uselocale(utf8_);
  }
  Utf8Names(const Utf8Names&) = delete;
  Utf8Names& operator=(const Utf8Names&) = delete;
  ~Utf8Names() {
    if (utf8_ == nullptr) return;
    ::uselocale(before_);
    ::freelocale(utf8_);
  }

 private:
  locale_t utf8_ = nullptr, before_ = nullptr;
};

// What libarchive reads: a part of a plain file, or the content of a packed one.
class TarBytes {
 public:
  virtual ~TarBytes() = default;
  virtual std::string_view next() = 0;                     // empty at the end
  virtual std::uint64_t skip(std::uint64_t) { return 0; }  // may skip less
  std::exception_ptr thrown;                               // by next(): libarchive is C
};

la_ssize_t nextOfTar(archive*, void* data, const void** buffer) {
  auto& bytes = *static_cast<TarBytes*>(data);
  try {
    const std::string_view block = bytes.next();
    *buffer = block.data();
    return static_cast<la_ssize_t>(block.size());
  } catch (...) {
    bytes.thrown = std::current_exception();
    return ARCHIVE_FATAL;
  }
}

la_int64_t skipOfTar(archive*, void* data, la_int64_t request) {
  return static_cast<la_int64_t>(static_cast<TarBytes*>(data)->skip(static_cast<std::uint64_t>(request)));
}

OpenTar openTar(TarBytes& bytes, int& status) {
  OpenTar tar(archive_read_new());
  if (!tar) throw std::bad_alloc();
  archive_read_support_format_tar(tar.get());
  archive_read_set_read_callback(tar.get(), nextOfTar);
  archive_read_set_skip_callback(tar.get(), skipOfTar);
  archive_read_set_callback_data(tar.get(), &bytes);
  status = archive_read_open1(tar.get());
  return tar;
}

class PlainBytes final : public TarBytes {
 public:
  PlainBytes(const FileParts& file, std::uint64_t from, std::uint64_t end) : file_(file), at_(from), end_(end) {}

  std::string_view next() override {
    const std::size_t some = static_cast<std::size_t>(std::min<std::uint64_t>(kTarBlock, end_ - at_));
    block_.resize(some);
    file_.read(at_, block_);
    at_ += some;
    return {block_.data(), some};
  }
  std::uint64_t skip(std::uint64_t request) override {
    const std::uint64_t some = std::min(request, end_ - at_);
    at_ += some;
    return some;
  }

 private:
  const FileParts& file_;
  std::uint64_t at_, end_;
  std::vector<char> block_;
};

// The content of a gzip file, and the last record of it.
class PackedBytes final : public TarBytes {
 public:
  PackedBytes(const FileParts& file, std::uint64_t bytes, const std::function<void()>& progress)
      : file_(file), bytes_(bytes), progress_(progress) {}

  std::string_view next() override {
    shown_.clear();
    while (shown_.empty() && at_ < bytes_ && !wrong_) {
      const std::size_t some = static_cast<std::size_t>(std::min<std::uint64_t>(kPacked, bytes_ - at_));
      packed_.resize(some);
      file_.read(at_, packed_);
      at_ += some;
      digest_.add(std::string_view(packed_.data(), some));
      wrong_ = gzip_.feed({packed_.data(), some}, [this](std::string_view block) { shown_ += block; });
      if (progress_) progress_();
    }
    if (shown_.empty() && !wrong_ && at_ == bytes_) wrong_ = gzip_.finish();
    last_ += std::string_view(shown_).substr(shown_.size() - std::min(shown_.size(), kTarRecord));
    last_.erase(0, last_.size() - std::min(last_.size(), kTarRecord));
    return wrong_ ? std::string_view() : std::string_view(shown_);
  }

  // Reads to the end, which libarchive may not do, so that the checksum is compared.
  std::optional<InputCode> finish() {
    while (!next().empty()) {
    }
    return wrong_;
  }
  const std::string& last_record() const { return last_; }
  std::uint64_t digest() const { return digest_.value(); }

 private:
  static constexpr std::size_t kPacked =
      4096;  // so that the content of a block stays small: 1032 times as much at most

  const FileParts& file_;
  const std::uint64_t bytes_;
  const std::function<void()>& progress_;
  Gunzip gzip_;
  internal::RunningDigest digest_;
  std::uint64_t at_ = 0;
  std::vector<char> packed_;
  std::string shown_, last_;
  std::optional<InputCode> wrong_;
};

bool endsWithZeros(std::string_view record) {
  return record.size() == kTarRecord && record.find_first_not_of('\0') == std::string_view::npos;
}

InputCode refusalOfTar(archive* tar) {
  if (archive_errno(tar) == ENOMEM) throw std::bad_alloc();
  const char* const what = archive_error_string(tar);
  const bool cut = what != nullptr && std::strstr(what, "runcated") != nullptr;
  return cut ? InputCode::E_ZIP_TRUNCATED : InputCode::E_ZIP_FORMAT;
}

std::uint64_t sizeOfFile(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) throw IoError(inShort(path), "cannot open", errno);
  return static_cast<std::uint64_t>(status.st_size);
}

// Passes the content of the current entry to `sink`. Returns false if the archive is damaged there.
bool passContent(archive* tar, std::uint64_t bytes, const Container::Reader::Sink& sink) {
  std::array<char, 1 << 14> block;  // NOLINT: filled below
  std::uint64_t total = 0;
  for (;;) {
    const la_ssize_t got = archive_read_data(tar, block.data(), block.size());
    if (got < 0 || static_cast<std::uint64_t>(got) > bytes - total) return false;
    if (got == 0) return total == bytes;
    total += static_cast<std::uint64_t>(got);
    sink({block.data(), static_cast<std::size_t>(got)});
  }
}

}  // namespace

class TarArchive::Listing {
 public:
  explicit Listing(TarArchive& made) : made_(made) {}

  // Returns why the archive is refused.
  std::optional<InputCode> list(TarBytes& bytes) {
    const Utf8Names names;
    int status = 0;
    const OpenTar tar = openTar(bytes, status);
    for (archive_entry* entry = nullptr; status == ARCHIVE_OK || status == ARCHIVE_WARN;) {
      status = archive_read_next_header(tar.get(), &entry);
      if (status == ARCHIVE_RETRY) status = ARCHIVE_OK;
      if (status != ARCHIVE_OK && status != ARCHIVE_WARN) break;
      if (const auto refused = add(tar.get(), entry)) return refused;
    }
    if (bytes.thrown) std::rethrow_exception(bytes.thrown);
    if (status != ARCHIVE_EOF) return refusalOfTar(tar.get());
    return std::nullopt;
  }
  std::uint64_t digest() const { return digest_.value(); }

 private:
  std::optional<InputCode> add(archive* tar, archive_entry* raw) {
    const char* name = archive_entry_pathname(raw);
    if (name == nullptr) name = archive_entry_pathname_utf8(raw);
    const std::uint64_t at = static_cast<std::uint64_t>(archive_read_header_position(tar));
    const std::uint64_t bytes = static_cast<std::uint64_t>(std::max<la_int64_t>(archive_entry_size(raw), 0));
    const bool link = archive_entry_filetype(raw) == AE_IFLNK || archive_entry_hardlink(raw) != nullptr;
    digest_.add(std::string_view(name == nullptr ? "" : name));
    digest_.add("\n" + std::to_string(at) + " " + std::to_string(bytes) + "\n");
    if (!made_.spool_ && !link && (at > made_.file_bytes_ || bytes > made_.file_bytes_ - at) &&
        archive_entry_sparse_count(raw) == 0)
      return InputCode::E_ZIP_TRUNCATED;
    if (name == nullptr || (!link && archive_entry_filetype(raw) == AE_IFDIR)) return std::nullopt;
    std::optional<ArchiveEntry> entry = internal::entryOfName(name, link);
    if (!entry) return std::nullopt;
    if (!link && archive_entry_filetype(raw) != AE_IFREG) entry->passed = entry->skipped = true;
    entry->index = at;
    entry->bytes = entry->packed_bytes = bytes;
    if (made_.spool_ && !entry->skipped && bytes <= kMaxEntryBytes) {
      entry->index = made_.spool_->begin();
      if (!passContent(tar, bytes, [this](std::string_view block) { made_.spool_->add(block); }))
        return refusalOfTar(tar);
      made_.spool_->end();
    }
    made_.entries_.push_back(std::move(*entry));
    return std::nullopt;
  }

  TarArchive& made_;
  internal::RunningDigest digest_;
};

TarArchive::TarArchive(std::string path, bool packed, const std::function<void()>& progress) : path_(std::move(path)) {
  file_bytes_ = sizeOfFile(path_);
  const FileParts file(path_, file_bytes_);
  std::optional<InputCode> refused;
  std::string last;
  Listing listing(*this);
  if (packed) {
    spool_ = std::make_unique<internal::PackedSpool>();
    PackedBytes bytes(file, file_bytes_, progress);
    refused = listing.list(bytes);
    if (const auto damage = bytes.finish()) refused = damage;
    digest_ = bytes.digest();
    last = bytes.last_record();
  } else {
    PlainBytes bytes(file, 0, file_bytes_);
    refused = listing.list(bytes);
    digest_ = listing.digest();
    last.resize(std::min<std::uint64_t>(kTarRecord, file_bytes_));
    file.read(file_bytes_ - last.size(), last);
  }
  // An archive ends with zeros. libarchive accepts one that was cut between two entries.
  if (!refused && !endsWithZeros(last)) refused = InputCode::E_ZIP_TRUNCATED;
  if (refused)
    refuse(*refused);
  else
    finishListing();
  if (packed) shareFileBytes();
}

// So that the bytes of the entries on disk add up to those of the file.
void TarArchive::shareFileBytes() {
  double content = 0;
  for (const ArchiveEntry& entry : entries_) content += entry.skipped ? 0 : static_cast<double>(entry.bytes);
  for (ArchiveEntry& entry : entries_)
    entry.packed_bytes = static_cast<std::uint64_t>(static_cast<double>(entry.bytes) / std::max(content, 1.0) *
                                                    static_cast<double>(file_bytes_));
}

TarArchive::~TarArchive() = default;

namespace {

class PlainTarReader final : public Container::Reader {
 public:
  PlainTarReader(std::string path, std::uint64_t bytes) : path_(std::move(path)), bytes_(bytes) {}

  std::optional<InputCode> read(const ArchiveEntry& entry, const Sink& sink) override {
    if (entry.bytes > Container::kMaxEntryBytes) return InputCode::E_ZIP_SIZE;
    if (!file_) file_.emplace(path_, bytes_);
    PlainBytes bytes(*file_, entry.index, bytes_);
    int status = 0;
    const OpenTar tar = openTar(bytes, status);
    archive_entry* raw = nullptr;
    if (status == ARCHIVE_OK) status = archive_read_next_header(tar.get(), &raw);
    if (bytes.thrown) std::rethrow_exception(bytes.thrown);
    if (status != ARCHIVE_OK && status != ARCHIVE_WARN) return refusalOfTar(tar.get());
    const bool same = static_cast<std::uint64_t>(std::max<la_int64_t>(archive_entry_size(raw), 0)) == entry.bytes;
    const bool whole = same && passContent(tar.get(), entry.bytes, sink);
    if (bytes.thrown) std::rethrow_exception(bytes.thrown);
    return whole ? std::nullopt : std::optional(InputCode::E_ZIP_FORMAT);
  }

 private:
  const std::string path_;
  const std::uint64_t bytes_;
  std::optional<FileParts> file_;
};

class SpoolReader final : public Container::Reader {
 public:
  explicit SpoolReader(const internal::PackedSpool& spool) : spool_(spool) {}

  std::optional<InputCode> read(const ArchiveEntry& entry, const Sink& sink) override {
    if (entry.bytes > Container::kMaxEntryBytes) return InputCode::E_ZIP_SIZE;
    spool_.read(entry.index, entry.bytes, sink);
    return std::nullopt;
  }

 private:
  const internal::PackedSpool& spool_;
};

}  // namespace

std::unique_ptr<Container::Reader> TarArchive::reader() const {
  if (spool_) return std::make_unique<SpoolReader>(*spool_);
  return std::make_unique<PlainTarReader>(path_, file_bytes_);
}

}  // namespace filiform
