// Tiles as the graphics card wants them: one batch a tile, positions relative to an origin of its own, so that single
// precision is enough however far from the world's origin. Pure functions; any thread.
#pragma once

#include "index/set/tile_store.h"
#include "viewer/scene/colour.h"
#include "viewer/scene/drawn_somata.h"

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace filiform {

enum class ColourBy : std::uint8_t { cell, type, depth, radius, tile };
inline constexpr ColourBy kColourings[] = {ColourBy::cell, ColourBy::type, ColourBy::depth, ColourBy::radius,
                                           ColourBy::tile};
const char* toString(ColourBy colouring) noexcept;
ColourBy colourBy(const std::string& name);  // throws UsageError naming the choices

struct DrawnSegment {  // a round cone: child end a, parent end b; a sphere where they coincide
  float a_um[3], a_radius_um;
  float b_um[3], b_radius_um;
  Rgba colour;
};
static_assert(sizeof(DrawnSegment) == 36);

struct NeuriteBatch {
  Vector3d origin_W = Vector3d::Zero();  // of a_um, b_um
  Vector3d lo_W = Vector3d::Zero(), hi_W = Vector3d::Zero();
  float largest_radius_um = 0;
  std::vector<DrawnSegment> segments;
  std::uint64_t implausible_radii = 0;  // were replaced
};

// Some files give radii in another unit, and nearly all leave some unknown. A neurite's radius is taken as it is from
// kThinnest_um to kThickest_um, a soma's to kThickestSoma_um; anything else is drawn with kDrawnUnknown_um, a soma
// with kDrawnUnknownSoma_um.
inline constexpr float kThinnest_um = 0.01F, kThickest_um = 10, kThickestSoma_um = 30;
inline constexpr float kDrawnUnknown_um = 0.3F, kDrawnUnknownSoma_um = 6;
float drawnRadius(float radius_um, std::uint16_t type, bool* replaced = nullptr) noexcept;

// Cells of which the tile holds a node that no segment's child end gives a radius and a type: a root, or a sample whose
// own segment lies elsewhere. Ascending. O(n log n).
std::vector<std::uint32_t> cellsWithOpenNodes(const Tile& tile);

struct BatchOptions {
  ColourBy colour = ColourBy::cell;
  double shallow_um = 0, deep_um = 1;    // ColourBy::depth: y of the two ends of the ramp, which may be in either order
  const RootTable* roots = nullptr;      // draws the somata among them, and gives first segments their true width
  const SomaTable* somata = nullptr;     // each drawn as one sphere, in place of the segments between its samples
  std::uint32_t only_cell = UINT32_MAX;  // if it is one: no other cell's segments
};

// All segments that the tile owns but those within somata; isolated samples and somata as spheres. A segment's two
// radii are those of its samples, as far as the tile holds them. Requires the tile's own appearance. O(n).
NeuriteBatch makeBatch(const Tile& tile, const TileAppearance& appearance, const BatchOptions& options = {});

// Puts what `more` holds behind; it must have an origin near by. O(more).
void append(NeuriteBatch& batch, const NeuriteBatch& more);

// The order in which the renderer wants segments: the larger radius of each falls. O(n log n), stable; O(n).
void sortThickestFirst(NeuriteBatch& batch);
bool isThickestFirst(const NeuriteBatch& batch);

}  // namespace filiform
