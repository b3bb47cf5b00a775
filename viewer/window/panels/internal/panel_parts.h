// What the panels share: colours, texts of numbers, texts that fit. Thread rule: the window's thread, between
// Window::beginPanels() and endPanels().
#pragma once

#include <cstdint>
#include <imgui.h>
#include <string>

namespace filiform::internal {

// With more transparency, text is lost over dense tissue.
inline constexpr float kPanelAlpha = 0.88F;

inline constexpr ImU32 kInk = IM_COL32(225, 230, 240, 255), kDim = IM_COL32(150, 158, 172, 255),
                       kGold = IM_COL32(235, 200, 90, 255), kRed = IM_COL32(240, 110, 95, 255),
                       kViolet = IM_COL32(215, 140, 255, 255);

// A panel without title that stays where it is.
inline constexpr ImGuiWindowFlags kStill = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                           ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize |
                                           ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;

inline ImVec2 vec(double x, double y) { return {static_cast<float>(x), static_cast<float>(y)}; }

std::string bytesText(double n);    // "1.5 MiB"
std::string lengthText(double um);  // "300 um", "2 mm"

// Writes over the picture, with a dark rim that makes the text readable on any background.
void write(ImDrawList& list, const ImVec2& at, ImU32 colour, const std::string& text);

// The beginning of a text that fits the width (pixels), with an ellipsis if it is cut.
std::string fitted(const std::string& text, float width);
// Shows a text in a tooltip, wrapped.
void showWhole(const std::string& text, double scale);
// Shows the part of a text that fits the width, and the whole text in a tooltip while the pointer is on it.
void showFitted(const std::string& text, double width, double scale);

}  // namespace filiform::internal
