// A CGAL AABB tree over boxes, with filiform's own best-first and depth-first searches. CGAL's queries are not ordered
// by distance, and its sphere tests miss boxes that lie wholly inside. Include it only in sources. Thread rule:
// immutable after construction.
#pragma once

#include "index/tile/tile_engine.h"

#include <queue>
#include <vector>

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Simple_cartesian.h>

namespace filiform::internal {

class BoxTree {
 public:
  // Item ids are positions in `boxes`. Boxes may be flat or points. O(n log n).
  explicit BoxTree(const std::vector<WorldBox>& boxes) {
    items_.reserve(boxes.size());
    for (std::uint32_t i = 0; i < boxes.size(); ++i) items_.push_back({boxes[i], i});
    tree_.insert(items_.cbegin(), items_.cend());
    tree_.build();
  }
  BoxTree(const BoxTree&) = delete;
  BoxTree& operator=(const BoxTree&) = delete;

  std::size_t bytes() const {
    return sizeof *this + items_.capacity() * sizeof(Item) + tree_.size() * (sizeof(Primitive) + sizeof(Node));
  }

  // Calls visit(id, squared distance rounded down) for each box within bound() of h, nearer children first. bound() may
  // decrease during the search.
  template <class Bound, class Visit>
  void descend(const Vector3d& h_W, Bound&& bound, Visit&& visit) const {
    if (items_.empty()) return;
    if (items_.size() == 1) return visitItem(items_[0], h_W, bound, visit);
    const Node* root = tree_.root_node();
    if (below(root->bbox(), h_W) <= bound()) descend(*root, items_.size(), h_W, bound, visit);
  }

  // Calls visit(id) for each box that may meet the region.
  template <class Visit>
  void collect(const Region& region, Visit&& visit) const {
    if (items_.empty()) return;
    if (items_.size() == 1) return collectItem(items_[0], region, visit);
    collect(*tree_.root_node(), items_.size(), region, visit);
  }

  // An entry of a best-first search: a node with its number of items (2 or more), or one item.
  struct Place {
    double squared_distance;
    const void* node;  // null: an item
    std::size_t size_or_id;
  };
  template <class Push>
  void root(const Vector3d& h_W, Push&& push) const {
    if (items_.empty()) return;
    if (items_.size() == 1) return push(place(items_[0], h_W));
    push(place(*tree_.root_node(), items_.size(), h_W));
  }
  // Pushes the two children of a node.
  template <class Push>
  void expand(const Place& at, const Vector3d& h_W, Push&& push) const {
    const Node& node = *static_cast<const Node*>(at.node);
    const std::size_t n = at.size_or_id;
    if (n <= 3)
      push(place(*node.left_data().item, h_W));
    else
      push(place(node.left_child(), n / 2, h_W));
    if (n == 2)
      push(place(*node.right_data().item, h_W));
    else
      push(place(node.right_child(), n - n / 2, h_W));
  }

 private:
  struct Item {
    WorldBox box;
    std::uint32_t id;
  };
  using Kernel = CGAL::Simple_cartesian<double>;
  struct Primitive {
    using Id = std::uint32_t;
    using Point = Kernel::Point_3;
    using Datum = Kernel::Iso_cuboid_3;
    // NOLINTBEGIN(readability-identifier-naming): names that CGAL requires
    using Point_reference = Point;
    using Datum_reference = Datum;
    // NOLINTEND(readability-identifier-naming)

    const Item* item = nullptr;

    Primitive() = default;
    explicit Primitive(std::vector<Item>::const_iterator it) : item(&*it) {}
    Id id() const { return item->id; }
    Datum datum() const { return Datum(point(item->box.lo_W), point(item->box.hi_W), 0); }
    Point reference_point() const { return point(0.5 * (item->box.lo_W + item->box.hi_W)); }
    static Point point(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }
  };
  using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;
  using Node = CGAL::AABB_node<CGAL::AABB_traits<Kernel, Primitive>>;

  static double below(const CGAL::Bbox_3& b, const Vector3d& h_W) {
    return WorldBox{{b.xmin(), b.ymin(), b.zmin()}, {b.xmax(), b.ymax(), b.zmax()}}.squaredDistanceBelow(h_W);
  }
  static Place place(const Item& item, const Vector3d& h_W) {
    return {item.box.squaredDistanceBelow(h_W), nullptr, item.id};
  }
  static Place place(const Node& node, std::size_t n, const Vector3d& h_W) {
    return {below(node.bbox(), h_W), &node, n};
  }

  static WorldBox boxOf(const Node& node) {
    const CGAL::Bbox_3& b = node.bbox();
    return {{b.xmin(), b.ymin(), b.zmin()}, {b.xmax(), b.ymax(), b.zmax()}};
  }
  template <class Visit>
  static void collectItem(const Item& item, const Region& region, Visit& visit) {
    if (region.mayMeet(item.box)) visit(item.id);
  }
  template <class Visit>
  static void collect(const Node& node, std::size_t n, const Region& region, Visit& visit) {
    if (!region.mayMeet(boxOf(node))) return;
    if (n <= 3)
      collectItem(*node.left_data().item, region, visit);
    else
      collect(node.left_child(), n / 2, region, visit);
    if (n == 2)
      collectItem(*node.right_data().item, region, visit);
    else
      collect(node.right_child(), n - n / 2, region, visit);
  }

  template <class Bound, class Visit>
  static void visitItem(const Item& item, const Vector3d& h_W, Bound& bound, Visit& visit) {
    const double d2 = item.box.squaredDistanceBelow(h_W);
    if (d2 <= bound()) visit(item.id, d2);
  }
  // CGAL splits n items into n/2 and n - n/2, down to nodes of 2 (two items) and 3 (an item and a node of 2). Depth
  // O(log n).
  template <class Bound, class Visit>
  static void descend(const Node& node, std::size_t n, const Vector3d& h_W, Bound& bound, Visit& visit) {
    if (n == 2) {
      visitItem(*node.left_data().item, h_W, bound, visit);
      visitItem(*node.right_data().item, h_W, bound, visit);
    } else if (n == 3) {
      visitItem(*node.left_data().item, h_W, bound, visit);
      if (below(node.right_child().bbox(), h_W) <= bound()) descend(node.right_child(), 2, h_W, bound, visit);
    } else {
      const Node *near = &node.left_child(), *far = &node.right_child();
      std::size_t near_n = n / 2, far_n = n - n / 2;
      double near_d2 = below(near->bbox(), h_W), far_d2 = below(far->bbox(), h_W);
      if (far_d2 < near_d2) std::swap(near, far), std::swap(near_n, far_n), std::swap(near_d2, far_d2);
      if (near_d2 <= bound()) descend(*near, near_n, h_W, bound, visit);
      if (far_d2 <= bound()) descend(*far, far_n, h_W, bound, visit);
    }
  }

  std::vector<Item> items_;
  Tree tree_;
};

}  // namespace filiform::internal
