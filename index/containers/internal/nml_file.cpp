#include "index/containers/internal/nml_file.h"

#include "index/file/internal/digest.h"
#include "index/file/internal/file_parts.h"
#include "index/formats/swc/internal/text_sniff.h"
#include "index/text.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

namespace filiform {

class NmlFile::TreeReader final : public Container::Reader {
 public:
  explicit TreeReader(const NmlFile& file) : nml_(file) {}

  std::optional<InputCode> read(const ArchiveEntry& entry, const Sink& sink) override {
    if (!file_) file_.emplace(nml_.path_, nml_.file_bytes_);
    const internal::NmlTree& tree = nml_.outline_.trees[entry.index];
    file_->pass(nml_.outline_.parameters_at, nml_.outline_.parameters_bytes, sink);
    sink(internal::leftOutOfNml(tree));
    file_->pass(tree.at, tree.bytes, sink);
    return std::nullopt;
  }

 private:
  const NmlFile& nml_;
  std::optional<internal::FileParts> file_;
};

NmlFile::NmlFile(std::string path, const std::function<void(std::uint64_t)>& progress) : path_(std::move(path)) {
  internal::FileParts file(path_);
  internal::RunningDigest digest;
  std::string text;
  std::vector<char> block(std::size_t{1} << 16);
  while (const std::size_t n = file.next(block)) {
    file_bytes_ += n;
    digest.add(std::string_view(block.data(), n));
    if (text.size() <= internal::NmlOutline::kMostBytes) text.append(block.data(), n);
    if (progress) progress(n);
  }
  digest_ = digest.value();
  const bool binary = internal::hasBinaryMagic(text);
  if (binary || internal::isWideText(std::string_view(text).substr(0, 4096))) {
    refuse(binary ? InputCode::E_NOT_TEXT : InputCode::E_ENCODING);
    return;
  }
  if (text.size() > internal::NmlOutline::kMostBytes)
    outline_.wrong = "XML of more than 256 MiB; export fewer trees to a file";
  else
    outline_ = internal::outlineOfNml(text);
  if (!outline_.wrong.empty()) {
    refuse(InputCode::E_FORMAT, outline_.wrong);
    return;
  }
  for (const internal::NmlTree& tree : outline_.trees) {
    ArchiveEntry entry;
    entry.index = entries_.size();
    entry.name = tree.name;
    std::string label = escaped(tree.name, 200);
    std::replace(label.begin(), label.end(), '/', '_');
    if (label != entry.name) entry.label = std::move(label);
    entry.packed_bytes = tree.bytes;
    entry.bytes = outline_.parameters_bytes + internal::leftOutOfNml(tree).size() + tree.bytes;
    entry.format = GraphFormat::kNml;
    entries_.push_back(std::move(entry));
  }
  finishListing();
}

std::unique_ptr<Container::Reader> NmlFile::reader() const { return std::make_unique<TreeReader>(*this); }

}  // namespace filiform
