#include "index/ingest/growth/internal/amended_revision.h"

#include "index/file/internal/output_file.h"
#include "index/file/internal/set_files.h"
#include "index/set/internal/manifest.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace filiform::internal {
namespace {

std::string textOfProvenance(const Provenance& provenance) {
  std::string text;
  writeProvenance(provenance, [&](std::string_view piece) { text += piece; });
  return text;
}

}  // namespace

std::string publishAmended(SetFolder& folder, const TileSet& base, const std::map<std::string, Bytes>& sections,
                           const Provenance* provenance) {
  Manifest manifest = decodeManifest(base.manifest());
  const Provenance before = decodeProvenance(base.readProvenance(), base.manifest());
  std::map<std::string, Bytes> made;  // by file; empty: left out
  for (const auto& [name, bytes] : sections)
    if (base.section(name).value_or(Bytes()) != bytes) made[sectionFile(name)] = bytes;
  if (provenance != nullptr) {
    const std::string text = textOfProvenance(*provenance);
    if (text != base.readProvenance() || provenance->codes != before.codes)
      made[kProvenanceFile].assign(text.begin(), text.end());
  }
  if (made.empty()) return base.revision();
  std::erase_if(manifest.files, [&](const SetFile& file) { return made.contains(file.name); });
  for (SetFile& file : manifest.files)
    if (file.revision.empty()) file.revision = base.revision();
  std::vector<std::string> in_use;
  for (const SetFile& file : manifest.files) in_use.push_back(file.revision);
  for (const auto& [name, bytes] : made) {
    if (bytes.empty()) continue;
    OutputFile file(folder.building() + "/" + name);
    file.write(bytes);
    file.close();
    manifest.files.push_back({name, file.bytes(), file.digest()});
  }
  std::sort(manifest.files.begin(), manifest.files.end(),
            [](const SetFile& a, const SetFile& b) { return a.name < b.name; });
  const std::string text = encodeManifest(manifest, provenance != nullptr ? *provenance : before);
  OutputFile file(folder.building() + "/" + kManifestFile);
  file.write(text);
  file.close();
  syncFolder(folder.building());
  const std::string revision = revisionName(text);
  folder.publish(revision, in_use);
  return revision;
}

}  // namespace filiform::internal
