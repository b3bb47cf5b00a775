// SiteMerger: merges the pairs of two cells into contact sites. Thread rule: thread-compatible.
#pragma once

#include "index/contacts/contact_site.h"
#include "index/contacts/internal/contact_pair.h"

#include <span>
#include <vector>

namespace filiform::internal {

class SiteMerger {
 public:
  // The sites of all pairs of two cells, without places, ascending by their lowest pair; valid until the next call.
  // Requires that pairs ascend. O(pairs log pairs).
  //
  // Two segments are equal or share a sample if and only if they have a sample in common. So two pairs are one site if
  // they have a sample of each cell in common: each pair joins up to four {sample, sample}.
  std::span<const ContactSite> merge(std::span<const ContactPair> pairs);

 private:
  std::uint32_t root(std::uint32_t pair);
  void join(std::uint32_t a, std::uint32_t b);

  struct Slot {
    std::uint64_t samples;
    std::uint32_t pair;  // the first with these
  };
  std::vector<Slot> slots_;            // a hash table
  std::vector<std::uint32_t> before_;  // by pair: a lower pair of the site, or itself
  std::vector<std::uint32_t> site_of_;
  std::vector<std::uint32_t> last_;  // by site: the last segment of the first cell
  struct SegmentOfSite {
    std::uint64_t key;  // the site, and the segment of the second cell
    double length_um;
  };
  std::vector<SegmentOfSite> segments_;
  std::vector<ContactSite> sites_;
};

}  // namespace filiform::internal
