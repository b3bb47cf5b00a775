// InputState: the lists of an Input, and how far it has read. Thread rule: as Input.
#pragma once

#include "index/cell/cell_parts.h"
#include "index/cell/internal/unit_check.h"
#include "index/errors.h"
#include "index/input/input_options.h"
#include "index/input/internal/file_listing.h"
#include "index/input/internal/item_reader.h"
#include "index/input/internal/read_ahead.h"
#include "index/input/source_report.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace filiform::internal {

inline constexpr std::uint32_t kNoEntry = UINT32_MAX;
inline constexpr std::size_t kOpenArchives = 8;
// The report on an input that cannot be read.
InputReport unreadableFor(const std::string& reason);
inline bool isUnreadable(const InputReport& report) { return report.codes[InputCode::E_UNREADABLE] > 0; }

struct InputState {
  struct Item {
    std::string source;
    std::uint32_t row = 0;
    std::uint32_t entry = kNoEntry;  // in the archive's entries()
    std::optional<std::uint64_t> digest;
    bool refused = false;
  };

  explicit InputState(InputOptions input_options) : options(std::move(input_options)) {
    readers.push_back(makeReader(kOpenArchives));
  }

  void list(const std::string& argument);
  void addFile(const ListedFile& file);
  SourceReport& addRow(const ListedFile& file, std::uint64_t bytes);
  void passOver(const ListedFile& file);
  void addLeftOut(const ListedFile& file);
  void refuse(const ListedFile& file, const IoError& failure);
  void orderEqualSources();
  InputItem inputItem(const Item& item) const;
  std::unique_ptr<ItemReader> makeReader(std::size_t open_archives) const;
  std::uint64_t bytesAhead() const;
  std::uint64_t bytesOfThread() const;
  unsigned readingThreads() const;
  std::vector<std::uint64_t> costsAhead() const;
  void startReadingAhead();
  InputReport readHere(Item& item, Cell& cell);
  InputReport takeAhead(Item& item, Cell& cell);
  InputReport readOrRefuse(ItemReader& reader, const Item& item, Cell& cell,
                           const std::function<void(std::uint64_t)>& on_bytes, bool is_ahead = false) const;
  void checkUnchanged(const Item& item, const InputReport& report, const Cell& cell) const;
  void advance(std::uint64_t bytes);
  void begin();
  void record(const Item& item, std::uint64_t digest, InputReport report);
  void sumContainers();
  std::size_t startOfSource(std::uint64_t at) const;
  std::size_t end() const { return std::min(end_at, items.size()); }

  InputOptions options;
  std::vector<ListedFile> files;             // by row
  std::vector<std::uint64_t> content_bytes;  // of packed cells, by row; 0: not stated
  std::vector<SourceReport> rows;
  std::map<std::uint32_t, std::unique_ptr<Container>> containers;  // by row
  Hdf5Process hdf5;                                                // lists H5 files
  std::vector<Item> items;
  std::size_t position = 0, ordered = 0;
  std::size_t begin_at = 0, end_at = SIZE_MAX;  // of the items to be read
  bool complete = false;
  std::uint64_t bytes_total = 0, bytes_done = 0;
  UnitCheck units;
  std::vector<Cell> parts;  // of a file of several cells, the last first: next() gives one by one
  Cell whole;               // what they share: source, digest, header, attributes
  std::vector<std::unique_ptr<ItemReader>> readers;  // by thread; 0: the calling one
  std::unique_ptr<ReadAhead> ahead;                  // its threads end before all else
};

}  // namespace filiform::internal
