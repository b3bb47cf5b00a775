// The user's places: back and forward over jumps, and bookmarks. Thread rule: thread-compatible; for the commanding
// thread, never the haptic thread.
#pragma once

#include "solver/proxy/proxy_solver.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

class NavigationHistory {
 public:
  // Keeps at most `most` places; the oldest are dropped. Requires most >= 1.
  explicit NavigationHistory(std::size_t most = 1000);

  // Records a jump from `left` to `reached`, and drops the places that forward() would give. An invalid `left` (before
  // the first placement) is not recorded.
  void jump(const ProxyPlace& left, const ProxyPlace& reached);
  // The place to go to. `here`, the proxy's place now, replaces the place of the last arrival. Nullopt at either end of
  // the history.
  std::optional<ProxyPlace> back(const ProxyPlace& here);
  std::optional<ProxyPlace> forward(const ProxyPlace& here);

  // All places, oldest first, and the index of the current one (0 if there are none): the input of restore().
  const std::vector<ProxyPlace>& places() const { return places_; }
  std::size_t now() const { return now_; }
  // Replaces all places; bookmarks stay. Invalid places are left out. A `now` beyond the last place means the last.
  void restore(std::vector<ProxyPlace> places, std::size_t now);

  // Replaces a bookmark of the same name.
  void setBookmark(const std::string& name, const ProxyPlace& place);
  bool removeBookmark(const std::string& name);  // false: no bookmark has this name
  std::optional<ProxyPlace> bookmark(const std::string& name) const;
  std::vector<std::string> bookmarks() const;  // names in byte order

 private:
  std::optional<ProxyPlace> step(std::size_t to, const ProxyPlace& here);

  std::size_t most_;
  std::vector<ProxyPlace> places_;
  std::size_t now_ = 0;
  std::map<std::string, ProxyPlace> bookmarks_;
};

}  // namespace filiform
