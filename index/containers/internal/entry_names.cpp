#include "index/containers/internal/entry_names.h"

#include "index/text.h"

#include <algorithm>
#include <string>

namespace filiform::internal {
namespace {

bool isDriveLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

bool isControl(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }

// Calls `use` for each part between slashes. Returns true if any call did.
template <class Use>
bool anyPart(std::string_view path, Use use) {
  for (;;) {
    const std::size_t slash = path.find('/');
    if (use(path.substr(0, slash))) return true;
    if (slash == std::string_view::npos) return false;
    path.remove_prefix(slash + 1);
  }
}

std::string withSlashes(std::string_view name) {
  std::string path(name);
  std::replace(path.begin(), path.end(), '\\', '/');
  return path;
}

// The path without drive, leading slashes, and empty or `.` parts.
std::string relativeForm(std::string_view path) {
  if (path.size() >= 2 && isDriveLetter(path[0]) && path[1] == ':') path.remove_prefix(2);
  std::string out;
  anyPart(path, [&](std::string_view part) {
    if (part.empty() || part == ".") return false;
    if (!out.empty()) out += '/';
    out += part;
    return false;
  });
  return out;
}

std::string withoutControls(std::string_view text) {
  std::string out;
  for (const char& c : text) out += isControl(c) ? escaped({&c, 1}) : std::string(1, c);
  return out;
}

bool isPacked(std::string_view path) {
  const FileKind kind = kindOf(path);
  return kind == FileKind::zip || kind == FileKind::tar || kind == FileKind::tar_gz || endsWithNoCase(path, ".gz");
}

}  // namespace

std::optional<ArchiveEntry> entryOfName(std::string_view raw_name, bool is_link) {
  const std::string path = withSlashes(raw_name);
  if (path.ends_with('/') && !is_link) return std::nullopt;
  const bool packed = isPacked(path);
  ArchiveEntry entry;
  entry.name = raw_name;
  entry.kind = kindOf(path);
  if (endsWithNoCase(path, ".asc")) entry.format = GraphFormat::kNeurolucida;
  const bool clutter =
      anyPart(path, [](std::string_view part) { return part == "__MACOSX" || part.substr(0, 2) == "._"; });
  if (!is_link && (clutter || !(packed || isReadInFolders(path)))) {
    entry.passed = entry.skipped = true;
    return entry;
  }
  if (anyPart(path, [](std::string_view part) { return part == ".."; })) {
    entry.skipped = true;
    entry.remarks = {InputCode::W_ZIP_UNSAFE_NAME};
    return entry;
  }
  if (is_link || packed) {
    entry.skipped = true;
    entry.remarks = {is_link ? InputCode::W_ZIP_LINK : InputCode::W_ZIP_NESTED};
    return entry;
  }
  const bool drive = path.size() >= 2 && isDriveLetter(path[0]) && path[1] == ':';
  if (drive || path[0] == '/' || path != raw_name || std::any_of(path.begin(), path.end(), isControl)) {
    entry.remarks.push_back(InputCode::W_ZIP_NAME);
  }
  if (!isUtf8(raw_name)) entry.remarks.push_back(InputCode::W_ZIP_NAME_ENCODING);
  std::string label = withoutControls(relativeForm(path));
  if (label != entry.name) entry.label = std::move(label);
  return entry;
}

}  // namespace filiform::internal
