#include "index/containers/internal/archive_files.h"

#include "index/containers/internal/catmaid_file.h"
#include "index/containers/internal/h5_container.h"
#include "index/containers/internal/mouselight_file.h"
#include "index/containers/internal/nml_file.h"
#include "index/errors.h"
#include "index/file/internal/memory_file.h"
#include "index/text.h"

#include <algorithm>
#include <string>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kMostBytesOfEntry = std::uint64_t{256} << 20;
constexpr std::uint64_t kCopies = 3;  // of a file in memory, with those of the program that reads H5

// The content of an entry is of another kind than its name says.
struct OtherContent {};

// A file of an archive, in memory.
struct UnpackedFile {
  // Returns why the entry is refused. Throws OtherContent, after the first bytes, and IoError beyond `most` bytes.
  std::optional<InputCode> copy(const ArchiveEntry& entry, Container::Reader& reader, std::uint64_t most,
                                const std::function<void()>& progress) {
    std::string head;
    bool begun = false;
    const auto begin = [&] {
      if (!mayHoldCells(entry.kind, head)) throw OtherContent();
      if (entry.bytes > most)
        throw IoError(inShort(entry.shown_label()),
                      std::to_string(entry.bytes) + " bytes, but such a file of an archive is read in memory, up to " +
                          std::to_string(most) + " bytes; unpack the archive");
      begun = true;
      content.add(head);
    };
    const std::optional<InputCode> refused = reader.read(entry, [&](std::string_view bytes) {
      if (progress) progress();
      if (!begun) {
        const std::string_view first = bytes.substr(0, kHeadBytes - head.size());
        head += first;
        bytes.remove_prefix(first.size());
        if (head.size() == kHeadBytes) begin();
      }
      content.add(bytes);
    });
    if (refused) return refused;
    if (!begun) begin();
    path = content.path();
    return std::nullopt;
  }

  // Lists the cells of another file than an H5 file.
  void list(FileKind kind, const std::function<void()>& progress) {
    const auto between = [&](std::uint64_t) {
      if (progress) progress();
    };
    if (kind == FileKind::mouselight)
      cells = std::make_unique<MouseLightFile>(path, between);
    else if (kind == FileKind::catmaid)
      cells = std::make_unique<CatmaidFile>(path, between);
    else
      cells = std::make_unique<NmlFile>(path, between);
  }

  MemoryFile content{"a file of an archive"};
  std::string path;
  std::unique_ptr<Container> cells;
};

}  // namespace

std::unique_ptr<Container> ArchiveFiles::open(std::unique_ptr<Container> archive, std::uint64_t memory,
                                              Hdf5Process& hdf5, const std::function<void()>& progress) {
  const auto holds_several = [](const ArchiveEntry& entry) { return !entry.skipped && mustBeginRight(entry.kind); };
  if (archive->refusal() || std::none_of(archive->entries().begin(), archive->entries().end(), holds_several))
    return archive;
  return std::unique_ptr<Container>(
      new ArchiveFiles(std::move(archive), std::min(kMostBytesOfEntry, memory / 8), hdf5, progress));
}

ArchiveFiles::ArchiveFiles(std::unique_ptr<Container> archive, std::uint64_t most_bytes, Hdf5Process& hdf5,
                           const std::function<void()>& progress)
    : archive_(std::move(archive)), most_bytes_(most_bytes) {
  file_bytes_ = archive_->file_bytes();
  digest_ = archive_->digest();
  const std::unique_ptr<Reader> reader = archive_->reader();
  for (const ArchiveEntry& entry : archive_->entries()) {
    if (entry.skipped || !mustBeginRight(entry.kind))
      entries_.push_back(entry);
    else
      add(entry, *reader, hdf5, progress);
  }
  refuseWithoutInput();
}

