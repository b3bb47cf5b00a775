#include "viewer/scene/cell_colours.h"

#include "index/attributes/cell_filter.h"
#include "index/errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

namespace filiform {

namespace {

constexpr Rgba kWithoutValue{128, 128, 128};
constexpr int kRampSteps = 8;

std::string shortText(double value) {
  std::array<char, 32> text{};
  const bool is_long = std::abs(value) >= 1e4 && std::abs(value) < 1e9;
  std::snprintf(text.data(), text.size(), is_long ? "%.0f" : "%.4g", value);
  return text.data();
}

// These fill the legend and return the place in it of each cell.
std::vector<std::uint32_t> legendPlacesOf(const std::vector<double>& numbers, CellColours& colours) {
  std::vector<std::uint32_t> place(numbers.size(), CellAttributes::kNoCode);
  std::map<double, std::uint32_t> values;
  double low = INFINITY, high = -INFINITY;
  for (const double number : numbers) {
    if (std::isnan(number)) continue;
    low = std::min(low, number), high = std::max(high, number);
    if (values.size() <= kMostNumberValues) values.emplace(number, 0);
  }
  const auto part = [low, high](double number) { return high > low ? (number - low) / (high - low) : 0.5; };
  if (values.size() <= kMostNumberValues) {
    for (auto& [value, at] : values) {
      at = static_cast<std::uint32_t>(colours.legend.size());
      colours.legend.push_back({shortText(value), colourOnRamp(part(value))});
    }
    for (std::size_t c = 0; c < numbers.size(); ++c)
      if (!std::isnan(numbers[c])) place[c] = values[numbers[c]];
    return place;
  }
  const double step = (high - low) / kRampSteps;
  for (int s = 0; s < kRampSteps; ++s)
    colours.legend.push_back(
        {shortText(low + s * step) + " to " + shortText(low + (s + 1) * step), colourOnRamp((s + 0.5) / kRampSteps)});
  for (std::size_t c = 0; c < numbers.size(); ++c)
    if (!std::isnan(numbers[c]))
      place[c] = static_cast<std::uint32_t>(
          std::isfinite(step) ? std::clamp(kRampSteps * part(numbers[c]), 0.0, kRampSteps - 1.0) : 0.0);
  return place;
}

std::vector<std::uint32_t> legendPlacesOf(const CellAttributes& attributes, std::uint32_t column,
                                          CellColours& colours) {
  if (attributes.columns()[column].type != AttributeType::text)
    return legendPlacesOf(attributes.numbers(column), colours);
  for (const std::string& value : attributes.dictionary(column))
    colours.legend.push_back({value, colourOfNumber(colours.legend.size())});
  return attributes.codes(column);
}

// Requires the legend of all values, and the place in it of each cell; with an empty legend, cells have their own
// colours.
void colourCells(const TileStore& store, std::vector<std::uint32_t> place, const CellSelection& selection,
                 CellColours& colours) {
  const std::uint32_t cells = store.cell_count();
  colours.unchosen = unchosenOn(selection.theme);
  std::vector<bool> selected(cells, !selection.only);
  if (selection.only)
    for (const std::uint32_t cell : *selection.only) selected[cell] = true;
  if (!colours.attribute.empty()) {
    const auto none = static_cast<std::uint32_t>(colours.legend.size());
    colours.legend.push_back({kWithoutValueText, kWithoutValue});
    for (std::uint32_t c = 0; c < cells; ++c) {
      if (store.cell(c).removed) continue;
      if (place[c] == CellAttributes::kNoCode) place[c] = none;
      if (selected[c]) ++colours.legend[place[c]].cells;
    }
    if (const auto& values = selection.values)
      for (CellColours::Entry& entry : colours.legend)
        entry.chosen = std::find(values->begin(), values->end(), entry.value) != values->end();
  }
  for (std::uint32_t c = 0; c < cells; ++c) {
    const bool in_legend = place[c] != CellAttributes::kNoCode;
    const bool chosen = selected[c] && (!in_legend || colours.legend[place[c]].chosen);
    colours.is_chosen.push_back(chosen);
    colours.of_cell.push_back(!chosen     ? colours.unchosen
                              : in_legend ? colours.legend[place[c]].colour
                                          : colourOfNumber(c));
  }
  std::erase_if(colours.legend, [](const CellColours::Entry& entry) { return entry.cells == 0; });
}

}  // namespace

const std::vector<CellColours::Entry>& legendOfTypes() {
  static const std::vector<CellColours::Entry> kLegend{{"soma", colourOfType(1)},
                                                       {"axon", colourOfType(2)},
                                                       {"basal dendrite", colourOfType(3)},
                                                       {"apical dendrite", colourOfType(4)},
                                                       {"other", colourOfType(0)}};
  return kLegend;
}

std::vector<CellColours::Entry> legendOfDepths(double shallow_um, double deep_um) {
  std::vector<CellColours::Entry> legend;
  for (int s = 0; s <= kRampSteps; ++s) {
    const double part = static_cast<double>(s) / kRampSteps;
    legend.push_back({shortText(std::round(shallow_um + part * (deep_um - shallow_um))), colourOnRamp(part)});
  }
  return legend;
}

const std::vector<CellColours::Entry>& legendOfRadii() {
  static const std::vector<CellColours::Entry> kLegend = [] {
    std::vector<CellColours::Entry> legend;
    for (const double um : {0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0})
      legend.push_back({shortText(um), colourOnRamp(radiusOnRamp(um))});
    return legend;
  }();
  return kLegend;
}

std::shared_ptr<const CellColours> coloursByAttribute(const TileSet& set, const CellAttributes& attributes,
                                                      const std::string& attribute, const CellSelection& selection) {
  auto colours = std::make_shared<CellColours>();
  colours->attribute = attribute;
  std::vector<std::uint32_t> place(set.cell_count(), CellAttributes::kNoCode);
  if (!attribute.empty()) {
    const auto column = attributes.find(attribute);
    if (!column) throw UsageError(unknownAttribute(attribute, attributes));
    place = legendPlacesOf(attributes, *column, *colours);
  }
  colourCells(set, std::move(place), selection, *colours);
  return colours;
}

std::shared_ptr<const CellColours> coloursByNumbers(const TileStore& store, const CellValues& numbers,
                                                    const CellSelection& selection) {
  auto colours = std::make_shared<CellColours>();
  colours->attribute = numbers.name;
  colours->unit = numbers.unit;
  colourCells(store, legendPlacesOf(numbers.of_cell, *colours), selection, *colours);
  return colours;
}

}  // namespace filiform
