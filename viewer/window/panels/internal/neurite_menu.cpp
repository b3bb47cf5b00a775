#include "viewer/window/panels/internal/neurite_menu.h"

#include "viewer/window/panels/internal/panel_parts.h"

#include <algorithm>
#include <string>
#include <utility>

namespace filiform::internal {

void drawNeuriteMenu(const PanelData& d, NeuriteMenu& menu, PanelRequests& requests) {
  const double room = 230 * d.scale, side = 260 * d.scale;  // with the rim; as high at most
  ImGui::SetNextWindowPos(
      vec(std::max(0.0, std::min(menu.x, d.size.width - side)), std::max(0.0, std::min(menu.y, d.size.height - side))));
  ImGui::SetNextWindowBgAlpha(0.96F);
  ImGui::Begin("neurite", nullptr, kStill);
  showFitted(menu.title, room, d.scale);
  writeIn(dim(), menu.text);
  ImGui::Separator();
  const auto item = [&](const std::string& text) {
    const bool chosen = ImGui::Selectable(text.c_str(), false, 0, vec(room, 0));
    if (chosen) menu.open = false;
    return chosen;
  };
  if (item("go there")) requests.go_to_place = menu.place;
  for (const auto& [text, action] :
       {std::pair{"isolate this cell", Action::isolate_cells}, std::pair{"hide this cell", Action::hide_cells},
        std::pair{"dim this cell", Action::dim_cells}, std::pair{"show all cells", Action::show_cells}})
    if (item(text + ("  (" + inputsOf(bindingOf(action)) + ")"))) {
      requests.act = action;
      requests.act_on = menu.place.segment.cell;
    }
  if (item("copy name and place")) requests.copy = menu.copied;
  ImGui::End();
}

}  // namespace filiform::internal
