#include "viewer/window/panels/internal/panel_parts.h"

#include "viewer/window/settings/internal/text_format.h"

#include <cstddef>
#include <utility>

namespace filiform::internal {

std::string bytesText(double n) {
  if (n < 1024) return format("%.0f B", n);
  if (n < 1024.0 * 1024) return format("%.1f KiB", n / 1024);
  if (n < 1024.0 * 1024 * 1024) return format("%.1f MiB", n / 1024 / 1024);
  return format("%.1f GiB", n / 1024 / 1024 / 1024);
}

std::string lengthText(double um) {
  if (um >= 1000) return format("%.3g mm", um / 1000);
  if (um >= 0.1) return format("%.4g \u00b5m", um);
  return format("%.3g nm", um * 1000);
}

void write(ImDrawList& list, const ImVec2& at, ImU32 colour, const std::string& text) {
  const ImU32 shade = ground(200);
  for (const auto& [dx, dy] : {std::pair{1, 0}, std::pair{-1, 0}, std::pair{0, 1}, std::pair{0, -1}})
    list.AddText(vec(at.x + static_cast<float>(dx), at.y + static_cast<float>(dy)), shade, text.c_str());
  list.AddText(at, colour, text.c_str());
}

std::string fitted(const std::string& text, float width) {
  if (ImGui::CalcTextSize(text.c_str()).x <= width) return text;
  const std::string sign = ImGui::GetFont()->FindGlyphNoFallback(0x2026) != nullptr ? "\u2026" : "...";
  std::size_t fits = 0, beyond = text.size();  // bytes
  while (beyond - fits > 1) {
    const std::size_t middle = (fits + beyond) / 2;
    if (ImGui::CalcTextSize((text.substr(0, middle) + sign).c_str()).x <= width)
      fits = middle;
    else
      beyond = middle;
  }
  while (fits > 0 && (static_cast<unsigned char>(text[fits]) & 0xC0U) == 0x80U) --fits;  // keep whole UTF-8 characters
  return text.substr(0, fits) + sign;
}

void showWhole(const std::string& text, double scale) {
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(static_cast<float>(600 * scale));
  ImGui::TextUnformatted(text.c_str());
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
}

void showFitted(const std::string& text, double width, double scale) {
  const std::string shown = fitted(text, static_cast<float>(width));
  ImGui::TextUnformatted(shown.c_str());
  if (shown.size() == text.size()) return;
  // ImGui::IsItemHovered() is false in panels without input.
  const ImVec2 lo = ImGui::GetItemRectMin(), hi = ImGui::GetItemRectMax(), at = ImGui::GetIO().MousePos;
  if (at.x >= lo.x && at.x < hi.x && at.y >= lo.y && at.y < hi.y) showWhole(text, scale);
}

}  // namespace filiform::internal
