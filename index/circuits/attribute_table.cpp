#include "index/circuits/attribute_table.h"

#include "index/count_text.h"
#include "index/errors.h"
#include "index/file/internal/bytes.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>
#include <unordered_set>
#include <utility>

namespace filiform {
namespace {

constexpr std::string_view kTableMark = "\xEF\xBB\xBF";

// Reads the fields of a table, record by record.
class TableText {
 public:
  TableText(std::string_view text, const std::string& file) : text_(text), file_(file) {
    if (text_.starts_with(kTableMark)) text_.remove_prefix(kTableMark.size());
    const std::string_view header = text_.substr(0, text_.find('\n'));
    separator_ = header.find('\t') != std::string_view::npos  ? '\t'
                 : header.find(',') != std::string_view::npos ? ','
                 : header.find(';') != std::string_view::npos ? ';'
                                                              : ',';
  }

  // The line at which the last record begins.
  std::uint64_t line() const { return line_; }
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(inShort(file_) + ":" + std::to_string(line_) + ": " + what);
  }

  // False at the end. Empty lines are passed over.
  bool next(std::vector<std::string>& fields) {
    for (;;) {
      line_ = next_line_;
      if (text_.empty()) return false;
      fields.clear();
      do fields.push_back(field());
      while (!at_end_);
      if (fields.size() > 1 || !fields.front().empty()) return true;
    }
  }

 private:
  // Reads a field and what ends it; `at_end_`: the record ends too.
  std::string field() {
    std::string value;
    at_end_ = true;
    if (text_.starts_with('"')) {
      text_.remove_prefix(1);
      for (;;) {
        if (text_.empty()) fail("a quote is not closed");
        const char c = text_.front();
        text_.remove_prefix(1);
        next_line_ += c == '\n';
        if (c != '"') {
          value += c;
        } else if (text_.starts_with('"')) {
          value += c;
          text_.remove_prefix(1);
        } else {
          break;
        }
      }
    }
    while (!text_.empty()) {
      const char c = text_.front();
      text_.remove_prefix(1);
      if (c == separator_) {
        at_end_ = false;
        return value;
      }
      if (c == '\n' || c == '\r') {
        if (c == '\r' && text_.starts_with('\n')) text_.remove_prefix(1);
        ++next_line_;
        return value;
      }
      value += c;
    }
    return value;
  }

  std::string_view text_;
  const std::string& file_;
  char separator_ = ',';
  std::uint64_t line_ = 1, next_line_ = 1;
  bool at_end_ = true;
};

std::string firstNames(const std::vector<std::string>& names) {
  std::string list;
  constexpr std::size_t kNamed = 12;
  for (std::size_t i = 0; i < std::min(names.size(), kNamed); ++i) list += (i > 0 ? ", " : "") + escaped(names[i], 40);
  return names.size() > kNamed ? list + ", ..." : list;
}

}  // namespace

AttributeTable AttributeTable::read(const std::string& path, const std::string& key) {
  std::error_code error;
  const std::uint64_t bytes = std::filesystem::file_size(path, error);
  if (error) throw IoError(inShort(path), "cannot read the table of attributes", error.value());
  if (bytes > kMaxBytes) throw InputError(inShort(path) + ": a table of attributes has at most 1 GiB");
  std::ifstream in(path, std::ios::binary);
  if (!in) throw IoError(inShort(path), "cannot open the table of attributes", errno);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  return parse(text, std::filesystem::path(path).filename().native(), key);
}

