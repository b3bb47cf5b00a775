#include "viewer/window/panels/internal/cell_choice.h"

#include "index/count_text.h"

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

namespace filiform::internal {

bool CellChoice::isChosen(std::uint32_t cell) const { return std::binary_search(chosen_.begin(), chosen_.end(), cell); }

void CellChoice::choose(Cells cells) {
  last_ = cells.empty() ? UINT32_MAX : cells.back();
  chosen_.assign(cells.begin(), cells.end());
  std::sort(chosen_.begin(), chosen_.end());
  chosen_.erase(std::unique(chosen_.begin(), chosen_.end()), chosen_.end());
}

void CellChoice::toggle(std::uint32_t cell) {
  const auto at = std::lower_bound(chosen_.begin(), chosen_.end(), cell);
  if (at == chosen_.end() || *at != cell)
    chosen_.insert(at, cell);
  else
    chosen_.erase(at);
  last_ = chosen_.empty() ? UINT32_MAX : cell;
}

CellState CellChoice::stateOf(std::uint32_t cell) const {
  return states_ != nullptr && cell < states_->size() ? (*states_)[cell] : CellState::shown;
}

CellStates CellChoice::now() const { return states_ != nullptr ? *states_ : CellStates(cells_, CellState::shown); }

void CellChoice::keep(CellStates states) {
  hidden_ = static_cast<std::uint32_t>(std::count(states.begin(), states.end(), CellState::hidden));
  dimmed_ = static_cast<std::uint32_t>(std::count(states.begin(), states.end(), CellState::dimmed));
  if (hidden_ + dimmed_ == 0)
    states_.reset();
  else
    states_ = std::make_shared<const CellStates>(std::move(states));
}

void CellChoice::isolate(Cells cells) {
  CellStates states(cells_, CellState::hidden);
  for (const std::uint32_t cell : cells) states.at(cell) = CellState::shown;
  keep(std::move(states));
}

void CellChoice::set(Cells cells, CellState state) {
  CellStates states = now();
  for (const std::uint32_t cell : cells) states.at(cell) = state;
  keep(std::move(states));
}

void CellChoice::invert() {
  CellStates states = now();
  for (CellState& state : states) state = state == CellState::hidden ? CellState::shown : CellState::hidden;
  keep(std::move(states));
}

void CellChoice::showAll() { keep({}); }

bool CellChoice::isAlone(Cells cells) const {
  return hidden_ > 0 && cells_ - hidden_ == cells.size() &&
         std::none_of(cells.begin(), cells.end(), [this](auto cell) { return stateOf(cell) == CellState::hidden; });
}

std::string CellChoice::text() const {
  if (states_ == nullptr) return {};
  std::string text = formatCount(cells_ - hidden_ - dimmed_) + " of " + counted(cells_, "cell") + " shown";
  if (dimmed_ > 0) text += ", " + formatCount(dimmed_) + " dimmed";
  return text;
}

void CellChoice::describe(nlohmann::ordered_json& json) const {
  if (last_ != UINT32_MAX) json["chosen_cell"] = last_;
  json["chosen_cells"] = chosen_;
  json["hidden_cells"] = hidden_;
  json["dimmed_cells"] = dimmed_;
}

}  // namespace filiform::internal
