#include "index/containers/internal/file_kind.h"

#include "index/formats/internal/catmaid_columns.h"
#include "index/text.h"

namespace filiform::internal {
namespace {

bool beginsLikeMouseLight(std::string_view head) {
  const std::size_t begin = head.find_first_not_of(" \t\r\n\xEF\xBB\xBF");
  return begin != std::string_view::npos && (head[begin] == '{' || head[begin] == '[') &&
         (head.find("\"neurons\"") != std::string_view::npos || head.find("\"idString\"") != std::string_view::npos);
}

}  // namespace

FileKind kindOf(std::string_view path) {
  if (endsWithNoCase(path, ".zip")) return FileKind::zip;
  if (endsWithNoCase(path, ".tar.gz") || endsWithNoCase(path, ".tgz")) return FileKind::tar_gz;
  if (endsWithNoCase(path, ".tar")) return FileKind::tar;
  if (endsWithNoCase(path, ".json")) return FileKind::mouselight;
  if (endsWithNoCase(path, ".csv")) return FileKind::catmaid;
  if (endsWithNoCase(path, ".nml") || endsWithNoCase(path, ".xml")) return FileKind::nml;
  if (endsWithNoCase(path, ".h5")) return FileKind::h5;
  return FileKind::cell;
}

bool namesSwc(std::string_view path) {
  return endsWithNoCase(path, ".swc") || endsWithNoCase(path, ".eswc") || endsWithNoCase(path, ".swc.txt");
}

bool isReadInFolders(std::string_view path) {
  return kindOf(path) != FileKind::cell || namesSwc(path) || endsWithNoCase(path, ".asc");
}

bool mayHoldCells(FileKind kind, std::string_view head) {
  switch (kind) {
    case FileKind::mouselight:
      return beginsLikeMouseLight(head);
    case FileKind::catmaid:
      return CatmaidColumns::of(head.substr(0, head.find_first_of("\r\n"))).isWhole();
    case FileKind::nml:
      return head.find("<things") != std::string_view::npos;
    case FileKind::h5:
      return head.starts_with("\x89HDF\r\n\x1A\n");
    default:
      return true;
  }
}

}  // namespace filiform::internal