// Unpacks the file, if it begins like its name says, and lists it.
void ArchiveFiles::add(ArchiveEntry entry, Reader& reader, Hdf5Process& hdf5, const std::function<void()>& progress) {
  UnpackedFile file;
  std::optional<InputCode> refused;
  std::string token;
  try {
    refused = file.copy(entry, reader, most_bytes_, progress);
    if (!refused) {
      if (entry.kind == FileKind::h5)
        file.cells = std::make_unique<H5Container>(hdf5, file.path, nullptr);
      else
        file.list(entry.kind, progress);
      refused = file.cells->refusal();
      token = file.cells->refusal_token();
      entry.passed = !refused && file.cells->entries().empty();
    }
  } catch (const OtherContent&) {
    entry.passed = true;
  } catch (const IoError& failure) {
    if (failure.isShortage()) throw;
    refused = InputCode::E_UNREADABLE;
    token = escaped(failure.reason(), 300);
  }
  if (!refused && !entry.passed) {
    addCells(entry, file.cells->entries());
    return;
  }
  entry.skipped = true;
  entry.remarks.clear();
  if (refused) entry.remarks = {*refused};
  entry.refusal_token = token;
  entries_.push_back(std::move(entry));
}

void ArchiveFiles::addCells(const ArchiveEntry& entry, const std::vector<ArchiveEntry>& cells) {
  files_.push_back(entry);
  largest_ = std::max(largest_, entry.bytes);
  for (const ArchiveEntry& inner : cells) {
    ArchiveEntry cell = inner;
    cell.kind = entry.kind;
    cell.file = static_cast<std::uint32_t>(files_.size());
    const bool single = inner.name.empty();  // an H5 file of one
    cell.name = single ? entry.name : entry.name + "/" + inner.name;
    const std::string label = single ? entry.shown_label() : entry.shown_label() + "/" + inner.shown_label();
    cell.label = label != cell.name ? label : std::string();
    cell.packed_bytes = entry.packed_bytes / cells.size();
    cell.remarks.insert(cell.remarks.begin(), entry.remarks.begin(), entry.remarks.end());
    entries_.push_back(std::move(cell));
  }
}

std::uint64_t ArchiveFiles::reader_bytes() const { return archive_->reader_bytes() + kCopies * largest_; }

// Keeps the file of the last entry.
class ArchiveFiles::FilesReader final : public Container::Reader {
 public:
  explicit FilesReader(const ArchiveFiles& of) : of_(of), archive_(of.archive_->reader()) {}

  std::optional<InputCode> read(const ArchiveEntry& entry, const Sink& sink) override {
    if (entry.file == 0) return archive_->read(entry, sink);
    if (const std::optional<InputCode> refused = copy(entry)) return refused;
    if (!file_->cells) {
      file_->list(entry.kind, {});
      cells_ = file_->cells->reader();
    }
    return cells_->read(entry, sink);
  }

  std::string h5PathOf(const ArchiveEntry& entry) override {
    if (const std::optional<InputCode> refused = copy(entry))
      throw IoError(inShort(entry.shown_label()), std::string(explanation(*refused)));
    return file_->path;
  }

  void release() override {
    at_ = 0;
    cells_ = nullptr;
    file_ = nullptr;
  }

 private:
  std::optional<InputCode> copy(const ArchiveEntry& entry) {
    if (at_ == entry.file) return std::nullopt;
    release();
    file_ = std::make_unique<UnpackedFile>();
    try {
      if (const auto refused = file_->copy(of_.files_[entry.file - 1], *archive_, of_.most_bytes_, {})) return refused;
    } catch (const OtherContent&) {
      throw IoError(inShort(entry.shown_label()), "changed while it was being read; run again");
    }
    at_ = entry.file;
    return std::nullopt;
  }

  const ArchiveFiles& of_;
  const std::unique_ptr<Reader> archive_;
  std::unique_ptr<UnpackedFile> file_;
  std::unique_ptr<Reader> cells_;
  std::uint32_t at_ = 0;  // of file_; 0: none
};

std::unique_ptr<Container::Reader> ArchiveFiles::reader() const { return std::make_unique<FilesReader>(*this); }

}  // namespace filiform::internal
