#include "viewer/window/panels/internal/cell_panel.h"

#include "index/count_text.h"
#include "viewer/window/panels/internal/cell_choice.h"
#include "viewer/window/panels/internal/cell_table.h"
#include "viewer/window/panels/internal/panel_parts.h"
#include "viewer/window/settings/internal/text_format.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

namespace filiform::internal {
namespace {

constexpr double kNameWidth = 150;  // times the scale

// Returns how many rows down the user asks for with the arrow keys; `entered`: Enter was pressed.
int drawFilter(CellTable& table, CellPanel& panel, bool& entered) {
  if (panel.focus) ImGui::SetKeyboardFocusHere();
  panel.focus = false;
  CellTable::Order order = table.order();
  std::array<char, 256> text{};
  order.filter.copy(text.data(), text.size() - 1);
  entered = ImGui::InputTextWithHint("##filter", "part of a name or attribute", text.data(), text.size(),
                                     ImGuiInputTextFlags_EnterReturnsTrue);
  const auto pressed = [](ImGuiKey key) { return ImGui::IsKeyPressed(ImGui::GetKeyIndex(key)) ? 1 : 0; };
  const int down = ImGui::IsItemActive() ? pressed(ImGuiKey_DownArrow) - pressed(ImGuiKey_UpArrow) : 0;
  if (order.filter != text.data()) {
    order.filter = text.data();
    table.setOrder(order);
  }
  return down;
}

void drawColumnChoice(CellTable& table) {
  if (!ImGui::BeginCombo("##columns", "columns")) return;
  for (std::size_t i = 1; i < table.columns().size(); ++i) {
    const CellTable::Column& column = table.columns()[i];
    ImGui::PushID(static_cast<int>(i));
    bool shown = column.is_shown;
    if (ImGui::Checkbox("##shown", &shown)) table.show(i, shown);
    ImGui::SameLine();
    ImGui::TextUnformatted(column.title.c_str());
    ImGui::PopID();
  }
  ImGui::EndCombo();
}

// What can be done with the chosen cells.
void drawActions(PanelRequests& requests) {
  const std::pair<const char*, Action> actions[] = {{"isolate", Action::isolate_cells},
                                                    {"hide", Action::hide_cells},
                                                    {"dim", Action::dim_cells},
                                                    {"invert", Action::invert_cells},
                                                    {"show all", Action::show_cells}};
  for (const auto& [name, action] : actions) {
    if (ImGui::SmallButton(name)) requests.act = action;
    ImGui::SameLine();
  }
}

void drawState(const PanelData& d, CellTable& table, PanelRequests& requests) {
  std::string counts = counted(table.rows().size(), "cell");
  if (table.rows().size() != table.cells()) counts += " of " + formatCount(table.cells());
  writeIn(dim(), table.isListing() ? counts + ", sorting" : counts);
  ImGui::SameLine();
  drawActions(requests);
  if (const auto part = table.progress())
    ImGui::ProgressBar(static_cast<float>(*part), vec(-1, ImGui::GetTextLineHeight()),
                       format("measuring, %.0f %%", 100 * *part).c_str());
  else if (!table.isMeasured() && ImGui::SmallButton("measure"))
    table.measure();
  else if (table.isMeasured())
    ImGui::NewLine();
  if (table.error().empty()) return;
  ImGui::PushStyleColor(ImGuiCol_Text, red());
  showFitted(table.error(), ImGui::GetContentRegionAvail().x, d.scale);
  ImGui::PopStyleColor();
}

// The rows from the cell that was chosen last to this one.
std::vector<std::uint32_t> rowsBetween(const std::vector<std::uint32_t>& rows, std::uint32_t last, std::uint32_t cell) {
  auto from = std::find(rows.begin(), rows.end(), last), to = std::find(rows.begin(), rows.end(), cell);
  if (from == rows.end() || to == rows.end()) return {cell};
  std::vector<std::uint32_t> between(std::min(from, to), std::max(from, to) + 1);
  if (to < from) std::reverse(between.begin(), between.end());
  return between;
}

// A title: a square of colours, which colours by this column, then the name. A click on the name sorts.
void drawHead(const PanelData& d, CellTable& table, std::size_t column, PanelRequests& requests) {
  const CellTable::Column& c = table.columns()[column];
  ImDrawList& list = *ImGui::GetWindowDrawList();
  const float line = ImGui::GetTextLineHeight();
  if (!c.colouring.empty()) {
    const ImVec2 at = ImGui::GetCursorScreenPos();
    const float side = 0.7F * line, top = at.y + 0.15F * line;
    const bool is_used = d.colours.attribute == c.colouring;
    if (ImGui::InvisibleButton("##colour", vec(side, line))) requests.attribute = is_used ? "" : c.colouring;
    if (ImGui::IsItemHovered()) showWhole(is_used ? "no colours by this" : "colour by this", d.scale);
    constexpr int kBars = 3;
    for (int i = 0; i < kBars; ++i) {
      const Rgba bar = c.is_number ? colourOnRamp(0.5 * i) : colourOfNumber(static_cast<std::uint64_t>(i));
      list.AddRectFilled(vec(at.x + side * i / kBars, top), vec(at.x + side * (i + 1) / kBars, top + side),
                         IM_COL32(bar.r, bar.g, bar.b, 255));
    }
    if (is_used) list.AddRect(vec(at.x - 1, top - 1), vec(at.x + side + 1, top + side + 1), ink());
    ImGui::SameLine();
  }
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float room = ImGui::GetContentRegionAvail().x - 0.6F * line;
  if (ImGui::Selectable("##sort", false, 0, ImVec2(0, line))) {
    CellTable::Order order = table.order();
    // Of numbers, the largest are asked for first.
    order.descending = order.column == column ? !order.descending : c.is_number;
    order.column = column;
    table.setOrder(order);
  }
  const std::string shown = fitted(c.title, room);
  if (shown.size() != c.title.size() && ImGui::IsItemHovered()) showWhole(c.title, d.scale);
  list.AddText(at, ink(), shown.c_str());
  if (table.order().column != column) return;
  const float x = at.x + room, y = at.y + 0.5F * line, up = (table.order().descending ? 1 : -1) * 0.2F * line;
  list.AddTriangleFilled(vec(x, y - up), vec(x + 0.5F * line, y - up), vec(x + 0.25F * line, y + up), gold());
}

void drawRow(const PanelData& d, const CellTable& table, const std::vector<std::size_t>& shown, std::uint32_t cell,
             PanelRequests& requests) {
  ImGui::TableNextRow();
  ImGui::PushID(static_cast<int>(cell));
  for (const std::size_t column : shown) {
    ImGui::TableNextColumn();
    if (column == 0) {
      if (ImGui::Selectable("##cell", d.cells.choice->isChosen(cell),
                            ImGuiSelectableFlags_SpanAllColumns | ImGuiSelectableFlags_AllowDoubleClick)) {
        if (ImGui::GetIO().KeyCtrl)
          requests.toggle_cell = cell;
        else if (ImGui::GetIO().KeyShift)
          requests.choose_cells = rowsBetween(table.rows(), d.cells.choice->lastChosen(), cell);
        else
          requests.choose_cells = {{cell}};
        if (ImGui::IsMouseDoubleClicked(0)) requests.go_to_cell = cell;
      }
      ImGui::SameLine(0, 0);
    }
    const std::string text = table.text(cell, column);
    const float room = ImGui::GetContentRegionAvail().x;
    if (table.columns()[column].is_number)
      ImGui::SetCursorPosX(ImGui::GetCursorPosX() + std::max(0.0F, room - ImGui::CalcTextSize(text.c_str()).x));
    showFitted(text, room, d.scale);
  }
  ImGui::PopID();
}

// `step`: chooses the cell so many rows below the chosen one.
void drawTable(const PanelData& d, CellPanel& panel, int step, PanelRequests& requests) {
  CellTable& table = *d.cells.table;
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < table.columns().size() && shown.size() < 32; ++i)  // Dear ImGui has at most 64
    if (table.columns()[i].is_shown) shown.push_back(i);
  // Another number of columns is another table to Dear ImGui.
  ImGui::PushID(static_cast<int>(shown.size()));
  if (ImGui::BeginTable("cells", static_cast<int>(shown.size()),
                        ImGuiTableFlags_ScrollX | ImGuiTableFlags_ScrollY | ImGuiTableFlags_Resizable |
                            ImGuiTableFlags_RowBg | ImGuiTableFlags_BordersInnerV | ImGuiTableFlags_NoSavedSettings |
                            ImGuiTableFlags_SizingFixedFit)) {
    for (const std::size_t column : shown)
      // A title has a square before it and an arrow behind it.
      ImGui::TableSetupColumn(
          "", ImGuiTableColumnFlags_WidthFixed,
          column == 0 ? static_cast<float>(kNameWidth * d.scale)
                      : ImGui::CalcTextSize(table.columns()[column].title.c_str()).x + 2 * ImGui::GetTextLineHeight());
    ImGui::TableSetupScrollFreeze(1, 1);
    ImGui::TableNextRow(ImGuiTableRowFlags_Headers);
    for (const std::size_t column : shown) {
      ImGui::TableNextColumn();
      ImGui::PushID(static_cast<int>(column));
      drawHead(d, table, column, requests);
      ImGui::PopID();
    }
    const std::vector<std::uint32_t>& rows = table.rows();
    const float line = ImGui::GetTextLineHeight() + 2 * ImGui::GetStyle().CellPadding.y;
    if (step != 0 && !rows.empty()) {
      const auto at = std::find(rows.begin(), rows.end(), d.cells.choice->lastChosen());
      const auto row =
          at == rows.end() ? 0 : std::clamp<std::ptrdiff_t>(at - rows.begin() + step, 0, std::ssize(rows) - 1);
      requests.choose_cells = {{rows[static_cast<std::size_t>(row)]}};
      ImGui::SetScrollY(line * static_cast<float>(row) - 0.4F * ImGui::GetWindowHeight());
    }
    ImGuiListClipper clipper;
    clipper.Begin(static_cast<int>(rows.size()), line);
    panel.seen.clear();
    while (clipper.Step())
      for (int row = clipper.DisplayStart; row < clipper.DisplayEnd; ++row) {
        panel.seen.push_back(rows[static_cast<std::size_t>(row)]);
        drawRow(d, table, shown, panel.seen.back(), requests);
      }
    ImGui::EndTable();
  }
  ImGui::PopID();
}

}  // namespace

