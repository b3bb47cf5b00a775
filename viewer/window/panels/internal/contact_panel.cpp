#include "viewer/window/panels/internal/contact_panel.h"

#include "index/count_text.h"
#include "index/measure/cell_measures.h"
#include "viewer/window/panels/internal/contact_view.h"
#include "viewer/window/panels/internal/panel_parts.h"
#include "viewer/window/settings/internal/text_format.h"

#include <algorithm>

namespace filiform::internal {
namespace {

void drawFinding(const PanelData& d, ContactPanel& panel, PanelRequests& requests) {
  const ContactView& view = *d.contacts;
  auto within = static_cast<float>(panel.within_um);
  ImGui::SetNextItemWidth(static_cast<float>(64 * d.scale));
  const bool entered = ImGui::InputFloat("\u00b5m", &within, 0, 0, "%.3g", ImGuiInputTextFlags_EnterReturnsTrue);
  if (within > 0 && within < 1e6F) panel.within_um = static_cast<double>(within);
  ImGui::SameLine();
  requests.find_contacts |= ImGui::Button("find") || entered;
  ImGui::SameLine();
  if (const auto part = view.progress()) {
    ImGui::ProgressBar(static_cast<float>(*part), vec(-1, 0));
  } else if (view.error().empty() && view.cell()) {
    std::string text = counted(view.sites().size(), "contact");
    if (view.sites().size() > ContactView::kMostMarks) text += ", " + formatCount(ContactView::kMostMarks) + " drawn";
    writeIn(dim(), text);
  }
  ImGui::PushStyleColor(ImGuiCol_Text, red());
  if (!view.error().empty()) showFitted(view.error(), ImGui::GetContentRegionAvail().x, d.scale);
  ImGui::PopStyleColor();
}

void drawList(const PanelData& d, ContactPanel& panel, PanelRequests& requests) {
  const std::vector<ContactView::Site>& sites = d.contacts->sites();
  if (!ImGui::BeginTable("sites", 3,
                         ImGuiTableFlags_ScrollY | ImGuiTableFlags_RowBg | ImGuiTableFlags_NoSavedSettings |
                             ImGuiTableFlags_Resizable))
    return;
  ImGui::TableSetupColumn("with", ImGuiTableColumnFlags_WidthStretch);
  for (const char* title : {"\u00b5m", "from, to"})
    ImGui::TableSetupColumn(title, ImGuiTableColumnFlags_WidthFixed,
                            static_cast<float>((*title == 'f' ? 96 : 48) * d.scale));
  ImGui::TableSetupScrollFreeze(0, 1);
  ImGui::TableHeadersRow();
  ImGuiListClipper clipper;
  clipper.Begin(static_cast<int>(sites.size()), ImGui::GetTextLineHeight() + 2 * ImGui::GetStyle().CellPadding.y);
  panel.seen.clear();
  while (clipper.Step())
    for (int row = clipper.DisplayStart; row < clipper.DisplayEnd; ++row) {
      const ContactView::Site& site = sites[static_cast<std::size_t>(row)];
      panel.seen.push_back(site.other.cell);
      ImGui::PushID(row);
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      if (ImGui::Selectable("##site", false, ImGuiSelectableFlags_SpanAllColumns))
        requests.jump_across = static_cast<std::size_t>(row);
      ImGui::SameLine(0, 0);
      showFitted(d.contacts->nameOf(site.other.cell), ImGui::GetContentRegionAvail().x, d.scale);
      ImGui::TableNextColumn();
      ImGui::TextUnformatted(format("%.3g", site.distance_um).c_str());
      ImGui::TableNextColumn();
      showFitted(neuriteTypeName(site.own.type) + ", " + neuriteTypeName(site.other.type),
                 ImGui::GetContentRegionAvail().x, d.scale);
      ImGui::PopID();
    }
  ImGui::EndTable();
}

}  // namespace

void drawContacts(const PanelData& d, ContactPanel& panel, PanelRequests& requests) {
  const double width = std::min(300 * d.scale, d.size.width - 20 * d.scale);
  ImGui::SetNextWindowPos(vec(d.size.width - 10 * d.scale, d.size.height - 60 * d.scale), ImGuiCond_FirstUseEver,
                          vec(1, 1));
  ImGui::SetNextWindowSize(vec(width, std::min(300 * d.scale, 0.6 * d.size.height)), ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowBgAlpha(0.94F);
  if (ImGui::Begin("contacts", &panel.open, ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoCollapse)) {
    if (const auto cell = d.contacts->cell())
      showFitted("of " + d.contacts->nameOf(*cell), ImGui::GetContentRegionAvail().x, d.scale);
    drawFinding(d, panel, requests);
    writeIn(dim(), "click: jump across");
    drawList(d, panel, requests);
  }
  ImGui::End();
}

}  // namespace filiform::internal
