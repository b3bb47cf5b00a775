#include "index/input/internal/file_listing.h"

#include "index/containers/internal/archive.h"
#include "index/containers/internal/catmaid_file.h"
#include "index/containers/internal/h5_container.h"
#include "index/containers/internal/mouselight_file.h"
#include "index/containers/internal/nml_file.h"
#include "index/containers/internal/tar_archive.h"
#include "index/errors.h"
#include "index/formats/internal/catmaid_columns.h"
#include "index/formats/neuroglancer/object_ids.h"
#include "index/formats/unread_formats.h"
#include "index/input/internal/chosen_objects.h"
#include "index/input/internal/folder_walk.h"
#include "index/text.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <set>
#include <system_error>
#include <utility>

namespace filiform::internal {
namespace {

namespace fs = std::filesystem;

std::string_view withoutGz(std::string_view name) {
  return endsWithNoCase(name, ".gz") ? name.substr(0, name.size() - 3) : name;
}

bool holdsCells(std::string_view name) {
  const std::string_view bare = withoutGz(name);
  return isReadInFolders(kindOf(bare) == FileKind::cell ? bare : name);
}

bool isSkeletonId(std::string_view name) {
  std::uint64_t id = 0;
  return readObjectId(withoutGz(name), id);
}

bool isShard(std::string_view name) { return endsWithNoCase(name, ".shard"); }

ListedFile listedFrom(WalkedFile& walked) {
  ListedFile file = fileArgument(walked.path, walked.shown);
  file.unreadable = std::move(walked.unreadable);
  return file;
}

// The first bytes of a file; nullopt if it cannot be read, or is a pipe, which would block.
std::optional<std::string> headOf(const std::string& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return std::nullopt;
  std::ifstream in(path, std::ios::binary);
  std::string head(kHeadBytes, '\0');
  in.read(head.data(), static_cast<std::streamsize>(head.size()));
  if (in.bad() || !(in.good() || in.eof())) return std::nullopt;
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head;
}

std::string_view firstLine(std::string_view head) { return head.substr(0, head.find_first_of("\r\n")); }

// H5 files are asked when they are opened.
bool isOther(const ListedFile& file) {
  if (!file.unreadable.empty() || !mustBeginRight(file.kind) || file.kind == FileKind::h5) return false;
  const std::optional<std::string> head = headOf(file.path);
  return head && !mayHoldCells(file.kind, *head);
}

std::vector<ListedFile> listFolder(const std::string& folder, MorphologyVersion versions) {
  std::vector<ListedFile> files;
  bool any_shard = false, any = false;
  for (WalkedFile& walked : walkFolder(folder, holdsCells)) {
    const bool wanted = walked.wanted;
    any_shard = any_shard || isShard(walked.shown);
    files.push_back(listedFrom(walked));
    ListedFile& file = files.back();
    file.found = true;
    file.not_read.clear();
    const bool other_table = file.kind == FileKind::cell && kindOf(file.path) == FileKind::catmaid;
    file.passed = !wanted || other_table || isOther(file);
    any = any || !file.passed;
  }
  std::vector<std::string_view> names;
  for (const ListedFile& file : files)
    names.push_back(file.passed ? "" : file.packed ? withoutGz(file.shown) : std::string_view(file.shown));
  const std::vector<bool> left_out = versionsLeftOut(names, versions);
  for (std::size_t i = 0; i < files.size(); ++i) files[i].left_out = left_out[i] && files[i].unreadable.empty();
  if (!any && any_shard)
    throw InputError(inShort(folder) + ": holds shards of skeletons, but no info file that says how to read them");
  return files;
}

bool isWanted(const ListingOptions& options, std::string_view name) {
  if (!options.ids) return true;
  std::uint64_t id = 0;
  return readObjectId(withoutGz(name), id) && std::binary_search(options.ids->begin(), options.ids->end(), id);
}

ListedFile shardOf(const std::shared_ptr<const SkeletonFiles>& files, const std::string& name,
                   const std::shared_ptr<const SkeletonInfo>& info, const ListingOptions& options) {
  ListedFile file{files->pathOf(name), name};
  file.kind = FileKind::shard;
  file.skeleton = info;
  file.skeleton_files = files;
  file.ids = options.ids;
  return file;
}

// The volume above a folder of skeletons.
SkeletonVolume volumeAbove(const std::string& folder) {
  const auto files = filesInFolder((fs::path(folder) / "..").lexically_normal().native());
  return {files, files->findText("info", SkeletonInfo::kMaxBytes).value_or(""), {}};
}

// The files of a folder of Neuroglancer skeletons, or of a volume's folder whose info names them; empty for another
// folder. `through`: the volume whose info names this folder.
std::vector<ListedFile> listSkeletons(const std::string& folder, const ListingOptions& given,
                                      const SkeletonVolume* through = nullptr) {
  const std::shared_ptr<const SkeletonFiles> source = filesInFolder(folder);
  std::error_code error;
  const std::string path = source->pathOf("info");
  if (!fs::is_regular_file(path, error) || fs::file_size(path, error) > SkeletonInfo::kMaxBytes || error) return {};
  std::optional<std::string> text;
  try {
    text = source->findText("info", SkeletonInfo::kMaxBytes);
  } catch (const IoError& failure) {
    if (failure.isShortage()) throw;
    return {};
  }
  if (!text) return {};
  if (!SkeletonInfo::isSkeletonInfo(*text)) {
    const SkeletonInfo::Elsewhere there = SkeletonInfo::elsewhere(*text, path);
    if (there.folder.empty() || through != nullptr) return {};
    const std::string below = source->pathOf(there.folder);
    const SkeletonVolume volume{source, *text, there.segment_properties};
    std::vector<ListedFile> files = listSkeletons(below, given, &volume);
    if (files.empty())
      throw InputError(inShort(path) + ": names the folder of skeletons " + escaped(there.folder, 100) +
                       ", which has no info of skeletons");
    return files;
  }
  const auto info = std::make_shared<const SkeletonInfo>(SkeletonInfo::parse(*text, path));
  const auto properties = readProperties(*source, *info, through);
  ListingOptions options = given;
  options.ids = chosenObjects(
      *source, *text, properties.get(), [&] { return through ? *through : volumeAbove(folder); }, given);
  std::set<std::string> shards;  // that may hold the wanted objects
  if (info->sharding && options.ids)
    for (const std::uint64_t id : *options.ids) shards.insert(info->sharding->fileNameOf(info->sharding->shardOf(id)));
  std::vector<ListedFile> files;
  bool any = false;
  for (WalkedFile& f : walkFolder(folder, info->sharding ? isShard : isSkeletonId, WalkDepth::folder_only)) {
    if (f.shown == "info") continue;
    if (!f.wanted) {
      files.push_back(listedFrom(f));
      files.back().passed = true;
      continue;
    }
    if (info->sharding) {
      if (options.ids && !shards.contains(f.shown)) continue;
      files.push_back(shardOf(source, f.shown, info, options));
      files.back().unreadable = std::move(f.unreadable);
      any = true;
    } else if (isWanted(options, f.shown)) {
      any = true;
      ListedFile file = listedFrom(f);
      file.format = GraphFormat::kNeuroglancerSkeleton;
      file.skeleton = info;
      files.push_back(std::move(file));
    }
  }
  for (ListedFile& file : files) file.properties = properties;
  if (options.ids && any) {
    std::set<std::string, std::less<>> found;
    for (const ListedFile& file : files) found.emplace(withoutGz(file.shown));
    for (const std::uint64_t id : *options.ids) {
      const std::string name =
          info->sharding ? info->sharding->fileNameOf(info->sharding->shardOf(id)) : std::to_string(id);
      if (!found.contains(name))
        files.push_back(missingObject(
            *source, id, info->sharding ? "its shard " + name + " is not in this folder" : "is not in this folder"));
    }
  }
  if (!any)
    throw InputError(inShort(folder) + ": its info is that of skeletons, but it holds none" +
                     (options.ids ? " of these ids" : ""));
  return files;
}

}  // namespace

ListedFile fileArgument(const std::string& path, const std::string& shown) {
  ListedFile file{path, shown};
  file.kind = kindOf(path);
  if (file.kind == FileKind::catmaid)
    if (const std::optional<std::string> head = headOf(path); head && !CatmaidColumns::of(firstLine(*head)).isCatmaid())
      file.kind = FileKind::cell;  // SWC with commas
  if (file.kind != FileKind::cell) return file;
  file.not_read = whyNotRead(withoutGz(path));
  file.packed = endsWithNoCase(path, ".gz");
  file.format = graphFormatOf(withoutGz(path));
  return file;
}

ListedFile missingObject(const SkeletonFiles& files, std::uint64_t id, const std::string& reason) {
  const std::string name = std::to_string(id);
  ListedFile file{files.pathOf(name), name};
  file.unreadable = reason;
  return file;
}

std::vector<ListedFile> listFiles(const std::string& folder, const ListingOptions& options) {
  std::vector<ListedFile> files = listSkeletons(folder, options);
  return files.empty() ? listFolder(folder, options.versions) : files;
}

std::unique_ptr<Container> openContainer(const ListedFile& file, Hdf5Process& hdf5,
                                         const std::function<void()>& progress) {
  switch (file.kind) {
    case FileKind::cell:
      return nullptr;
    case FileKind::zip:
      return std::make_unique<Archive>(file.path);
    case FileKind::tar:
    case FileKind::tar_gz:
      return std::make_unique<TarArchive>(file.path, file.kind == FileKind::tar_gz, progress);
    case FileKind::mouselight:
      return std::make_unique<MouseLightFile>(file.path, [&](std::uint64_t) { progress(); });
    case FileKind::catmaid:
      return std::make_unique<CatmaidFile>(file.path, [&](std::uint64_t) { progress(); });
    case FileKind::nml:
      return std::make_unique<NmlFile>(file.path, [&](std::uint64_t) { progress(); });
    case FileKind::h5:
      progress();
      return std::make_unique<H5Container>(hdf5, file.path, file.only ? &*file.only : nullptr);
    case FileKind::shard:
      progress();
      return std::make_unique<SkeletonShard>(file.skeleton_files, file.shown, file.skeleton, file.ids.get());
    case FileKind::objects:
      return std::make_unique<SkeletonObjects>(file.skeleton_files, file.skeleton, *file.ids);
  }
  return nullptr;
}

}  // namespace filiform::internal
