#include "viewer/window/panels/internal/attribute_panel.h"

#include "index/count_text.h"
#include "viewer/window/panels/internal/panel_parts.h"
#include "viewer/window/settings/internal/text_format.h"

#include <algorithm>

namespace filiform::internal {

void drawAttributes(const PanelData& d, PanelRequests& requests) {
  const bool has_attributes = !d.colours.attributes.empty();
  if ((!has_attributes && d.colours.legend == nullptr) || d.size.width < 480 * d.scale || d.size.height < 300 * d.scale)
    return;
  const double width = 220 * d.scale;
  const double top = d.force.shown ? std::max(d.size.height * 0.22, 145 * d.scale) : 10 * d.scale;
  ImGui::SetNextWindowPos(vec(d.size.width - 10 * d.scale, top), ImGuiCond_Always, vec(1, 0));
  ImGui::SetNextWindowSizeConstraints(vec(width, 0), vec(width, d.size.height * 0.5));
  ImGui::SetNextWindowBgAlpha(kPanelAlpha);
  ImGui::Begin("attributes", nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize |
                   ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav);
  if (has_attributes)
    writeIn(dim(), "colour by attribute");
  else
    showFitted("coloured by " + (d.colours.attribute.empty() ? d.colours.kind : d.colours.attribute), width, d.scale);
  ImGui::SetNextItemWidth(-1);
  const std::string current =
      d.colours.attribute.empty() ? "(none)" : fitted(d.colours.attribute, static_cast<float>(width * 0.8));
  if (has_attributes && ImGui::BeginCombo("##attribute", current.c_str())) {
    if (ImGui::Selectable("(none)", d.colours.attribute.empty())) requests.attribute = "";
    for (std::size_t i = 0; i < d.colours.attributes.size(); ++i) {
      ImGui::PushID(static_cast<int>(i));
      const ImVec2 at = ImGui::GetCursorScreenPos();
      if (ImGui::Selectable("##name", d.colours.attributes[i] == d.colours.attribute))
        requests.attribute = d.colours.attributes[i];
      ImGui::GetWindowDrawList()->AddText(at, ImGui::GetColorU32(ImGuiCol_Text), d.colours.attributes[i].c_str());
      ImGui::PopID();
    }
    ImGui::EndCombo();
  }
  if (!d.colours.unit.empty()) writeIn(dim(), "in " + unitText(d.colours.unit));
  if (!d.colours.selection.empty()) showFitted(d.colours.selection, width, d.scale);
  if (d.colours.selected && ImGui::SmallButton("show all")) requests.select_all = true;
  if (d.colours.legend != nullptr) {
    const float line = ImGui::GetTextLineHeight();
    for (std::size_t i = 0; i < d.colours.legend->size(); ++i) {
      const CellColours::Entry& entry = (*d.colours.legend)[i];
      ImGui::PushID(static_cast<int>(1000 + i));
      const ImVec2 at = ImGui::GetCursorScreenPos();
      const bool acts = !d.colours.attribute.empty() || d.colours.kind == toString(ColourBy::type);
      if (ImGui::Selectable("##value", acts && d.colours.selected && entry.chosen, 0, ImVec2(0, line)) && acts) {
        requests.value = entry.value;
        requests.value_alone = !ImGui::GetIO().KeyCtrl;
      }
      ImDrawList& list = *ImGui::GetWindowDrawList();
      const Rgba c = entry.chosen ? entry.colour : d.colours.unchosen;
      list.AddRectFilled(vec(at.x, at.y + 0.15 * line), vec(at.x + 0.8 * line, at.y + 0.85 * line),
                         IM_COL32(c.r, c.g, c.b, 255));
      const std::string count = entry.cells > 0 ? formatCount(entry.cells) : std::string();
      const float count_width = ImGui::CalcTextSize(count.c_str()).x;
      const auto right = static_cast<float>(at.x + ImGui::GetContentRegionAvail().x);
      list.AddText(vec(at.x + 1.1 * line, at.y), entry.chosen ? ink() : dim(),
                   fitted(entry.value, right - at.x - 1.4F * line - count_width).c_str());
      list.AddText(vec(right - count_width, at.y), dim(), count.c_str());
      ImGui::PopID();
    }
  }
  ImGui::End();
}

}  // namespace filiform::internal
