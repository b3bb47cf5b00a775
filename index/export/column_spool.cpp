#include "index/export/column_spool.h"

#include "index/file/internal/unnamed_file.h"

#include <algorithm>

namespace filiform::tools {

namespace {

constexpr std::size_t kPart = 65536;

struct Column {
  std::vector<std::uint64_t> places;  // of its full parts in the file
  std::string last;
};

}  // namespace

struct ColumnSpool::Impl {
  internal::UnnamedFile file;
  std::uint64_t end = 0;
  std::vector<Column> columns;
};

ColumnSpool::ColumnSpool(std::size_t columns, const std::string& content)
    : impl_(std::make_unique<Impl>(Impl{internal::UnnamedFile("", content), 0, std::vector<Column>(columns)})) {}
ColumnSpool::~ColumnSpool() = default;
ColumnSpool::ColumnSpool(ColumnSpool&&) noexcept = default;

void ColumnSpool::append(std::size_t column, const void* bytes, std::size_t count) {
  Column& to = impl_->columns[column];
  for (const char* from = static_cast<const char*>(bytes); count > 0;) {
    const std::size_t some = std::min(count, kPart - to.last.size());
    to.last.append(from, some);
    from += some;
    count -= some;
    if (to.last.size() < kPart) return;
    impl_->file.create();
    impl_->file.write(impl_->end, to.last.data(), kPart);
    to.places.push_back(impl_->end);
    impl_->end += kPart;
    to.last.clear();
  }
}

std::string ColumnSpool::part(std::size_t column, std::size_t index) const {
  const Column& from = impl_->columns[column];
  if (index > from.places.size()) return {};
  if (index == from.places.size()) return from.last;
  std::string bytes(kPart, '\0');
  impl_->file.read(from.places[index], bytes.data(), kPart);
  return bytes;
}

}  // namespace filiform::tools
