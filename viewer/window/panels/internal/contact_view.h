// ContactView: the contacts of one cell with all others (index/contacts/contacts.h). Finds them on a thread of its own,
// and reads only the cell and the tiles near it. Thread rule: the window's thread. No member but the destructor waits
// for the disk.
#pragma once

#include "index/query/cell_paths.h"
#include "solver/travel/places/place_finder.h"
#include "solver/travel/session/worker.h"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace filiform::internal {

class ContactView {
 public:
  struct Side {
    std::uint32_t cell = 0;
    CellPlace place;
    std::uint16_t type = 0;
  };
  struct Site {
    Side own, other;
    Vector3d p_W = Vector3d::Zero();  // on the own cell
    double distance_um = 0;
  };
  static constexpr std::size_t kMostMarks = 4096;  // the closest sites

  // Both must outlive this object.
  ContactView(const TileStore& store, const PlaceFinder& finder) : store_(store), finder_(finder) {}
  ~ContactView() { close(); }  // waits until the work under way has noticed that it is to end
  ContactView(const ContactView&) = delete;
  ContactView& operator=(const ContactView&) = delete;

  // Begins to find the contacts of a cell, instead of those before.
  void find(std::uint32_t cell, double within_um);
  // Cancels the work under way, and forgets the contacts.
  void close();
  void serve();  // once a frame: takes up finished work

  std::optional<std::uint32_t> cell() const { return cell_; }  // whose contacts these are
  std::optional<double> progress() const;                      // of finding, 0 to 1; none: it is not under way
  const std::vector<Site>& sites() const { return sites_; }    // the closest first
  // Where the closest sites are; nullptr: none.
  const std::shared_ptr<const std::vector<Vector3d>>& marks_W() const { return marks_W_; }
  const std::string& error() const { return error_; }  // one line; empty: none

  // Where a jump across a site leads to: from the own cell to the other, and from there back. `from`: the proxy's cell.
  static const Side& across(const Site& site, std::uint32_t from) {
    return from == site.other.cell ? site.own : site.other;
  }
  // Of a cell that has been found.
  const std::string& nameOf(std::uint32_t cell) const { return store_.cell(cell).name; }
  // The site nearest to a place, of those with this cell on a side; nullptr: there is none. O(sites).
  const Site* nearest(std::uint32_t cell, const Vector3d& p_W) const;

  void describe(nlohmann::ordered_json& state) const;

 private:
  struct Finding {
    std::atomic<bool> stop{false};
    std::atomic<double> part{0};
  };

  const TileStore& store_;
  const PlaceFinder& finder_;
  std::optional<std::uint32_t> cell_;
  std::vector<Site> sites_;
  std::shared_ptr<const std::vector<Vector3d>> marks_W_;
  std::string error_;
  std::shared_ptr<Finding> finding_;  // nullptr: it is not under way
  std::unique_ptr<Worker> worker_;    // made at its first use; destroyed first
};

}  // namespace filiform::internal
