#include "viewer/window/internal/wanted_texts.h"

#include "viewer/window/internal/open_scene.h"
#include "viewer/window/internal/window_actions.h"
#include "viewer/window/window.h"

#include <initializer_list>
#include <string>
#include <vector>

namespace filiform::internal {

void wantTexts(Window& window, const PanelData& data, const OpenScene& scene, const WindowActions& actions) {
  using Text = const std::string*;
  for (const Text text : std::initializer_list<Text>{
           &data.status.scene, &data.status.cell, &data.status.device, &data.lines.hint, &data.tooltip.text,
           &data.colours.selection, &actions.search.text, &actions.search.error, &actions.panels.menu.title})
    window.want(*text);
  using Texts = const std::vector<std::string>*;
  for (const Texts texts :
       std::initializer_list<Texts>{&data.lines.messages, &data.colours.attributes, &data.map.bookmark_names,
                                    &actions.search.names, &scene.tiles().failures})
    for (const std::string& text : *texts) window.want(text);
  if (data.colours.legend != nullptr)
    for (const CellColours::Entry& entry : *data.colours.legend) window.want(entry.value);
  if (actions.panels.contacts.open)
    for (const std::uint32_t cell : actions.panels.contacts.seen) window.want(scene.contacts().nameOf(cell));
  if (!actions.panels.cells.open) return;
  const CellTable& cells = scene.cells();
  for (std::size_t column = 0; column < cells.columns().size(); ++column) {
    if (!cells.columns()[column].is_shown) continue;
    window.want(cells.columns()[column].title);
    if (!cells.columns()[column].is_number)
      for (const std::uint32_t cell : actions.panels.cells.seen) window.want(cells.text(cell, column));
  }
}

}  // namespace filiform::internal
