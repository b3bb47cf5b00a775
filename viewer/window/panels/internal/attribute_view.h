// AttributeView: colours and selects the cells of the open scene by their attributes, and colours them by measures.
// Thread rule: the window's thread.
#pragma once

#include "index/attributes/cell_attributes.h"
#include "viewer/scene/cell_colours.h"
#include "viewer/window/panels/panel_data.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace filiform::internal {

class AttributeView {
 public:
  // `store` must outlive this object. Only tile sets have attributes.
  // `table`: colours until others are asked for; nullptr: none.
  explicit AttributeView(const TileStore& store, std::shared_ptr<const CellColours> table = nullptr);

  bool hasAttributes() const { return attributes_ != nullptr && !attributes_->empty(); }
  // nullptr: the scene is no tile set.
  const std::shared_ptr<const CellAttributes>& attributes() const { return attributes_; }
  // nullptr: colours follow the settings.
  const std::shared_ptr<const CellColours>& colours() const { return colours_; }
  bool hasTable() const { return table_ != nullptr; }
  const std::string& attribute() const { return attribute_; }  // empty: none

  // These throw UsageError, CorruptSet and IoError, and then change nothing. Each reads the columns that it needs.
  //
  // Colours by this attribute; empty: as the settings say. The values of the former legend are selected again.
  void colourBy(const std::string& attribute);
  void colourBy(CellValues numbers);
  // The attribute after the current one, or none after the last. False: none. Ends the colours of a table.
  bool next();
  // Selects only the cells that meet a condition of CellFilter. Returns how many these are.
  std::size_t select(const std::string& condition);
  // Selects this value of the legend alone, or adds or removes it if others are selected already. `alone`: alone.
  void toggle(const std::string& value, bool alone);
  void selectAll();
  std::vector<std::uint32_t> selected() const;  // the cells that have colours of their own, ascending

  // Cells that are not selected recede on this theme's ground. Throws as the above.
  void setTheme(Theme theme);

  // True if the text has the form of a condition, so that the search box passes it to select().
  bool isCondition(const std::string& text) const;

  void fill(PanelData& data) const;
  void describe(nlohmann::ordered_json& state) const;

 private:
  void make();

  const TileStore& store_;
  const TileSet* set_;
  std::shared_ptr<const CellAttributes> attributes_;
  std::string attribute_, condition_;
  std::shared_ptr<const CellColours> table_;
  std::optional<CellValues> numbers_;  // instead of an attribute
  CellSelection selection_;
  std::shared_ptr<const CellColours> colours_;
};

}  // namespace filiform::internal
