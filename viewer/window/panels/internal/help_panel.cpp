#include "viewer/window/panels/internal/help_panel.h"

#include "viewer/window/panels/internal/panel_parts.h"
#include "viewer/window/settings/bindings.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

namespace filiform::internal {

namespace {

// What a binding does, for the help.
std::string doneBy(const Binding& binding) {
  std::string text = binding.what;
  if (binding.held == Held::repeats) text += " (repeats while held)";
  if (binding.held == Held::pushes) text += " (while held)";
  return text;
}

// A table of inputs and what they do. Each column is as wide as its longest line.
struct HelpTable {
  const char* name;
  std::vector<const char*> groups;
  float inputs = 0, done = 0;

  void measure() {
    const auto width = [](const std::string& text) { return ImGui::CalcTextSize(text.c_str()).x + 1; };
    for (const Binding& binding : bindings()) {
      if (!has(binding)) continue;
      inputs = std::max(inputs, width(inputsOf(binding)));
      done = std::max(done, width(doneBy(binding)));
    }
  }
  bool has(const Binding& binding) const {
    return std::any_of(groups.begin(), groups.end(),
                       [&](const char* group) { return std::strcmp(binding.group, group) == 0; });
  }
  // Limits the columns to a width; longer lines wrap.
  void fit(float width) {
    inputs = std::min(inputs, 0.5F * width);
    done = std::min(done, width - inputs);
  }
  void show() const {
    if (!ImGui::BeginTable(name, 2, ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_NoHostExtendX)) return;
    ImGui::TableSetupColumn("inputs", ImGuiTableColumnFlags_WidthFixed, inputs);
    ImGui::TableSetupColumn("done", ImGuiTableColumnFlags_WidthFixed, done);
    for (const char* group : groups) {
      ImGui::TableNextRow();
      ImGui::TableNextColumn();
      writeIn(gold(), group);
      for (const Binding& binding : bindings()) {
        if (std::strcmp(binding.group, group) != 0) continue;
        ImGui::TableNextRow();
        for (const std::string& text : {inputsOf(binding), doneBy(binding)}) {
          ImGui::TableNextColumn();
          ImGui::PushTextWrapPos(0);
          ImGui::TextUnformatted(text.c_str());
          ImGui::PopTextWrapPos();
        }
      }
    }
    ImGui::EndTable();
  }
};

}  // namespace

void drawHelp(const PanelData& d, bool& open) {
  const ImVec2 most = vec(d.size.width * 0.96, d.size.height * 0.94);
  ImGui::SetNextWindowPos(vec(d.size.width / 2.0, d.size.height / 2.0), ImGuiCond_Always, vec(0.5, 0.5));
  ImGui::SetNextWindowSizeConstraints(vec(0, 0), most);
  ImGui::SetNextWindowBgAlpha(1);
  ImGui::Begin("keys and mouse", &open,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoCollapse);
  ImGui::PushStyleVar(ImGuiStyleVar_CellPadding, vec(ImGui::GetStyle().CellPadding.x, 0));
  HelpTable left{"left", {"Hand", "Travel", "Cells"}}, right{"right", {"View", "Window"}};
  left.measure();
  right.measure();
  const ImGuiStyle& style = ImGui::GetStyle();
  const auto gap = static_cast<float>(24 * d.scale);
  const float rim = 4 * style.CellPadding.x;  // of one table
  const float room = most.x - 2 * style.WindowPadding.x - style.ScrollbarSize;
  // Side by side if no line wraps more than once.
  const float beside = room - gap - 2 * rim, natural = left.inputs + left.done + right.inputs + right.done;
  const bool wide = beside >= 0.6F * natural;
  if (wide) {
    const float part = std::min(1.0F, beside / natural);
    left.fit(part * (left.inputs + left.done));
    right.fit(part * (right.inputs + right.done));
  } else {
    left.fit(room - rim);
    right.fit(room - rim);
  }
  left.show();
  if (wide) ImGui::SameLine(0, gap);
  right.show();
  ImGui::PopStyleVar();
  ImGui::End();
}

}  // namespace filiform::internal
