#include "index/levels/internal/somata_section.h"

#include "index/errors.h"
#include "index/file/internal/set_files.h"
#include "index/levels/internal/level_files.h"

#include <algorithm>

namespace filiform::internal {

Bytes encodeSomata(const std::vector<SomaRoot>& somata) {
  ByteWriter out;
  out.u64(somata.size());
  for (const SomaRoot& soma : somata) {
    out.u32(soma.cell);
    out.u32(soma.sample);
    out.point(soma.p);
    out.f32(soma.radius_um);
  }
  return out.take();
}

std::vector<SomaRoot> storedSomata(const TileSet& set) {
  const auto bytes = set.section(kSomataSection);
  if (!bytes) return {};
  try {
    ByteReader in(*bytes);
    constexpr std::uint64_t kBytesOfSoma = 36;
    const std::uint64_t count = in.u64();
    in.require(count <= in.left() / kBytesOfSoma && count * kBytesOfSoma == in.left(),
               "the number of somata contradicts the size");
    std::vector<SomaRoot> somata(count);
    std::uint32_t last = 0;
    for (SomaRoot& soma : somata) {
      soma.cell = in.u32();
      soma.sample = in.u32();
      soma.p = in.point();
      soma.radius_um = in.f32();
      in.require(soma.cell < set.cell_count() && soma.cell >= last, "a soma is of no cell, or out of order");
      last = soma.cell;
    }
    return somata;
  } catch (const Damage& damage) {
    throw CorruptSet(set.describe(sectionFile(kSomataSection)), damage.offset, damage.what);
  }
}

bool wantsLevels(const TileSet& set) {
  if (set.section(kLevelsDroppedSection)) return true;
  return std::any_of(set.files().begin(), set.files().end(),
                     [](const SetFile& file) { return file.name == kLevelsFile; });
}

}  // namespace filiform::internal