void drawCells(const PanelData& d, CellPanel& panel, PanelRequests& requests) {
  CellTable& table = *d.cells.table;
  const double width = std::min(460 * d.scale, d.size.width - 20 * d.scale);
  ImGui::SetNextWindowPos(vec(10 * d.scale, std::min(180 * d.scale, 0.25 * d.size.height)), ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize(vec(width, std::min(380 * d.scale, 0.7 * d.size.height)), ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSizeConstraints(vec(160 * d.scale, 120 * d.scale), vec(d.size.width, 0.9 * d.size.height));
  ImGui::SetNextWindowBgAlpha(0.94F);
  if (ImGui::Begin("cells", &panel.open, ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoCollapse)) {
    bool entered = false;
    const float columns = ImGui::CalcTextSize("columns").x + 2.5F * ImGui::GetFrameHeight();
    ImGui::SetNextItemWidth(std::max(40.0F, ImGui::GetContentRegionAvail().x - columns));
    const int step = drawFilter(table, panel, entered);
    ImGui::SameLine();
    ImGui::SetNextItemWidth(-1);
    drawColumnChoice(table);
    drawState(d, table, requests);
    drawTable(d, panel, step, requests);
    const std::vector<std::uint32_t>& rows = table.rows();
    if (entered && !rows.empty() && !table.isListing()) {
      const std::uint32_t last = d.cells.choice->lastChosen();
      requests.go_to_cell = std::find(rows.begin(), rows.end(), last) != rows.end() ? last : rows.front();
      requests.choose_cells = {{*requests.go_to_cell}};
    }
  }
  ImGui::End();
}

}  // namespace filiform::internal
