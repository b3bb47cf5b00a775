// CellTable: the cells of the open scene as a table. Sorts, filters and measures them on threads of its own.
// Thread rule: the window's thread. No member but the destructor waits for the disk.
#pragma once

#include "index/attributes/cell_attributes.h"
#include "index/measure/measures.h"
#include "index/set/tile_store.h"
#include "solver/travel/session/worker.h"
#include "viewer/scene/cell_colours.h"

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace filiform::internal {

inline constexpr std::string_view kMeasurePrefix = "measure:";  // of a feature that gives the colours

class CellTable {
 public:
  struct Column {
    enum class Kind : std::uint8_t { name, attribute, measure } kind = Kind::name;
    std::uint32_t index = 0;       // of the attribute or the feature
    std::string title, colouring;  // colouring: as `--colour-by` has it; empty: of the names
    bool is_number = false, is_shown = false;
    bool is_read = false;  // an attribute: text() needs no disk
  };
  struct Order {
    std::size_t column = 0;
    bool descending = false;
    std::string filter;  // only cells with this text in the name or in a shown attribute; letter case does not count
    friend bool operator==(const Order&, const Order&) = default;
  };

  // The store must outlive this object. `attributes`: nullptr: none.
  CellTable(const TileStore& store, std::shared_ptr<const CellAttributes> attributes);
  ~CellTable();  // waits until the work under way has noticed that it is to end
  CellTable(const CellTable&) = delete;
  CellTable& operator=(const CellTable&) = delete;

  // Begins to list the cells. Small local sets are measured too.
  void open();
  // Cancels measuring. What has been measured is kept.
  void close();
  bool isOpen() const { return is_open_; }
  // Once a frame: takes up finished work, and begins what is due.
  void serve();

  const std::vector<Column>& columns() const { return columns_; }
  void show(std::size_t column, bool shown);
  const Order& order() const { return order_; }
  void setOrder(const Order& order) { order_ = order; }

  // The cells that pass the filter, in order; those without a value are last. It may be of an earlier order.
  const std::vector<std::uint32_t>& rows() const { return *rows_; }
  std::uint32_t cells() const { return cells_; }  // without the filter; 0 until they are listed
  bool isListing() const { return listing_; }
  // The value of a listed cell. Empty: it has none, or it is not known yet.
  std::string text(std::uint32_t cell, std::size_t column) const;

  // Begins to measure all features of all cells, once.
  void measure();
  bool isMeasured() const { return measured_ != nullptr; }
  std::optional<double> progress() const;  // of measuring, 0 to 1; none: it is not under way
  // One number a cell. Nullopt until the cells are measured.
  std::optional<CellValues> numbersOf(const Feature& feature) const;
  const std::string& error() const { return error_; }  // one line; empty: none

  void describe(nlohmann::ordered_json& state) const;

 private:
  using Values = std::vector<std::vector<double>>;  // by feature, by cell; NaN: none
  // What the list was made of, or is to be made of.
  struct List {
    Order order;
    std::vector<std::size_t> attributes;  // the shown columns
    bool measured = false;
    friend bool operator==(const List&, const List&) = default;
  };
  List wanted() const;
  void list();

  const TileStore& store_;
  const std::shared_ptr<const CellAttributes> attributes_;
  std::vector<Column> columns_;
  Order order_;
  std::optional<List> listed_;
  std::shared_ptr<const std::vector<std::uint32_t>> rows_;
  std::uint32_t cells_ = 0;
  std::shared_ptr<const Values> measured_;
  std::string error_;
  bool is_open_ = false, listing_ = false;
  std::atomic<bool> leaving_{false};
  struct Measuring {
    std::atomic<bool> stop{false};
    std::atomic<double> part{0};
  };
  std::shared_ptr<Measuring> measuring_;           // nullptr: it is not under way
  std::unique_ptr<Worker> list_maker_, measurer_;  // made at their first use; destroyed first
};

}  // namespace filiform::internal
