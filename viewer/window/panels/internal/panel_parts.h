// What the panels share: colours, texts of numbers, texts that fit. Thread rule: the window's thread, between
// Window::beginPanels() and endPanels().
#pragma once

#include <cstdint>
#include <imgui.h>
#include <string>

namespace filiform::internal {

// With more transparency, text is lost over dense tissue.
inline constexpr float kPanelAlpha = 0.88F;

// Colours of texts and marks, by the style's theme.
inline bool isLight() { return ImGui::GetStyle().Colors[ImGuiCol_WindowBg].x > 0.5F; }
inline ImU32 ink() { return isLight() ? IM_COL32(25, 30, 40, 255) : IM_COL32(225, 230, 240, 255); }
inline ImU32 dim() { return isLight() ? IM_COL32(95, 102, 116, 255) : IM_COL32(150, 158, 172, 255); }
inline ImU32 gold() { return isLight() ? IM_COL32(150, 105, 0, 255) : IM_COL32(235, 200, 90, 255); }
inline ImU32 red() { return isLight() ? IM_COL32(190, 40, 30, 255) : IM_COL32(240, 110, 95, 255); }
inline ImU32 violet() { return isLight() ? IM_COL32(130, 50, 180, 255) : IM_COL32(215, 140, 255, 255); }
// Behind texts over the picture.
inline ImU32 ground(int opacity) {
  return isLight() ? IM_COL32(250, 250, 250, opacity) : IM_COL32(13, 15, 20, opacity);
}
inline void writeIn(ImU32 colour, const std::string& text) {
  ImGui::PushStyleColor(ImGuiCol_Text, colour);
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopStyleColor();
}

// A panel without title that stays where it is.
inline constexpr ImGuiWindowFlags kStill = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                           ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize |
                                           ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;

inline ImVec2 vec(double x, double y) { return {static_cast<float>(x), static_cast<float>(y)}; }

std::string bytesText(double n);    // "1.5 MiB"
std::string lengthText(double um);  // "300 um" with a Greek letter, "2 mm"

// Writes over the picture, with a rim that makes the text readable on any background.
void write(ImDrawList& list, const ImVec2& at, ImU32 colour, const std::string& text);

// The beginning of a text that fits the width (pixels), with an ellipsis if it is cut.
std::string fitted(const std::string& text, float width);
// Shows a text in a tooltip, wrapped.
void showWhole(const std::string& text, double scale);
// Shows the part of a text that fits the width, and the whole text in a tooltip while the pointer is on it.
void showFitted(const std::string& text, double width, double scale);

}  // namespace filiform::internal
