#include "index/stores/set_copy.h"

#include "index/errors.h"
#include "index/file/internal/bytes.h"
#include "index/file/internal/digest.h"
#include "index/file/internal/output_file.h"
#include "index/file/internal/set_files.h"
#include "index/internal/descriptor.h"
#include "index/remote/http_source.h"
#include "index/remote/internal/http_client.h"
#include "index/remote/internal/http_errors.h"
#include "index/remote/internal/remote_address.h"
#include "index/remote/internal/s3_upload.h"
#include "index/set/internal/manifest.h"
#include "index/set/internal/revision.h"
#include "index/set/internal/set_folder.h"
#include "index/set/tile_set.h"
#include "index/stores/internal/stored_set.h"
#include "index/text.h"
#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <fcntl.h>
#include <filesystem>
#include <set>
#include <unistd.h>
#include <vector>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using internal::Bytes;

constexpr std::uint64_t kPiece = 4 << 20;  // of a read for pullSet
constexpr unsigned kPiecesAtOnce = 8;

// A file to copy: its name below the set, its manifest's entry.
struct CopiedFile {
  std::string path;
  SetFile file;
};

// All files of a revision, the manifest last.
std::vector<CopiedFile> filesOf(const std::string& revision, const std::vector<SetFile>& listed,
                                const std::string& manifest) {
  std::vector<CopiedFile> files;
  for (const SetFile& file : listed)
    files.push_back({(file.revision.empty() ? revision : file.revision) + "/" + file.name, file});
  const SetFile last{internal::kManifestFile, manifest.size(), internal::checksum(manifest)};
  files.push_back({revision + "/" + last.name, last});
  return files;
}

void throwIfCancelled(const CopyOptions& options) {
  if (options.remote.cancel != nullptr && options.remote.cancel->load(std::memory_order_relaxed))
    throw Interrupted("interrupted");
}

// Throws InputError if tidySet() is removing a revision that has some of the files.
void refuseMarked(internal::HttpClient& client, const internal::RemoteAddress& address,
                  const std::vector<CopiedFile>& files) {
  std::set<std::string> revisions;
  for (const CopiedFile& copied : files) revisions.insert(copied.path.substr(0, copied.path.find('/')));
  for (const std::string& revision : revisions) {
    try {
      client.size(address.files + revision + "/" + internal::kRemovalMark);
    } catch (const internal::NotOnServer&) {
      continue;
    } catch (const internal::DeniedByServer&) {
      continue;
    }
    throw InputError(inShort(address.set) + ": `filiform tidy` is removing " + revision +
                     ", or was interrupted; let it end, or run it again, and then push again");
  }
}

// True if the folder's file has the stated bytes.
bool isWhole(const TileSource& folder, const CopiedFile& copied, const CopyOptions& options) {
  try {
    if (folder.size(copied.path) != copied.file.bytes) return false;
    internal::RunningDigest digest;
    Bytes piece;
    for (std::uint64_t at = 0; at < copied.file.bytes; at += piece.size()) {
      throwIfCancelled(options);
      piece.resize(std::min(kPiece, copied.file.bytes - at));
      folder.read(copied.path, at, piece);
      digest.add(piece);
    }
    return digest.value() == copied.file.digest;
  } catch (const IoError&) {
    return false;
  }
}

