#include "viewer/window/panels/internal/command_panel.h"

#include "index/text.h"
#include "viewer/window/panels/internal/panel_parts.h"

#include <algorithm>
#include <array>
#include <sstream>

namespace filiform::internal {

std::vector<const Binding*> commandsFor(const std::string& text) {
  std::vector<const Binding*> found;
  for (const Binding& binding : bindings()) {
    if (binding.first.code == Key::kNone || binding.held == Held::pushes || binding.action == Action::commands)
      continue;
    std::string words = " " + lowerCase(std::string(binding.group) + " " + binding.name + " " + binding.what);
    std::replace(words.begin(), words.end(), '-', ' ');
    std::string asked = lowerCase(text);
    std::replace(asked.begin(), asked.end(), '-', ' ');
    std::istringstream wanted(asked);
    bool has = true;
    for (std::string word; has && wanted >> word;) has = words.find(" " + word) != std::string::npos;
    if (has) found.push_back(&binding);
  }
  return found;
}

void drawCommands(const PanelData& d, CommandPanel& panel, PanelRequests& requests) {
  const double width = std::min(620 * d.scale, d.size.width * 0.9);
  ImGui::SetNextWindowPos(vec(d.size.width / 2.0, d.size.height * 0.12), ImGuiCond_Always, vec(0.5, 0));
  ImGui::SetNextWindowSize(vec(width, d.size.height * 0.6));
  ImGui::SetNextWindowBgAlpha(0.96F);
  ImGui::Begin("commands", &panel.open,
               ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoResize);
  if (panel.focus) ImGui::SetKeyboardFocusHere();
  panel.focus = false;
  std::array<char, 256> text{};
  panel.text.copy(text.data(), text.size() - 1);
  ImGui::SetNextItemWidth(-1);
  const bool entered = ImGui::InputTextWithHint("##command", "what to do", text.data(), text.size(),
                                                ImGuiInputTextFlags_EnterReturnsTrue);
  if (panel.text != text.data()) panel.text = text.data(), panel.at = 0;
  const std::vector<const Binding*> commands = commandsFor(panel.text);
  const auto pressed = [](ImGuiKey key) { return ImGui::IsKeyPressed(ImGui::GetKeyIndex(key)) ? 1 : 0; };
  const int step = ImGui::IsItemActive() ? pressed(ImGuiKey_DownArrow) - pressed(ImGuiKey_UpArrow) : 0;
  panel.at = std::clamp(panel.at + step, 0, std::max(0, static_cast<int>(commands.size()) - 1));
  const auto act = [&](const Binding& binding) {
    requests.act = binding.action;
    panel.open = false;
  };
  if (entered && !commands.empty()) act(*commands[static_cast<std::size_t>(panel.at)]);
  if (commands.empty()) writeIn(dim(), "no command has these words");
  ImGui::BeginChild("list");
  for (int i = 0; i < static_cast<int>(commands.size()); ++i) {
    const Binding& binding = *commands[static_cast<std::size_t>(i)];
    ImGui::PushID(i);
    if (ImGui::Selectable("##command", i == panel.at)) act(binding);
    if (step != 0 && i == panel.at) ImGui::SetScrollHereY();
    ImGui::SameLine(0, 0);
    const std::string keys = inputsOf(binding);
    const float room = ImGui::GetContentRegionAvail().x, wide = ImGui::CalcTextSize(keys.c_str()).x;
    showFitted(binding.what, room - wide - 12 * d.scale, d.scale);
    ImGui::SameLine(ImGui::GetWindowContentRegionMax().x - wide);
    writeIn(dim(), keys);
    ImGui::PopID();
  }
  ImGui::EndChild();
  ImGui::End();
}

}  // namespace filiform::internal
