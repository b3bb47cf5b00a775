#include "index/containers/internal/catmaid_file.h"

#include "index/file/internal/digest.h"
#include "index/file/internal/file_parts.h"
#include "index/formats/internal/catmaid_columns.h"
#include "index/formats/swc.h"
#include "index/formats/swc/internal/text_sniff.h"
#include "index/text.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace filiform {

// Splits the file into lines, and gives each to its skeleton.
class CatmaidFile::Listing {
 public:
  explicit Listing(CatmaidFile& made) : made_(made) {}

  void feed(std::string_view bytes) {
    while (!bytes.empty()) {
      const std::size_t end = bytes.find('\n');
      const std::string_view part = bytes.substr(0, end);
      text_ += part.substr(0, SwcReader::kMaxDataLine - std::min(text_.size(), SwcReader::kMaxDataLine));
      size_ += part.size();
      if (end == std::string_view::npos) return;
      ++size_;
      bytes.remove_prefix(end + 1);
      endLine();
    }
  }
  void finish() {
    if (size_ > 0) endLine();
  }

 private:
  void endLine() {
    if (line_ == 1) {
      made_.header_ = text_;
      columns_ = internal::CatmaidColumns::of(text_);
    } else if (columns_.isWhole() && text_.find_first_not_of(" \t\r") != std::string::npos && text_[0] != '#') {
      add();
    }
    at_ += size_;
    ++line_;
    size_ = 0;
    text_.clear();
  }

  // A line without a skeleton goes to the one before it, which drops it with a record.
  void add() {
    internal::splitRow(text_, columns_.separator, values_);
    std::string name;
    if (columns_.skeleton < values_.size()) name = values_[columns_.skeleton];
    if (name.empty() && !made_.entries_.empty()) name = made_.entries_[last_].name;
    const auto [found, is_new] = places_.try_emplace(name, made_.entries_.size());
    if (is_new) {
      ArchiveEntry entry;
      entry.index = found->second;
      entry.format = GraphFormat::kCatmaid;
      std::string label = escaped(name.empty() ? "skeleton" : name, 200);
      std::replace(label.begin(), label.end(), '/', '_');
      if (label != name) entry.label = std::move(label);
      entry.name = name;
      made_.entries_.push_back(std::move(entry));
      made_.runs_.emplace_back();
    }
    std::vector<Run>& runs = made_.runs_[found->second];
    if (!runs.empty() && runs.back().at + runs.back().bytes == at_ && last_ == found->second)
      runs.back().bytes += size_;
    else
      runs.push_back({at_, size_, line_});
    made_.entries_[found->second].bytes += size_;
    last_ = found->second;
  }

  CatmaidFile& made_;
  internal::CatmaidColumns columns_;
  std::vector<std::string_view> values_;
  std::unordered_map<std::string, std::size_t> places_;  // of skeletons in entries_
  std::size_t last_ = 0;
  std::string text_;
  std::uint64_t at_ = 0, size_ = 0, line_ = 1;
};

class CatmaidFile::TableReader final : public Container::Reader {
 public:
  explicit TableReader(const CatmaidFile& table) : table_(table) {}

  std::optional<InputCode> read(const ArchiveEntry& entry, const Sink& sink) override {
    if (!file_) file_.emplace(table_.path_, table_.file_bytes_);
    sink(table_.header_);
    for (const Run& run : table_.runs_[entry.index]) {
      sink("\n#line " + std::to_string(run.line) + "\n");
      file_->pass(run.at, run.bytes, sink);
    }
    return std::nullopt;
  }

 private:
  const CatmaidFile& table_;
  std::optional<internal::FileParts> file_;
};

CatmaidFile::CatmaidFile(std::string path, const std::function<void(std::uint64_t)>& progress)
    : path_(std::move(path)) {
  internal::FileParts file(path_);
  internal::RunningDigest digest;
  Listing listing(*this);
  std::vector<char> block(std::size_t{1} << 16);
  std::optional<InputCode> refused;
  while (const std::size_t n = file.next(block)) {
    const std::string_view bytes(block.data(), n);
    if (file_bytes_ == 0 && internal::hasBinaryMagic(bytes)) refused = InputCode::E_NOT_TEXT;
    if (file_bytes_ == 0 && internal::isWideText(bytes.substr(0, 4096))) refused = InputCode::E_ENCODING;
    file_bytes_ += n;
    digest.add(bytes);
    if (!refused) listing.feed(bytes);
    if (progress) progress(n);
  }
  listing.finish();
  digest_ = digest.value();
  for (ArchiveEntry& entry : entries_) {
    entry.packed_bytes = entry.bytes;
    entry.bytes += header_.size() + 32 * runs_[entry.index].size();  // with the marks of lines
  }
  const internal::CatmaidColumns columns = internal::CatmaidColumns::of(header_);
  if (refused) {
    refuse(*refused);
  } else if (!columns.isWhole()) {
    refuse(InputCode::E_FORMAT,
           "line 1: a CSV table without the columns of CATMAID's skeletons; missing: " + columns.missing());
  } else {
    finishListing();
  }
}

std::unique_ptr<Container::Reader> CatmaidFile::reader() const { return std::make_unique<TableReader>(*this); }

}  // namespace filiform
