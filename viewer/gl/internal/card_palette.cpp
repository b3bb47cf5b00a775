#include "viewer/gl/internal/card_palette.h"

#include <algorithm>
#include <cstddef>
#include <vector>

namespace filiform::internal {

namespace {

// As paint.glsl has it.
constexpr std::size_t kWidth = 2048, kRowsBefore = 2;
constexpr int kUnit = 4;  // of textures: the renderer uses those before it

}  // namespace

void CardPalette::put(const CellPalette& palette) {
  GLint largest = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &largest);
  // Without cells: those of a small scene in their own colours.
  const std::size_t wanted = palette.of_cell.empty() ? kWidth : palette.of_cell.size(),
                    most = (static_cast<std::size_t>(largest) - kRowsBefore) * kWidth, cells = std::min(wanted, most);
  const std::size_t rows = kRowsBefore + (cells + kWidth - 1) / kWidth;
  std::vector<Rgba> texels(rows * kWidth);
  for (std::size_t i = 0; i < kWidth; ++i) texels[i] = colourOnRamp(static_cast<double>(i) / (kWidth - 1));
  for (std::uint16_t type = 0; type < 8; ++type) texels[kWidth + type] = colourOfType(type);
  const auto first = texels.begin() + kRowsBefore * kWidth;
  if (palette.of_cell.empty())
    for (std::size_t cell = 0; cell < cells; ++cell) first[static_cast<std::ptrdiff_t>(cell)] = colourOfNumber(cell);
  else
    std::copy_n(palette.of_cell.begin(), cells, first);
  if (texture_ == 0) glGenTextures(1, &texture_);
  glActiveTexture(GL_TEXTURE0 + kUnit);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, kWidth, static_cast<GLsizei>(rows), 0, GL_RGBA, GL_UNSIGNED_BYTE,
               texels.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glActiveTexture(GL_TEXTURE0);
  cells_ = static_cast<int>(cells);
  colour_ = palette.colour;
  hidden_types_ = palette.hidden_types;
  shallow_um_ = palette.shallow_um;
  deep_um_ = palette.deep_um;
}

void CardPalette::bind(Program& program, double receding) const {
  glActiveTexture(GL_TEXTURE0 + kUnit);
  glBindTexture(GL_TEXTURE_2D, texture_);
  glActiveTexture(GL_TEXTURE0);
  program.set("palette", kUnit);
  program.set("cells", cells_);
  program.set("hidden_types", hidden_types_);
  program.set("receding", receding);
}

void CardPalette::paint(Program& program, const CardBatch& batch) const {
  program.set("colouring", batch.by_cell() ? static_cast<int>(colour_) : -1);
  if (!batch.by_cell()) return;
  const double um = deep_um_ - shallow_um_;
  if (colour_ == ColourBy::depth) program.set("depth_ramp", (batch.origin_W().y() - shallow_um_) / um, 1 / um);
  if (colour_ != ColourBy::tile) return;
  const Rgba tile = colourOfNumber(batch.tile());
  program.set("tile_colour", Vector3d(Vector3d(tile.r, tile.g, tile.b) / 255));
}

}  // namespace filiform::internal
