// CellChoice: which cells of the open scene are chosen, and which are shown, dimmed or hidden. Thread rule: one owner.
#pragma once

#include "viewer/scene/cell_palette.h"

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace filiform::internal {

class CellChoice {
 public:
  using Cells = std::span<const std::uint32_t>;  // ids below the number of cells

  explicit CellChoice(std::uint32_t cells) : cells_(cells) {}

  // Chosen cells are highlighted, and actions on cells are for them. Ascending.
  const std::vector<std::uint32_t>& chosen() const { return chosen_; }
  bool isChosen(std::uint32_t cell) const;
  void choose(Cells cells);                           // these alone
  void toggle(std::uint32_t cell);                    // in addition to the others
  std::uint32_t lastChosen() const { return last_; }  // UINT32_MAX: no cell

  // nullptr: all cells are shown. The same object until a state changes. O(cells) each.
  const std::shared_ptr<const CellStates>& states() const { return states_; }
  CellState stateOf(std::uint32_t cell) const;
  void show(CellStates states) { keep(std::move(states)); }  // of all cells
  void isolate(Cells cells);                                 // hides all others
  void set(Cells cells, CellState state);
  bool hidesSome() const { return hidden_ > 0; }
  void invert();  // hides what is shown or dimmed, and shows what is hidden
  void showAll();
  // Exactly these cells are not hidden.
  bool isAlone(Cells cells) const;

  std::string text() const;  // "12 of 60 cells shown"; empty: all are
  void describe(nlohmann::ordered_json& state) const;

 private:
  CellStates now() const;
  void keep(CellStates states);

  std::uint32_t cells_, last_ = UINT32_MAX;
  std::vector<std::uint32_t> chosen_;
  std::shared_ptr<const CellStates> states_;
  std::uint32_t hidden_ = 0, dimmed_ = 0;
};

}  // namespace filiform::internal
