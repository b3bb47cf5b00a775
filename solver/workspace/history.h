// Where a person has been: back and forward over jumps, and bookmarks. Thread rule: thread-compatible; for the
// commanding thread, never the haptic one.
#pragma once

#include "solver/proxy/proxy_solver.h"

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace filiform {

class NavigationHistory {
 public:
  // Keeps at most `most` places: the oldest are forgotten. Requires most >= 1.
  explicit NavigationHistory(std::size_t most = 1000);

  // A jump from `left` to `reached`: what lay ahead is forgotten. An invalid `left` (the first placement) is not kept.
  void jump(const ProxyPlace& left, const ProxyPlace& reached);
  // Where to go, as if that jump had been undone or done again; `here`, where the proxy is now, is kept in place of
  // where it had arrived. None at either end.
  std::optional<ProxyPlace> back(const ProxyPlace& here);
  std::optional<ProxyPlace> forward(const ProxyPlace& here);

  // All places, oldest first, and which of them is where the proxy is (0 while there are none): what restore() takes.
  const std::vector<ProxyPlace>& places() const { return places_; }
  std::size_t now() const { return now_; }
  // In place of what there is; bookmarks stay. Invalid places are left out; a `now` beyond the last is the last.
  void restore(std::vector<ProxyPlace> places, std::size_t now);

  // Replaces one of that name.
  void setBookmark(const std::string& name, const ProxyPlace& place);
  bool removeBookmark(const std::string& name);  // false: there was none
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
