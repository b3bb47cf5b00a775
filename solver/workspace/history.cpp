#include "solver/workspace/history.h"

#include <algorithm>

namespace filiform {

NavigationHistory::NavigationHistory(std::size_t most) : most_(std::max<std::size_t>(most, 1)) {}

void NavigationHistory::jump(const ProxyPlace& left, const ProxyPlace& reached) {
  places_.resize(std::min(places_.size(), now_ + 1));
  if (left.valid()) {
    if (places_.empty())
      places_.push_back(left);
    else
      places_[now_] = left;
  }
  places_.push_back(reached);
  if (places_.size() > most_) places_.erase(places_.begin(), places_.end() - static_cast<std::ptrdiff_t>(most_));
  now_ = places_.size() - 1;
}

std::optional<ProxyPlace> NavigationHistory::step(std::size_t to, const ProxyPlace& here) {
  if (here.valid()) places_[now_] = here;
  now_ = to;
  return places_[now_];
}

std::optional<ProxyPlace> NavigationHistory::back(const ProxyPlace& here) {
  if (now_ == 0) return std::nullopt;
  return step(now_ - 1, here);
}

std::optional<ProxyPlace> NavigationHistory::forward(const ProxyPlace& here) {
  if (now_ + 1 >= places_.size()) return std::nullopt;
  return step(now_ + 1, here);
}

void NavigationHistory::restore(std::vector<ProxyPlace> places, std::size_t now) {
  places_.clear();
  now_ = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (!places[i].valid()) continue;
    places_.push_back(places[i]);
    if (i <= now) now_ = places_.size() - 1;
  }
  if (places_.size() > most_) {
    // Keeps the newest places, but always the current one.
    const std::size_t first = std::min(places_.size() - most_, now_);
    places_.erase(places_.begin(), places_.begin() + static_cast<std::ptrdiff_t>(first));
    places_.resize(most_);
    now_ -= first;
  }
}

void NavigationHistory::setBookmark(const std::string& name, const ProxyPlace& place) { bookmarks_[name] = place; }

bool NavigationHistory::removeBookmark(const std::string& name) { return bookmarks_.erase(name) > 0; }

std::optional<ProxyPlace> NavigationHistory::bookmark(const std::string& name) const {
  const auto found = bookmarks_.find(name);
  if (found == bookmarks_.end()) return std::nullopt;
  return found->second;
}

std::vector<std::string> NavigationHistory::bookmarks() const {
  std::vector<std::string> names;
  names.reserve(bookmarks_.size());
  for (const auto& [name, place] : bookmarks_) names.push_back(name);
  return names;
}

}  // namespace filiform
