#include "viewer/window/panels/internal/cell_table.h"

#include "index/count_text.h"
#include "index/measure/set_measures.h"
#include "index/text.h"
#include "viewer/window/panels/internal/background_work.h"
#include "viewer/window/settings/internal/text_format.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::internal {
namespace {

constexpr std::size_t kAttributesShown = 4;            // at first
constexpr std::uint64_t kMeasuredUnasked = 2'000'000;  // segments
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string numberText(double value, bool is_count) {
  const double size = std::abs(value);
  if (size >= 1000 && size < 1e15)
    return (value < 0 ? "-" : "") + formatCount(static_cast<std::uint64_t>(std::llround(size)));
  return format(is_count ? "%.0f" : size >= 10 ? "%.1f" : "%.3g", value);
}

}  // namespace

CellTable::CellTable(const TileStore& store, std::shared_ptr<const CellAttributes> attributes)
    : store_(store),
      attributes_(std::move(attributes)),
      columns_{{.title = "cell", .colouring = {}, .is_shown = true}},
      rows_(std::make_shared<std::vector<std::uint32_t>>()) {
  using Kind = Column::Kind;
  if (attributes_ != nullptr)
    for (std::uint32_t i = 0; i < attributes_->columns().size(); ++i) {
      const CellAttributes::Column& column = attributes_->columns()[i];
      columns_.push_back({.kind = Kind::attribute,
                          .index = i,
                          .title = column.name,
                          .colouring = column.name,
                          .is_number = column.type != AttributeType::text,
                          .is_shown = i < kAttributesShown || column.name == "type" || column.name == "mtype"});
    }
  for (std::uint32_t i = 0; i < features().size(); ++i) {
    const Feature& feature = features()[i];
    std::string title(feature.name);
    std::replace(title.begin(), title.end(), '_', ' ');
    if (!feature.unit.empty()) title += ", " + unitText(feature.unit);
    columns_.push_back({.kind = Kind::measure,
                        .index = i,
                        .title = std::move(title),
                        .colouring = std::string(kMeasurePrefix) + std::string(feature.name),
                        .is_number = true,
                        .is_shown = feature.name == "length"});
  }
}

CellTable::~CellTable() {
  leaving_ = true;
  if (measuring_) measuring_->stop = true;
}

void CellTable::open() {
  is_open_ = true;
  if (!error_.empty()) listed_.reset();  // try again
  error_.clear();
  if (!store_.isRemote() && store_.segmentCount() <= kMeasuredUnasked) measure();
}

void CellTable::close() {
  is_open_ = false;
  if (measuring_) measuring_->stop = true;
  measuring_.reset();
}

void CellTable::show(std::size_t column, bool shown) {
  columns_[column].is_shown = shown || column == 0;
  if (!shown && order_.column == column) order_.column = 0;
}

CellTable::List CellTable::wanted() const {
  List list{.order = order_, .attributes = {}, .measured = false};
  for (std::size_t i = 0; i < columns_.size(); ++i)
    if (columns_[i].kind == Column::Kind::attribute && columns_[i].is_shown) list.attributes.push_back(i);
  list.measured = measured_ != nullptr && columns_[order_.column].kind == Column::Kind::measure;
  return list;
}

void CellTable::serve() {
  const auto failed = [this](const std::string& what) {
    error_ = what;
    listing_ = false;
  };
  if (list_maker_) list_maker_->serve(failed);
  if (measurer_)
    measurer_->serve([this](const std::string& what) {
      error_ = "cannot measure the cells: " + what;
      measuring_.reset();
    });
  if (is_open_ && !listing_ && listed_ != wanted()) list();
}

