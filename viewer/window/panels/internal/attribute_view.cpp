#include "viewer/window/panels/internal/attribute_view.h"

#include "index/attributes/cell_filter.h"

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::internal {

AttributeView::AttributeView(const TileStore& store, std::shared_ptr<const CellColours> table)
    : store_(store), set_(dynamic_cast<const TileSet*>(&store)), table_(std::move(table)), colours_(table_) {
  if (set_ != nullptr) attributes_ = std::make_shared<CellAttributes>(*set_);
}

void AttributeView::make() {
  const bool plain = attribute_.empty() && !selection_.only;
  colours_ = numbers_                   ? coloursByNumbers(store_, *numbers_, selection_)
             : plain || set_ == nullptr ? table_
                                        : coloursByAttribute(*set_, *attributes_, attribute_, selection_);
}

void AttributeView::setTheme(Theme theme) {
  if (std::exchange(selection_.theme, theme) != theme && colours_ != nullptr) make();
}

void AttributeView::colourBy(const std::string& attribute) {
  const std::string before = std::exchange(attribute_, attribute);
  auto numbers = std::exchange(numbers_, std::nullopt);
  auto values = std::exchange(selection_.values, std::nullopt);
  try {
    make();
  } catch (...) {
    attribute_ = before;
    numbers_ = std::move(numbers);
    selection_.values = std::move(values);
    throw;
  }
}

void AttributeView::colourBy(CellValues numbers) {
  attribute_ = numbers.name;
  numbers_ = std::move(numbers);
  selection_.values.reset();
  make();
}

bool AttributeView::next() {
  table_.reset();
  const auto current = hasAttributes() && !numbers_ ? attributes_->find(attribute_) : std::nullopt;
  const std::size_t next = current ? *current + 1 : 0;
  const bool more = hasAttributes() && next < attributes_->columns().size();
  colourBy(more ? attributes_->columns()[next].name : std::string());
  return more;
}

std::size_t AttributeView::select(const std::string& condition) {
  const CellFilter filter({condition});
  std::vector<std::uint32_t> cells = filter.select(*set_, *attributes_);
  const std::size_t count = cells.size();
  if (count == 0) return 0;
  const std::string name = condition.substr(0, condition.find_first_of("=<>!"));
  selection_ = {.only = std::move(cells), .values = {}, .theme = selection_.theme};
  condition_ = condition;
  if (attribute_.empty()) attribute_ = name;
  make();
  return count;
}

void AttributeView::toggle(const std::string& value, bool alone) {
  if (colours_ == nullptr) return;
  auto& values = selection_.values;
  if (alone || !values) {
    values = std::vector<std::string>{value};
  } else if (const auto at = std::find(values->begin(), values->end(), value); at != values->end()) {
    values->erase(at);
    if (values->empty()) values.reset();
  } else {
    values->push_back(value);
  }
  make();
}

void AttributeView::selectAll() {
  selection_ = {.theme = selection_.theme};
  condition_.clear();
  make();
}

std::vector<std::uint32_t> AttributeView::selected() const {
  std::vector<std::uint32_t> cells;
  for (std::uint32_t cell = 0; cell < store_.cell_count(); ++cell)
    if (colours_ == nullptr || colours_->is_chosen.empty() || colours_->is_chosen[cell]) cells.push_back(cell);
  return cells;
}

bool AttributeView::isCondition(const std::string& text) const {
  return hasAttributes() && text.find_first_of("=<>") != std::string::npos;
}

void AttributeView::fill(PanelData& d) const {
  if (hasAttributes())
    for (const CellAttributes::Column& column : attributes_->columns()) d.colours.attributes.push_back(column.name);
  d.colours.attribute = attribute_;
  d.colours.selection = condition_;
  if (colours_ != nullptr) d.colours.legend = &colours_->legend, d.colours.unit = colours_->unit;
  d.colours.unchosen = unchosenOn(selection_.theme);
  d.colours.selected = selection_.only.has_value() || selection_.values.has_value();
}

void AttributeView::describe(nlohmann::ordered_json& json) const {
  json["attribute"] = attribute_;
  json["selection"] = condition_;
  json["selected_values"] = selection_.values.value_or(std::vector<std::string>());
  json["selected_cells"] = selection_.only ? selection_.only->size() : 0;
  json["legend_values"] = colours_ != nullptr ? colours_->legend.size() : 0;
}

}  // namespace filiform::internal