AttributeTable AttributeTable::parse(std::string_view text, const std::string& file, const std::string& key) {
  AttributeTable table;
  table.file_ = file;
  TableText in(text, file);
  if (!isUtf8(text)) in.fail("is not UTF-8 text");
  std::vector<std::string> header, fields;
  if (!in.next(header)) in.fail("is empty; the first line must name the columns");
  const auto found = std::find(header.begin(), header.end(), key);
  if (found == header.end()) in.fail("has no column " + escaped(key, 40) + " (--key); it has " + firstNames(header));
  const auto key_column = static_cast<std::size_t>(found - header.begin());
  std::vector<std::size_t> columns;
  std::unordered_set<std::string_view> known;
  for (std::size_t i = 0; i < header.size(); ++i) {
    if (header[i].empty()) continue;
    if (!known.insert(header[i]).second) in.fail("has two columns " + escaped(header[i], 40));
    if (i == key_column) continue;
    columns.push_back(i);
    table.names_.push_back(header[i]);
  }
  table.kinds_.resize(columns.size());
  while (in.next(fields)) {
    if (fields.size() > header.size())
      in.fail("has " + counted(fields.size(), "field") + ", but the header has " + std::to_string(header.size()));
    fields.resize(header.size());
    if (table.rows_.empty()) table.first_key_ = fields[key_column];
    if (!table.by_key_.try_emplace(fields[key_column], table.rows_.size()).second) {
      ++table.repeated_;
      continue;
    }
    std::vector<std::string> row;
    for (const std::size_t column : columns) {
      table.kinds_[row.size()].add(fields[column]);
      row.push_back(std::move(fields[column]));
    }
    table.rows_.push_back(std::move(row));
  }
  return table;
}

std::size_t AttributeTable::find(std::string_view cell_name) const {
  const auto found = by_key_.find(std::string(cell_name));
  return found == by_key_.end() ? kNone : found->second;
}

std::vector<CellAttribute> AttributeTable::attributes(std::size_t row) const {
  std::vector<CellAttribute> attributes;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    AttributeValue value = kinds_[i].valueOf(rows_[row][i]);
    if (!isMissing(value)) attributes.push_back({names_[i], std::move(value)});
  }
  return attributes;
}

std::uint64_t AttributeTable::held_bytes() const {
  std::uint64_t bytes = 0;
  for (const auto& row : rows_)
    for (const std::string& field : row) bytes += sizeof field + (field.size() > 15 ? field.size() + 1 : 0);
  return bytes + rows_.size() * 128;
}

AttributedCells::AttributedCells(CellStream& cells, const AttributeTable& table)
    : cells_(cells), table_(table), used_(table.rows(), false) {}

bool AttributedCells::next(Cell& cell) {
  if (!cells_.next(cell)) {
    complete_ = true;
    return false;
  }
  const std::string name = cell.name.empty() ? cellNames({cell.source}).front() : cell.name;
  std::size_t row = table_.find(name);
  for (const CellAttribute& attribute : cell.attributes)  // a skeleton with a name also has an id
    if (row == AttributeTable::kNone && attribute.name == "id") row = table_.find(textOf(attribute.value));
  if (with_row_ + without_row_ == 0) first_cell_ = name;
  if (!complete_) ++(row == AttributeTable::kNone ? without_row_ : with_row_);
  if (row == AttributeTable::kNone) return true;
  used_[row] = true;
  for (CellAttribute& attribute : table_.attributes(row)) {
    const auto same = std::find_if(cell.attributes.begin(), cell.attributes.end(),
                                   [&](const CellAttribute& a) { return a.name == attribute.name; });
    if (same == cell.attributes.end())
      cell.attributes.push_back(std::move(attribute));
    else
      same->value = std::move(attribute.value);
  }
  return true;
}

std::uint64_t AttributedCells::rows_without_cell() const {
  return static_cast<std::uint64_t>(std::count(used_.begin(), used_.end(), false));
}

std::vector<std::uint8_t> AttributedCells::encodeCounts() const {
  internal::ByteWriter out;
  out.u64(with_row_);
  out.u64(without_row_);
  for (const bool used : used_) out.u8(used ? 1 : 0);
  out.text(first_cell_);
  return out.take();
}

void AttributedCells::takeCounts(const std::vector<std::vector<std::uint8_t>>& parts) {
  with_row_ = without_row_ = 0;
  first_cell_.clear();
  for (const std::vector<std::uint8_t>& bytes : parts) {
    internal::ByteReader in(bytes);
    with_row_ += in.u64();
    without_row_ += in.u64();
    for (std::size_t row = 0; row < used_.size(); ++row)
      if (in.u8() != 0) used_[row] = true;
    const internal::ByteSpan name = in.take(in.left());
    if (first_cell_.empty()) first_cell_.assign(name.begin(), name.end());
  }
}

}  // namespace filiform
