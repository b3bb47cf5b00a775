// AnatomyCheck: what is odd about the anatomy of one cell.
//
// Lengths: a link from a soma to a neurite counts from the soma's surface, one radius from the sample. Links inside a
// soma do not count. The median is that of links longer than 0; it needs at least kLeastLinks of them.
//
//   AnatomyCheck check;
//   for (const Finding& finding : check.of(cell)) std::cout << name(finding.kind) << ": " << finding.text << '\n';
#pragma once

#include "index/anatomy/finding.h"
#include "index/cell/cell.h"

#include <cstdint>
#include <vector>

namespace filiform {

// Thread rule: thread-compatible.
class AnatomyCheck {
 public:
  static constexpr double kLongLink = 20;        // times the median
  static constexpr double kLongLink_um = 100;    // a doubt: a long link of more than this
  static constexpr double kLongShare = 0.05;     // a doubt: the share of long links in the length of the cell
  static constexpr double kLongPlane_um = 100;   // flat z is a doubt if x and y extend farther than this
  static constexpr double kFarAxon_um = 100;     // from the surface of the soma
  static constexpr double kZStretch = 4;         // longest ratio of z to x and y that is not odd
  static constexpr double kZSquash = 1.0 / 12;   // shortest
  static constexpr double kTurnBack = -0.9;      // cosine of the angle between two links
  static constexpr std::size_t kLeastLinks = 4;  // with fewer links there is no median
  static constexpr std::size_t kLeastFlat = 8;   // with fewer samples flat z is not odd in a short cell
  static constexpr std::size_t kLeastRadii = 4;  // with fewer samples one radius is not odd

  // Findings by kind: all but kOtherUnit and kDuplicate, which need other cells. Valid until the next call. Memory: 13
  // bytes a sample, kept for the next cell up to Cell::kSamplesKept samples. O(samples) expected.
  const std::vector<Finding>& of(const Cell& cell);

  // Of the cell of the last call: the median length of its links, and the diagonal of its box. 0 without a median.
  double median_um() const { return median_um_; }
  double extent_um() const { return extent_um_; }
  // The links longer than kLongLink times the median, by rank of the segment. Only those of kLongLinks.
  std::vector<std::uint32_t> longLinks() const;

 private:
  void measureLinks(const Cell& cell);
  void findLongLinks(const Cell& cell);
  void findShape(const Cell& cell);
  void findTrees(const Cell& cell);
  void findTypes(const Cell& cell);
  void findFarAxons(const Cell& cell);
  void findTurns(const Cell& cell);
  void findRadii(const Cell& cell);
  Finding& add(FindingKind kind, bool doubt, std::uint64_t count);

  std::vector<Finding> findings_;
  std::vector<float> lengths_um_, sorted_um_;  // by rank of the segment; -1: none, or inside a soma
  std::vector<std::uint32_t> tree_;            // by sample, for cells with several roots
  std::vector<std::uint8_t> children_;         // by sample; 2: or more
  double median_um_ = 0, extent_um_ = 0, length_um_ = 0;
  Vector3d low_um_ = Vector3d::Zero(), high_um_ = Vector3d::Zero(), along_um_ = Vector3d::Zero();
};

}  // namespace filiform
