#include "viewer/window/panels/internal/bookmark_panel.h"

#include "viewer/window/panels/internal/panel_parts.h"
#include "viewer/window/settings/internal/text_format.h"

#include <algorithm>
#include <array>

namespace filiform::internal {
namespace {

void drawNewName(BookmarkPanel& panel, PanelRequests& requests) {
  if (panel.focus) ImGui::SetKeyboardFocusHere();
  panel.focus = false;
  std::array<char, 128> text{};
  panel.name.copy(text.data(), text.size() - 1);
  const float button = ImGui::CalcTextSize("set here").x + 2 * ImGui::GetStyle().FramePadding.x;
  ImGui::SetNextItemWidth(std::max(40.0F, ImGui::GetContentRegionAvail().x - button - ImGui::GetStyle().ItemSpacing.x));
  const bool entered = ImGui::InputTextWithHint("##name", "name of this place", text.data(), text.size(),
                                                ImGuiInputTextFlags_EnterReturnsTrue);
  panel.name = text.data();
  ImGui::SameLine();
  if ((!ImGui::Button("set here") && !entered) || panel.name.empty()) return;
  requests.bookmarks.set = panel.name;
  panel.name.clear();
  panel.focus = true;  // for the next name
}

void drawBookmarkList(const PanelData& d, PanelRequests& requests) {
  if (!ImGui::BeginTable("bookmarks", 3,
                         ImGuiTableFlags_ScrollY | ImGuiTableFlags_RowBg | ImGuiTableFlags_NoSavedSettings, vec(0, 0)))
    return;
  ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthStretch);
  ImGui::TableSetupColumn("\u00b5m", ImGuiTableColumnFlags_WidthFixed, static_cast<float>(150 * d.scale));
  ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, static_cast<float>(48 * d.scale));
  ImGuiListClipper clipper;
  clipper.Begin(static_cast<int>(d.map.bookmark_names.size()));
  while (clipper.Step())
    for (int row = clipper.DisplayStart; row < clipper.DisplayEnd; ++row) {
      const std::string& name = d.map.bookmark_names[static_cast<std::size_t>(row)];
      const Vector3d& p = d.map.bookmarks_W[static_cast<std::size_t>(row)];
      ImGui::PushID(row);
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      if (ImGui::Selectable("##go", false)) requests.bookmarks.go = name;
      ImGui::SameLine(0, 0);
      showFitted(name, ImGui::GetContentRegionAvail().x, d.scale);
      ImGui::TableNextColumn();
      writeIn(dim(), format("%.1f %.1f %.1f", p.x(), p.y(), p.z()));
      ImGui::TableNextColumn();
      if (ImGui::SmallButton("delete")) requests.bookmarks.remove = name;
      ImGui::PopID();
    }
  ImGui::EndTable();
}

}  // namespace

void drawBookmarks(const PanelData& d, BookmarkPanel& panel, PanelRequests& requests) {
  const double width = std::min(380 * d.scale, d.size.width - 20 * d.scale);
  ImGui::SetNextWindowPos(vec(d.size.width - 10 * d.scale, 0.3 * d.size.height), ImGuiCond_FirstUseEver, vec(1, 0));
  ImGui::SetNextWindowSize(vec(width, std::min(280 * d.scale, 0.6 * d.size.height)), ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowBgAlpha(0.94F);
  if (ImGui::Begin("bookmarks", &panel.open, ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoCollapse)) {
    drawNewName(panel, requests);
    BookmarkRequests& asked = requests.bookmarks;
    if (ImGui::SmallButton("undo")) asked.undo = true;
    ImGui::SameLine();
    if (ImGui::SmallButton("copy as CSV")) asked.copy = true;
    ImGui::SameLine();
    if (ImGui::SmallButton("paste CSV"))
      if (const char* const text = ImGui::GetClipboardText()) asked.paste = text;
    if (panel.can_save) {
      ImGui::SameLine();
      if (ImGui::SmallButton("save CSV")) asked.save = true;
    }
    writeIn(dim(), "click: go there; a CSV file dropped on the window is read");
    drawBookmarkList(d, requests);
  }
  ImGui::End();
}

}  // namespace filiform::internal
