// A list of numbers that decides whether something must be made again: equal lists, equal results.
// Thread-compatible.
#pragma once

#include "viewer/scene/colour.h"

#include <vector>

#include <Eigen/Core>

namespace filiform::internal {

class Signature {
 public:
  void add(double x) { values_.push_back(x); }
  template <class Derived>
  void add(const Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index i = 0; i < m.size(); ++i) add(static_cast<double>(m(i % m.rows(), i / m.rows())));
  }
  void add(const Rgba& c) { add(((c.r * 256.0 + c.g) * 256.0 + c.b) * 256.0 + c.a); }
  bool empty() const { return values_.empty(); }
  friend bool operator==(const Signature&, const Signature&) = default;

 private:
  std::vector<double> values_;
};

}  // namespace filiform::internal
