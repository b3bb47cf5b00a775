// How an InputState lists its inputs: files, the entries of containers, what is passed over.
#include "index/containers/internal/archive_files.h"
#include "index/containers/internal/gunzip.h"
#include "index/containers/internal/h5_container.h"
#include "index/errors.h"
#include "index/input/internal/archive_report.h"
#include "index/input/internal/input_state.h"
#include "index/text.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <system_error>
#include <utility>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using internal::ListedFile;

std::string infoIn(const std::string& folder) {
  try {
    return filesInFolder(folder)->findText("info", SkeletonInfo::kMaxBytes).value_or("");
  } catch (const IoError& failure) {
    if (failure.isShortage()) throw;
    return {};
  }
}

// What the user may have meant by a folder without inputs.
std::string hintAt(const fs::path& folder) {
  std::error_code error;
  if (const std::string what = SkeletonInfo::elsewhere(infoIn(folder.native()), "info").what; !what.empty())
    return "; its info is that of " + what + "; give a folder of skeletons, or a volume whose info names one";
  if (fs::is_regular_file(folder / "circuit_config.json", error)) return "; for the circuit, name circuit_config.json";
  const fs::directory_iterator end;
  for (fs::directory_iterator at(folder, error); !error && at != end; at.increment(error)) {
    if (SkeletonInfo::isSkeletonInfo(infoIn(at->path().native())))
      return "; for skeletons, name their folder, such as " + escaped(at->path().filename().string(), 100);
  }
  return {};
}

}  // namespace

InputReport internal::unreadableFor(const std::string& reason) {
  InputReport report;
  report.severity = Severity::kRefuse;
  report.codes.add(InputCode::E_UNREADABLE);
  report.records.add({0, InputCode::E_UNREADABLE, Effect::kInputRefused, escaped(reason, 300)});
  return report;
}

void internal::InputState::list(const std::string& argument) {
  const internal::ListingOptions listing{options.versions, options.ids, AttributeConditions(options.where),
                                         options.box_um, options.remote};
  if (const std::string address = internal::skeletonAddress(argument); !address.empty()) {
    for (const ListedFile& file : internal::listAddress(address, listing)) addFile(file);
    return;
  }
  std::error_code error;
  const fs::file_status status = fs::status(argument, error);
  if (status.type() == fs::file_type::not_found) throw IoError(inShort(argument), "no such file or folder");
  const std::string name = fs::path(argument).filename().native();
  if (error) {
    refuse({argument, name}, IoError(inShort(argument), "cannot read", error.value()));
  } else if (fs::is_directory(status)) {
    if (fs::is_regular_file(fs::path(argument) / "CURRENT", error))
      throw InputError(inShort(argument) + ": is a tile set already; name the files that it was made from");
    const std::size_t before = rows.size();
    for (const ListedFile& file : internal::listFiles(argument, listing)) addFile(file);
    const auto first = rows.begin() + static_cast<std::ptrdiff_t>(before);
    if (std::all_of(first, rows.end(),
                    [](const SourceReport& row) { return row.report.severity == Severity::kPassed; })) {
      const std::string passed = passedOverText(totals({first, rows.end()}).passed_over);
      throw InputError(inShort(argument) +
                       ": no .swc, .asc, .h5 or .nml file, MouseLight .json, CATMAID .csv or archive (.zip, .tar, "
                       ".tar.gz) in this folder" +
                       (passed.empty() ? "" : "; passed over: " + passed) + hintAt(argument));
    }
  } else if (fs::is_regular_file(status)) {
    addFile(internal::fileArgument(argument, name));
  } else {
    throw IoError(inShort(argument), "neither a file nor a folder");
  }
}

// Adds a row for a file that is no input.
void internal::InputState::passOver(const ListedFile& file) {
  addRow(file, 0).archive = false;
  rows.back().report.severity = Severity::kPassed;
}

// Adds a row for an unreadable input. Rethrows the failure if the process is at fault.
void internal::InputState::refuse(const ListedFile& file, const IoError& failure) {
  if (failure.isShortage()) throw failure;
  addRow(file, {}).report = unreadableFor(failure.reason());
}

SourceReport& internal::InputState::addRow(const ListedFile& file, std::uint64_t bytes) {
  SourceReport report;
  report.file = file.shown;
  report.archive = file.kind != internal::FileKind::cell;
  report.bytes = bytes;
  bytes_total += bytes;
  files.push_back(file);
  content_bytes.push_back(0);
  return rows.emplace_back(std::move(report));
}

void internal::InputState::addFile(const ListedFile& file) {
  const auto row = static_cast<std::uint32_t>(rows.size());
  try {
    if (!file.unreadable.empty()) throw IoError(inShort(file.path), file.unreadable);
    if (file.passed) return passOver(file);
    if (file.left_out) return addLeftOut(file);
    if (!file.not_read.empty()) {
      InputReport& report = addRow(file, 0).report;
      report.severity = Severity::kRefuse;
      report.codes.add(InputCode::E_FORMAT);
      report.records.add({0, InputCode::E_FORMAT, Effect::kInputRefused, file.not_read});
      return;
    }
    const auto between = [this] { advance(0); };
    std::unique_ptr<Container> container = internal::openContainer(file, hdf5, between);
    const auto* const h5 = dynamic_cast<const internal::H5Container*>(container.get());
    if (h5 != nullptr && !h5->holdsAny()) {
      if (file.found) return passOver(file);
      throw IoError(inShort(file.path), internal::H5Container::kNoMorphology);
    }
    if (h5 != nullptr && h5->isSingle()) {
      addRow(file, h5->file_bytes()).archive = false;
      items.push_back({file.shown, row, kNoEntry, std::nullopt, false});
    } else if (container) {
      container->leaveOut(options.versions);
      if (file.kind == internal::FileKind::zip || file.kind == internal::FileKind::tar ||
          file.kind == internal::FileKind::tar_gz)
        container = internal::ArchiveFiles::open(std::move(container), options.memory, hdf5, between);
      addRow(file, container->file_bytes()).digest = container->digest();
      std::uint32_t number = 0;
      for (const ArchiveEntry& entry : container->entries()) {
        if (!entry.skipped) items.push_back({file.shown + "/" + entry.shown_label(), row, number, std::nullopt, false});
        ++number;
      }
      containers.try_emplace(row, std::move(container));
    } else {
      std::error_code error;
      const std::uint64_t bytes = fs::file_size(file.path, error);
      if (error) throw IoError(inShort(file.path), "cannot read", error.value());
      addRow(file, bytes);
      if (file.packed) {
        const std::uint64_t stated = internal::statedSize(file.path).value_or(0);
        content_bytes.back() = stated >= bytes ? stated : 0;  // else there are several members
      }
      items.push_back({file.shown, row, kNoEntry, std::nullopt, false});
    }
  } catch (const IoError& failure) {
    refuse(file, failure);
  }
}

// The other version of the neuron is read.
void internal::InputState::addLeftOut(const ListedFile& file) {
  SourceReport& row = addRow(file, 0);
  row.left_out = true;
  row.report.codes.add(InputCode::OTHER_VERSION);
  row.report.records.add({0, InputCode::OTHER_VERSION, Effect::kInputRefused, {}});
}

}  // namespace filiform
