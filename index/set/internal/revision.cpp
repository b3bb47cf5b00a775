#include "index/set/internal/revision.h"

#include "index/file/internal/digest.h"
#include "index/text.h"

#include <algorithm>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kFirstPiece = std::uint64_t{4}
                                      << 20;  // of a large read; each further piece doubles what is there
// Of files by which programs size arrays (one entry a tile or a cell): the server is asked for the last byte of a
// larger one, since an address does not compare sizes.
constexpr std::uint64_t kMostUnasked = std::uint64_t{16} << 20;

std::string setFolderOf(const std::string& file) { return file.substr(0, file.rfind('/')); }

}  // namespace

Revision::Revision(std::unique_ptr<TileSource> source, const std::string& wanted) : source_(std::move(source)) {
  if (wanted.empty()) {
    name_ = readCurrent();
    readManifest();
    return;
  }
  const std::string set = setFolderOf(source_->describe(kCurrentFile));
  if (!isRevisionName(wanted)) throw UsageError(set + ": '" + escaped(wanted, 40) + "' is not the name of a revision");
  name_ = wanted;
  try {
    readManifest();
  } catch (const IoError& failure) {
    if (failure.isShortage()) throw;
    throw IoError(set, "the revision " + name_ + " cannot be read (" + failure.reason() +
                           "); if another revision was published since, open the set again");
  }
}

std::string Revision::readCurrent() const {
  const std::string current = source_->describe(kCurrentFile);
  std::uint64_t size = 0;
  try {
    size = source_->size(kCurrentFile);
  } catch (const IoError&) {
    if (source_->isRemote()) throw;
    throw IoError(current, "is missing, so the folder is not a tile set; make one with filiform ingest");
  }
  Bytes line(std::min<std::uint64_t>(size, 64));
  source_->read(kCurrentFile, 0, line);
  std::string name(line.begin(), line.end());
  if (size != 19 || name.back() != '\n' || (name.pop_back(), !isRevisionName(name)))
    throw CorruptSet(current, 0, "does not name a revision");
  return name;
}

void Revision::readManifest() {
  const std::string file_name = describe(kManifestFile);
  const auto readText = [&] {
    const std::uint64_t bytes_there = sizeOnDisk(kManifestFile);
    if (bytes_there > kMostManifestBytes)
      throw CorruptSet(file_name, kMostManifestBytes, "is too large for a manifest");
    const Bytes bytes = read(kManifestFile, 0, bytes_there);
    text_.assign(bytes.begin(), bytes.end());
    return revisionName(text_) == name_;
  };
  if (!readText() && !(discard(kManifestFile, 0, text_.size()) && readText()))
    throw CorruptSet(file_name, 0, "its digest differs from the revision's name");
  try {
    manifest_ = decodeManifest(text_);
  } catch (const OtherVersion& version) {
    throw InputError(setFolderOf(source_->describe(kCurrentFile)) +
                     (version.older ? ": was made by an older filiform; ingest it again"
                                    : ": has format " + version.version + ", this filiform reads formats " +
                                          std::to_string(kOldestVersion) + " and " + std::to_string(kFormatVersion) +
                                          "; use the filiform that made it, or a newer one"));
  } catch (const Damage& damage) {
    throw CorruptSet(file_name, damage.offset, damage.what);
  }
  for (const SetFile& f : manifest_.files) {
    files_[f.name] = &f;
    source_->expect(key(f.name), f.bytes);
  }
  for (const char* const name : {kDirectoryFile, kCellsFile})
    if (const SetFile* const f = find(name); f != nullptr && isRemote() && f->bytes > kMostUnasked)
      read(name, f->bytes - 1, 1);
}

std::string Revision::key(const std::string& file) const {
  const SetFile* const listed = find(file);
  return (listed != nullptr && !listed->revision.empty() ? listed->revision : name_) + "/" + file;
}

const SetFile* Revision::find(const std::string& file) const {
  const auto found = files_.find(file);
  return found != files_.end() ? found->second : nullptr;
}

const SetFile& Revision::file(const std::string& file) const {
  const SetFile* const found = find(file);
  if (found == nullptr) throw CorruptSet(describe(kManifestFile), 0, "does not list " + file);
  return *found;
}

std::string Revision::describe(const std::string& file) const { return source_->describe(key(file)); }

void Revision::read(const std::string& file, std::uint64_t offset, std::span<std::uint8_t> bytes) const {
  source_->read(key(file), offset, bytes);
}

Bytes Revision::read(const std::string& file, std::uint64_t offset, std::uint64_t bytes) const {
  Bytes result;
  while (result.size() < bytes) {
    const std::uint64_t done = result.size(), left = bytes - done, piece = std::max<std::uint64_t>(kFirstPiece, done);
    result.resize(done + (left < 2 * piece ? left : piece));
    read(file, offset + done, std::span(result).subspan(done));
  }
  return result;
}

Bytes Revision::readChecked(const std::string& file, std::uint64_t offset, std::uint64_t bytes, std::uint64_t stated,
                            const std::string& part) const {
  return readDecoded(file, offset, bytes, [&](ByteSpan read) {
    if (checksum(read) != stated) throw Damage{0, part + " has a wrong checksum"};
    return Bytes(read.begin(), read.end());
  });
}

bool Revision::discard(const std::string& file, std::uint64_t offset, std::uint64_t bytes) const {
  return source_->discard(key(file), offset, bytes);
}

std::uint64_t Revision::sizeOnDisk(const std::string& file) const { return source_->size(key(file)); }

}  // namespace filiform::internal
