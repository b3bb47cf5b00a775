// DeskLink: shows the place of this desk at the address of a server, for pages that look on. A thread of its own sends
// the newest place, at most 60 times a second; while the network is slow or lost, places are dropped. The link comes
// back by itself.
//
//   DeskLink link(DeskAddress::parse("ws://127.0.0.1:7878/v1/sets/column/desks/anna"), token);
//   link.show(revision, place);                            // once a frame
//   for (const std::string& line : link.takeNotes()) say(line);
//
// Thread rule: one owner.
#pragma once

#include "tools/serve/desk/desk_address.h"
#include "tools/serve/desk/desk_place.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace filiform::tools {

class DeskLink {
 public:
  // `token`: of the server; empty: none. Connects at the first show().
  DeskLink(const DeskAddress& address, const std::string& token);
  // Closes the connection. May wait for the name server.
  ~DeskLink();
  DeskLink(const DeskLink&) = delete;
  DeskLink& operator=(const DeskLink&) = delete;

  // Offers a place in this revision of the set; empty: in a scene that is no tile set, which no page sees. Never waits
  // for the network.
  void show(const std::string& revision, const DeskPlace& place);
  // New lines for the user: the link is there, lost, or refused. Each once.
  std::vector<std::string> takeNotes();
  // Why the server refused this desk for good before it ever accepted it: a wrong token, set, name or revision. Nothing
  // is sent any more, unless the revision changes.
  std::optional<std::string> refusal() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace filiform::tools
