// The text beside a pointer that rests on a neurite: cell, sample, type and position. Thread rule: the window's thread.
#pragma once

#include "index/query/nearest.h"

#include <limits>
#include <string>

namespace filiform::internal {

class Travel;

class Tooltip {
 public:
  void pointerMoved(double now_s);
  void clear() { text_.clear(); }
  void reset() { *this = {}; }  // another scene

  // True: the pointer has rested long enough, and its place was not looked up yet.
  bool isDue(double now_s) const;
  // Looks up the neurite on this line of sight. `travel` calls back before this object ends.
  void lookUp(Travel& travel, const RayQuery& ray);
  const std::string& text() const { return text_; }  // empty: none is shown

 private:
  std::string text_;
  double rested_since_s_ = std::numeric_limits<double>::infinity();  // before the first move: it has not rested
  double asked_for_s_ = -1;
  bool asked_ = false;
};

}  // namespace filiform::internal