void CellTable::list() {
  listing_ = true;
  listed_ = wanted();  // a list that fails is not made again before something changes
  if (!list_maker_) list_maker_ = std::make_unique<Worker>();
  list_maker_->ask([this, list = *listed_, columns = columns_, measured = measured_]() -> Worker::Done {
    lowerPriority();
    auto rows = std::make_shared<std::vector<std::uint32_t>>();
    std::uint32_t cells = 0;
    try {
      *rows = presentCells(store_, leaving_);
      cells = static_cast<std::uint32_t>(rows->size());
      // Reading whole columns now lets text() answer without the disk.
      const std::string filter = lowerCase(list.order.filter);
      std::vector<bool> passes(store_.cell_count(), filter.empty());
      const auto has = [&](const std::string& text) { return lowerCase(text).find(filter) != std::string::npos; };
      for (const std::size_t i : list.attributes) {
        if (!columns[i].is_number) {
          std::vector<bool> entries;
          for (const std::string& entry : attributes_->dictionary(columns[i].index)) entries.push_back(has(entry));
          const std::vector<std::uint32_t> codes = attributes_->codes(columns[i].index);
          for (const std::uint32_t cell : *rows)
            if (codes[cell] != CellAttributes::kNoCode && entries[codes[cell]]) passes[cell] = true;
        } else {
          attributes_->numbers(columns[i].index);
        }
      }
      if (!filter.empty())
        std::erase_if(*rows, [&](std::uint32_t cell) { return !passes[cell] && !has(store_.cell(cell).name); });
      const Column& column = columns[list.order.column];
      const bool down = list.order.descending;
      if (column.kind == Column::Kind::name) {
        std::stable_sort(rows->begin(), rows->end(), [&](std::uint32_t a, std::uint32_t b) {
          return down ? store_.cell(b).name < store_.cell(a).name : store_.cell(a).name < store_.cell(b).name;
        });
      } else if (column.kind == Column::Kind::attribute || measured != nullptr) {
        std::vector<double> keys;
        if (column.kind == Column::Kind::measure) {
          keys = (*measured)[column.index];
        } else if (column.is_number) {
          keys = attributes_->numbers(column.index);
        } else {
          for (const std::uint32_t code : attributes_->codes(column.index))
            keys.push_back(code == CellAttributes::kNoCode ? kNone : code);
        }
        std::stable_sort(rows->begin(), rows->end(), [&](std::uint32_t a, std::uint32_t b) {
          if (std::isnan(keys[a]) || std::isnan(keys[b])) return !std::isnan(keys[a]) && std::isnan(keys[b]);
          return down ? keys[b] < keys[a] : keys[a] < keys[b];
        });
      }
    } catch (const Stopped&) {
      return {};
    }
    return [this, rows = std::move(rows), read = list.attributes, cells] {
      rows_ = rows;
      cells_ = cells;
      listing_ = false;
      for (const std::size_t column : read) columns_[column].is_read = true;
    };
  });
}

std::string CellTable::text(std::uint32_t cell, std::size_t column) const {
  const Column& c = columns_[column];
  if (c.kind == Column::Kind::name) return store_.cell(cell).name;
  if (c.kind == Column::Kind::measure) {
    if (measured_ == nullptr) return {};
    const double value = (*measured_)[c.index][cell];
    return std::isnan(value) ? std::string() : numberText(value, features()[c.index].is_count);
  }
  if (!c.is_read) return {};
  const AttributeValue value = attributes_->value(c.index, cell);
  return isMissing(value) ? std::string() : textOf(value);
}

void CellTable::measure() {
  if (measured_ != nullptr || measuring_ != nullptr) return;
  error_.clear();
  measuring_ = std::make_shared<Measuring>();
  if (!measurer_) measurer_ = std::make_unique<Worker>();
  measurer_->ask([this, now = measuring_]() -> Worker::Done {
    lowerPriority();
    try {
      const std::vector<std::uint32_t> cells = presentCells(store_, now->stop);
      const double steps = static_cast<double>(store_.tile_count()) + static_cast<double>(cells.size()) / 8;
      double done = 0;
      auto values = std::make_shared<Values>(features().size(), std::vector<double>(store_.cell_count(), kNone));
      measureCells(store_, cells,
                   {.measures = {},
                    .threads = 1,
                    .check =
                        [&] {
                          if (now->stop) throw Stopped();
                          now->part = std::min(++done / (steps + 1), 0.99);
                        }},
                   [&](std::uint32_t cell, const CellMeasures& m) {
                     for (std::size_t i = 0; i < values->size(); ++i)
                       (*values)[i][cell] = features()[i].value(m.all, &m.soma);
                   });
      return [this, now, values = std::move(values)] {
        measured_ = values;
        if (measuring_ == now) measuring_.reset();
      };
    } catch (const Stopped&) {
      return {};
    } catch (const std::exception&) {
      if (now->stop) return {};
      throw;
    }
  });
}

std::optional<double> CellTable::progress() const {
  if (measuring_ == nullptr) return std::nullopt;
  return measuring_->part.load();
}

std::optional<CellValues> CellTable::numbersOf(const Feature& feature) const {
  if (measured_ == nullptr) return std::nullopt;
  const auto index = static_cast<std::size_t>(&feature - features().data());
  return CellValues{std::string(kMeasurePrefix) + std::string(feature.name), std::string(feature.unit),
                    (*measured_)[index]};
}

void CellTable::describe(nlohmann::ordered_json& json) const {
  json["cells_panel"] = is_open_;
  json["cells_listed"] = listing_ ? 0 : rows_->size();
  json["cells_measured"] = isMeasured();
  if (is_open_ && !rows_->empty()) json["first_cell_listed"] = text(rows_->front(), 0);
  json["cells_error"] = error_;
}

}  // namespace filiform::internal