void pullFile(const TileSource& from, const std::string& folder, const CopiedFile& copied, const CopyOptions& options,
              const std::function<void(std::uint64_t)>& progress) {
  const std::string target = folder + "/" + copied.path, aside = target + ".tmp-pull";
  std::error_code error;
  fs::create_directories(fs::path(target).parent_path(), error);
  if (error) throw IoError(folder, "cannot be written", error.value());
  internal::Descriptor file(::open(aside.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  const auto require = [&](bool done) {
    if (!done) throw IoError(aside, "cannot be written", errno);
  };
  require(file.isOpen());
  const std::uint64_t pieces = (copied.file.bytes + kPiece - 1) / kPiece;
  std::atomic<std::uint64_t> next{0}, done{0};
  runWorkers(std::min<std::uint64_t>(kPiecesAtOnce, std::max<std::uint64_t>(pieces, 1)),
             [&](std::size_t worker, const std::atomic<bool>& failed) {
               Bytes piece;
               for (std::uint64_t i = next++; i < pieces && !failed; i = next++) {
                 piece.resize(std::min(kPiece, copied.file.bytes - i * kPiece));
                 from.read(copied.path, i * kPiece, piece);
                 require(file.writeAt(i * kPiece, piece.data(), piece.size()));
                 done += piece.size();
                 if (worker == 0) progress(done);
               }
             });
  require(::fsync(file.number()) == 0 && file.close());
  CopiedFile written = copied;
  written.path += ".tmp-pull";
  if (!isWhole(*openFolder(folder), written, options))
    throw CorruptSet(from.describe(copied.path), 0, "its digest differs from the manifest's; pull again");
  fs::rename(aside, target, error);
  if (error) throw IoError(target, "cannot be renamed", error.value());
  internal::syncFolder(fs::path(target).parent_path().string());
}

}  // namespace

CopyResult pushSet(const std::string& folder, const std::string& text, const CopyOptions& options) {
  if (!internal::isS3Address(text))
    throw UsageError(inShort(text) + ": a set is pushed to an object store; give s3://BUCKET/PATH/NAME.fil");
  const internal::RemoteAddress address(text);
  const auto set = TileSet::open(openFolder(folder));
  internal::HttpClient client(address.origin, options.remote, address.account);
  CopyResult result{.revision = set->revision(), .before = internal::currentAt(client, address)};
  std::vector<CopiedFile> files = filesOf(set->revision(), set->files(), set->manifest());
  std::rotate(files.begin(), files.end() - 1, files.end());  // the manifest first
  internal::S3Upload upload(client, address);
  std::uint64_t done = 0;
  const auto progress = [&](std::uint64_t more) {
    if (options.progress) options.progress(done + more, result.bytes);
  };
  const auto send = [&](const CopiedFile& copied) {
    const SetFile& file = copied.file;
    const bool is_manifest = file.name == internal::kManifestFile;
    if (!is_manifest) set->checkFile(file);
    upload.send(
        copied.path, file.bytes, internal::hex16(file.digest),
        [&](std::uint64_t offset, std::span<std::uint8_t> bytes) {
          if (is_manifest)
            std::copy_n(set->manifest().begin() + static_cast<std::ptrdiff_t>(offset), bytes.size(), bytes.begin());
          else
            set->read(file.name, offset, bytes);
        },
        progress);
    done += file.bytes;
    ++result.copied;
    result.copied_bytes += file.bytes;
  };
  for (const CopiedFile& copied : files) ++result.files, result.bytes += copied.file.bytes;
  // The manifest is sent even if it is there: from then on the revision is too young for tidySet().
  const bool is_new = result.before != result.revision;
  throwIfCancelled(options);
  if (is_new) send(files.front());
  refuseMarked(client, address, files);
  std::vector<char> there(files.size(), 0);
  there[0] = is_new ? 1 : 0;
  std::atomic<std::size_t> next{is_new ? 1U : 0U};
  runWorkers(std::min<std::size_t>(internal::S3Upload::kAtOnce, files.size()),
             [&](std::size_t, const std::atomic<bool>& failed) {
               for (std::size_t i = next++; i < files.size() && !failed; i = next++) {
                 try {
                   const auto facts = client.facts(address.files + files[i].path);
                   there[i] = facts.bytes == files[i].file.bytes &&
                              (facts.digest.empty() || facts.digest == internal::hex16(files[i].file.digest));
                 } catch (const internal::NotOnServer&) {
                 } catch (const internal::DeniedByServer&) {  // if the store means it, sending fails too
                 }
               }
             });
  for (std::size_t i = is_new ? 1 : 0; i < files.size(); ++i)
    if (there[i]) done += files[i].file.bytes;
  progress(0);
  for (std::size_t i = 0; i < files.size(); ++i) {
    throwIfCancelled(options);
    if (!there[i]) send(files[i]);
  }
  if (is_new) {
    // A tidySet() whose clock is wrong may have taken this revision for an old one.
    refuseMarked(client, address, files);
    try {
      client.size(address.files + files.front().path);
    } catch (const internal::NotOnServer&) {
      throw InputError(inShort(address.set) + ": " + result.revision +
                       " was removed by `filiform tidy` while it was sent; set the clock of the machine that tidies, "
                       "and push again");
    } catch (const internal::DeniedByServer&) {  // keys that may only write
    }
    const std::string line = result.revision + "\n";
    client.send({.method = "PUT",
                 .url = address.files + internal::kCurrentFile,
                 .body = std::span(reinterpret_cast<const std::uint8_t*>(line.data()), line.size()),
                 .headers = {"Cache-Control: no-cache"}});
  }
  result.counters = client.counters();
  return result;
}

CopyResult pullSet(const std::string& address, const std::string& folder, const CopyOptions& options) {
  if (!isAddress(address)) throw UsageError(inShort(address) + ": is not an address; copy a folder with cp -r");
  // Reads of whole files do not pass through the cache on disk, and are not kept there.
  const auto set = TileSet::open(address, options.remote);
  const HttpSource from(address, options.remote);
  const std::vector<CopiedFile> files = filesOf(set->revision(), set->files(), set->manifest());
  internal::SetFolder to(folder, internal::SetFolder::Purpose::replace);
  to.keepAfterFailure();
  CopyResult result{.revision = set->revision(), .before = to.previous()};
  if (!options.force && !result.before.empty() && result.before != result.revision)
    throw InputError(inShort(folder) + ": is already another revision of a tile set; --force replaces it");
  const auto present = openFolder(folder);
  for (const CopiedFile& copied : files) ++result.files, result.bytes += copied.file.bytes;
  std::uint64_t done = 0;
  for (const CopiedFile& copied : files) {
    const auto progress = [&](std::uint64_t more) {
      if (options.progress) options.progress(done + more, result.bytes);
    };
    throwIfCancelled(options);
    progress(0);
    if (!isWhole(*present, copied, options)) {
      pullFile(from, folder, copied, options, progress);
      ++result.copied;
      result.copied_bytes += copied.file.bytes;
    }
    done += copied.file.bytes;
  }
  std::vector<std::string> in_use;
  for (const SetFile& file : set->files())
    if (!file.revision.empty()) in_use.push_back(file.revision);
  to.publishPresent(result.revision, in_use);
  result.counters = from.counters();
  return result;
}

}  // namespace filiform
