// A scene while it is opened, beside the frames. Thread rule: one owner.
#pragma once

#include "solver/saved_history.h"
#include "viewer/application.h"
#include "viewer/place_finder.h"

#include <future>
#include <memory>
#include <string>
#include <vector>

namespace filiform::internal {

// A scene that is open, and what knows its places.
struct Opened {
  OpenedScene scene;
  std::unique_ptr<PlaceFinder> finder;
  std::unique_ptr<SavedHistory> saved;  // nullptr where it cannot be kept
  ProxyPlace start;                     // where the person was last, else the soma of the largest cell
  std::vector<std::string> warnings;
};

class Opening {
 public:
  using Open = std::function<OpenedScene(const std::vector<std::string>&)>;

  // Requires none under way.
  void begin(const std::vector<std::string>& paths, const Open& open, double now_s);
  bool isUnderWay() const { return opening_.valid(); }
  const std::string& name() const { return name_; }  // of what is opened, for the person
  double since_s() const { return since_s_; }

  bool isReady() const;
  Opened take();  // throws why it cannot be opened. Requires isReady()

 private:
  std::future<Opened> opening_;
  std::string name_;
  double since_s_ = 0;
};

}  // namespace filiform::internal
