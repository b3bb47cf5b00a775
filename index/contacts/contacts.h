// Contacts: all places where segments of different cells lie within a distance, out of core.
//
//   findContacts(*set, {.within_um = 2, .from = cells, .to = cells}, [&](const ContactSite& site) {
//     std::cout << set->cell(site.sides[0].cell).name << " meets " << set->cell(site.sides[1].cell).name << " at "
//               << site.sides[0].p_W.transpose() << ", " << site.distance_um << " um\n";
//   });
//
// A *pair* is a segment of a cell of `from` and one of another cell of `to`, whose axes (or surfaces) lie within the
// distance. A *contact site* is a set of pairs of the same two cells: two pairs are one site if, on both cells, their
// segments are equal or share a sample, and so on along a chain of pairs. closest_places.h decides what is within the
// distance.
//
// A segment has the type of its child. An isolated sample counts as a segment without length. Samples of a soma and
// links from it count like all others.
#pragma once

#include "index/contacts/contact_options.h"
#include "index/contacts/contact_site.h"
#include "index/set/tile_store.h"

#include <cstdint>
#include <functional>

namespace filiform {

// What a search for contacts found.
struct ContactCounts {
  std::uint64_t pairs = 0, sites = 0;
  std::uint64_t unknown_radii = 0;  // pairs with a sample of unknown radius; only with `surface`
  std::uint64_t file_bytes = 0;     // of the unnamed file that held pairs
};

// Calls take(site) for each site, on the calling thread: ascending by the two cells, then by the site's lowest pair of
// segments. If both sides have the same cells and types, a pair is given once, with the lower cell first. Otherwise a
// pair that meets the conditions both ways is given in both. Neither tiling, threads nor memory change what is given.
//
// Reads the tiles in order and keeps those around in a part of the memory; beyond another part, pairs go to an unnamed
// file in $TMPDIR or /tmp. With places, reads the cells that have contacts, once if the sites fit a quarter of the
// memory. All pairs of two cells must fit a sixteenth of the memory; 65 536 pairs always may.
//
// Throws UsageError if the distance is not above 0, or at least the size of the cells together: the message has the
// number of pairs. Throws InputError if the pairs of two cells exceed the memory; IoError, also if the disk is full;
// what the store throws. Thread rule: any thread but the haptic one; it starts its own. O(segments near each other).
ContactCounts findContacts(const TileStore& store, const ContactOptions& options,
                           const std::function<void(const ContactSite& site)>& take);

}  // namespace filiform
