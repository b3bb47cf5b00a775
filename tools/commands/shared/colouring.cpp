#include "tools/commands/shared/colouring.h"

#include "index/attributes/cell_attributes.h"
#include "index/attributes/cell_filter.h"
#include "index/errors.h"
#include "index/text.h"
#include "tools/commands/shared/cell_conditions.h"

#include <string_view>

namespace filiform::tools {

Colouring parseColouring(const std::string& name) {
  constexpr std::string_view kAttributePrefix = "attribute:";
  Colouring colouring;
  colouring.kind = colouringNamed(name);
  if (colouring.kind) return colouring;
  if (name.starts_with(kMeasurePrefix))
    colouring.feature = &measureNamed(name.substr(kMeasurePrefix.size()), "--colour-by");
  else
    colouring.attribute = name.starts_with(kAttributePrefix) ? name.substr(kAttributePrefix.size()) : name;
  return colouring;
}

void checkColouring(const Colouring& colouring, const std::string& name, const TileSet* set) {
  if (colouring.kind || colouring.feature != nullptr) return;
  std::string why = "only tile sets have attributes of cells";
  if (set != nullptr) {
    const CellAttributes attributes(*set);
    if (!colouring.attribute.empty() && attributes.find(colouring.attribute)) return;
    why = unknownAttribute(colouring.attribute, attributes);
  }
  throw UsageError("--colour-by " + escaped(name, 80) +
                   ": choose cell, type, depth, radius, tile, measure:FEATURE or an attribute; " + why);
}

}  // namespace filiform::tools
