// The answer of the route contacts: the rows of `filiform contacts` of one cell.
#include "index/contacts/contacts.h"
#include "tools/serve/routes/service.h"
#include "tools/serve/sets/limits.h"
#include "tools/words/contact_rows.h"
#include "tools/words/filter_words.h"

#include <numeric>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::uint64_t kContactMemory = std::uint64_t{64} << 20;

}  // namespace

Answer contactsAnswer(const Call& call) {
  const ServedSet& served = *call.served;
  const TileStore& store = served.store();
  const auto name = call.request.parameter("cell");
  if (!name) throw Refusal(400, "give cell=NAME; filiform contacts finds those of all cells on the set's files");
  ContactOptions options{.within_um = call.request.number("within").value_or(2),
                         .surface = call.request.isFirst("surface", "true", "false"),
                         .from = {cellLike(served, *name, "cell")},
                         .memory_bytes = kContactMemory};
  if (!(options.within_um > 0)) throw Refusal(400, "within: the distance must be above 0 um");
  refuseLargeCell(store.cell(options.from[0]));
  std::array types = parseTypesOfSides(call.request.parameter("types").value_or(""), "types");
  options.from_types = std::move(types[0]), options.to_types = std::move(types[1]);
  if (const auto conditions = call.request.parameter("where")) {
    options.to = cellsMeeting(served, *conditions);
  } else {
    options.to.resize(store.cell_count());
    std::iota(options.to.begin(), options.to.end(), 0);
    std::erase_if(options.to, [&](std::uint32_t cell) { return store.cell(cell).removed; });
  }
  const std::size_t most = call.request.whole("limit", 1, limits::kContactSites).value_or(10'000);
  options.check = [](std::uint64_t, std::uint64_t) { TimedStore::check(); };
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  bool is_truncated = false;
  findContacts(store, options, [&](const ContactSite& site) {
    TimedStore::check();
    if (rows.size() == most)
      is_truncated = true;
    else
      rows.push_back(contactJson(store, site));
  });
  return jsonAnswer({{"truncated", is_truncated}, {"rows", std::move(rows)}});
}

}  // namespace filiform::tools
