#include "viewer/window/panels/internal/attribute_view.h"

#include "index/attributes/cell_filter.h"

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::internal {

AttributeView::AttributeView(const TileStore& store) : set_(dynamic_cast<const TileSet*>(&store)) {
  if (set_ != nullptr) attributes_ = std::make_unique<CellAttributes>(*set_);
}

void AttributeView::make() {
  const bool plain = attribute_.empty() && !only_;
  colours_ = plain || set_ == nullptr ? nullptr : coloursByAttribute(*set_, *attributes_, attribute_, only_, values_);
}

void AttributeView::colourBy(const std::string& attribute) {
  if (!hasAttributes()) return;
  const std::string before = std::exchange(attribute_, attribute);
  const auto values = std::exchange(values_, std::nullopt);
  try {
    make();
  } catch (...) {
    attribute_ = before;
    values_ = values;
    throw;
  }
}

bool AttributeView::next() {
  if (!hasAttributes()) return false;
  const auto current = attributes_->find(attribute_);
  const std::size_t next = attribute_.empty() || !current ? 0 : *current + 1;
  const bool more = next < attributes_->columns().size();
  colourBy(more ? attributes_->columns()[next].name : std::string());
  return more;
}

std::size_t AttributeView::select(const std::string& condition) {
  const CellFilter filter({condition});
  std::vector<std::uint32_t> cells = filter.select(*set_, *attributes_);
  const std::size_t count = cells.size();
  if (count == 0) return 0;
  const std::string name = condition.substr(0, condition.find_first_of("=<>!"));
  only_ = std::move(cells);
  condition_ = condition;
  values_.reset();
  if (attribute_.empty()) attribute_ = name;
  make();
  return count;
}

void AttributeView::toggle(const std::string& value, bool alone) {
  if (colours_ == nullptr) return;
  if (alone || !values_) {
    values_ = std::vector<std::string>{value};
  } else if (const auto at = std::find(values_->begin(), values_->end(), value); at != values_->end()) {
    values_->erase(at);
    if (values_->empty()) values_.reset();
  } else {
    values_->push_back(value);
  }
  make();
}

void AttributeView::selectAll() {
  only_.reset();
  condition_.clear();
  values_.reset();
  if (set_ != nullptr) make();
}

bool AttributeView::isCondition(const std::string& text) const {
  return hasAttributes() && text.find_first_of("=<>") != std::string::npos;
}

void AttributeView::fill(PanelData& d) const {
  if (!hasAttributes()) return;
  for (const CellAttributes::Column& column : attributes_->columns()) d.attribute_names.push_back(column.name);
  d.attribute = attribute_;
  d.selection = condition_;
  if (colours_ != nullptr) d.legend = &colours_->legend;
  d.selected = only_.has_value() || values_.has_value();
}

void AttributeView::describe(nlohmann::ordered_json& json) const {
  json["attribute"] = attribute_;
  json["selection"] = condition_;
  json["selected_values"] = values_.value_or(std::vector<std::string>());
  json["selected_cells"] = only_ ? only_->size() : 0;
  json["legend_values"] = colours_ != nullptr ? colours_->legend.size() : 0;
}

}  // namespace filiform::internal
