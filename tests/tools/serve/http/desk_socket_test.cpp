// Desks and pages of `filiform serve` over WebSockets, and DeskLink as a client.
#include "index/set/tile_set.h"
#include "tests/support/servers/served_column.h"
#include "tools/lab/reference/service_socket.h"
#include "tools/serve/desk/desk_link.h"
#include "tools/serve/desk/desk_rooms.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using namespace std::chrono_literals;
using test::runFiliform;
using tools::DeskAddress;
using tools::DeskLink;
using tools::DeskPlace;
using tools::ServiceSocket;
using DeskFrame = ServiceSocket::Message::Kind;

constexpr const char* kDeskToken = "fedcba98765432100123";

DeskPlace deskAt(double x) {
  DeskPlace place;
  place.proxy_W = {x, 0, 0};
  return place;
}

class DeskSockets : public test::ServedColumn {
 protected:
  void SetUp() override {
    ServedColumn::SetUp();
    revision_ = TileSet::open(set_)->revision();
  }
  std::string path(const std::string& more = "", const std::string& name = "anna") const {
    return "/v1/sets/t/desks/" + name + more + "?revision=" + revision_;
  }
  ServiceSocket connect(const std::string& target, const std::string& headers = {}) const {
    return ServiceSocket(server_->port(), {.target = target, .headers = headers});
  }
  DeskAddress address() const {
    return DeskAddress::parse("ws://127.0.0.1:" + std::to_string(server_->port()) + "/v1/sets/t/desks/anna");
  }
  static ServiceSocket::Message closed(ServiceSocket& client) {
    for (;;) {
      const ServiceSocket::Message message = client.read(30s);
      if (message.kind == DeskFrame::close || message.kind == DeskFrame::ended || message.kind == DeskFrame::none)
        return message;
    }
  }
  // Shows the place until `done`, and keeps all notes.
  bool showUntil(DeskLink& link, const DeskPlace& place, const std::function<bool()>& done) {
    for (const auto until = std::chrono::steady_clock::now() + 40s; std::chrono::steady_clock::now() < until;) {
      link.show(revision_, place);
      for (const std::string& note : link.takeNotes()) notes_ += note + '\n';
      if (done()) return true;
      std::this_thread::sleep_for(10ms);
    }
    return false;
  }
  bool hasNote(const std::string& part) const { return notes_.find(part) != std::string::npos; }

  std::string revision_, notes_;
};

TEST_F(DeskSockets, PagesSeeTheDesk) {
  start();
  ServiceSocket page = connect(path("/page"));
  ASSERT_EQ(page.status(), 101u) << page.head();
  EXPECT_EQ(page.text(), tools::DeskRooms::kGone);
  {
    ServiceSocket desk = connect(path());
    ASSERT_TRUE(desk.sendText(toJson(deskAt(7))));
    EXPECT_EQ(page.text(), toJson(deskAt(7)));
  }
  EXPECT_EQ(page.text(), tools::DeskRooms::kGone) << "the desk's connection has ended";
}

TEST_F(DeskSockets, WrongRoomsAreRefusedWithAReason) {
  start();
  for (const auto& [target, code, part] :
       {std::tuple{std::string("/v1/sets/t/desks/anna?revision=r-0"), 4009u, std::string("open the same set")},
        {std::string("/v1/sets/t/desks/anna"), 4009u, std::string("open the same set")},
        {"/v1/sets/u/desks/anna?revision=" + revision_, 4004u, std::string("no set 'u'")},
        {path("", "a%20b"), 1008u, std::string("1 to 32 letters")}}) {
    ServiceSocket client = connect(target);
    ASSERT_EQ(client.status(), 101u) << client.head();
    const auto last = closed(client);
    EXPECT_EQ(last.code, code) << target;
    EXPECT_NE(last.bytes.find(part), std::string::npos) << last.bytes;
  }
  const auto plain = test::fetch(server_->port(), path());
  EXPECT_EQ(plain.status, 426u);
  EXPECT_NE(plain.body.find("--follow"), std::string::npos);
  EXPECT_EQ(test::fetch(server_->port(), path("/pages")).status, 404u);
}

TEST_F(DeskSockets, WrongMessagesEndTheirConnectionAlone) {
  start();
  ServiceSocket page = connect(path("/page", "bert")), other = connect(path("", "bert"));
  const auto endOf = [&](const std::string& target, FrameKind kind, const std::string& text, int times = 1) {
    ServiceSocket client = connect(target);
    for (int i = 0; i < times && client.send(kind, text); ++i) {
    }
    const auto last = closed(client);
    EXPECT_EQ(last.bytes.find('\n'), std::string::npos) << last.bytes;
    return std::to_string(last.code) + ' ' + std::string(last.bytes);
  };
  const std::string good = toJson(deskAt(1));
  EXPECT_TRUE(endOf(path(), FrameKind::text, "{}").starts_with("1008 this is no place of a desk"));
  EXPECT_TRUE(endOf(path(), FrameKind::text, good + "\n" + good).starts_with("1008 this is no place of a desk"));
  EXPECT_TRUE(endOf(path(), FrameKind::binary, good).starts_with("1008 a place is a text"));
  EXPECT_TRUE(endOf(path(), FrameKind::text, std::string(5000, ' ')).starts_with("1009"));
  EXPECT_TRUE(endOf(path(), FrameKind::text, good, 1000).starts_with("1008 more than 120 messages a second"));
  EXPECT_TRUE(endOf(path("/page"), FrameKind::text, good).starts_with("1008 a page sends nothing"));
  ASSERT_TRUE(other.sendText(toJson(deskAt(9))));
  std::string seen;
  while (seen != toJson(deskAt(9))) seen = page.text();
  server_->signal(SIGTERM);
  EXPECT_EQ(closed(page).code, 1001u);
  EXPECT_EQ(closed(other).code, 1001u);
  EXPECT_EQ(server_->wait(), 0);
}

TEST_F(DeskSockets, ForeignPagesAndWrongTokensAreRefused) {
  test::writeBytes(folder_ / "token", std::string(kDeskToken) + "\n");
  start({"--token-file", folder_ / "token"});
  const std::string bearer = std::string("Authorization: Bearer ") + kDeskToken + "\r\n";
  EXPECT_EQ(connect(path()).status(), 401u);
  EXPECT_EQ(connect(path("/page")).status(), 401u);
  EXPECT_EQ(connect(path(), bearer).status(), 101u);
  EXPECT_EQ(connect(path("/page"), bearer + "Origin: https://evil.example\r\n").status(), 403u);
  DeskLink link(address(), "");
  EXPECT_TRUE(showUntil(link, deskAt(1), [&] { return link.refusal().has_value(); }));
  EXPECT_NE(link.refusal()->find("--token-file"), std::string::npos) << *link.refusal();
  DeskLink allowed(address(), kDeskToken);
  EXPECT_TRUE(showUntil(allowed, deskAt(1), [&] { return hasNote("shown at"); })) << notes_;
}

TEST_F(DeskSockets, APageThatReadsLateMissesOldPlaces) {
  start();
  constexpr int kPlaces = 900;
  ServiceSocket late(server_->port(), {.target = path("/page"), .receive_bytes = 2048});
  ServiceSocket page = connect(path("/page")), desk = connect(path());
  std::string seen;
  const auto last = [&](ServiceSocket& client) {
    int read = 0;
    for (seen.clear(); seen != toJson(deskAt(kPlaces - 1)); ++read) seen = client.text();
    return read;
  };
  for (int i = 0; i < kPlaces; ++i) {
    ASSERT_TRUE(desk.sendText(toJson(deskAt(i))));
    if (i >= 400) std::this_thread::sleep_for(9ms);
  }
  last(page);
  EXPECT_LT(last(late), 200) << "places of more than 3 s were kept for a page that did not read";
}

TEST_F(DeskSockets, TheLinkComesBackAfterALostServer) {
  start();
  const std::uint16_t port = server_->port();
  DeskLink link(address(), "");
  {
    ServiceSocket page = connect(path("/page"));
    EXPECT_TRUE(showUntil(link, deskAt(3), [&] { return hasNote("shown at"); })) << notes_;
    std::string seen;
    EXPECT_TRUE(showUntil(link, deskAt(4), [&] { return (seen = page.text()) == toJson(deskAt(4)); })) << seen;
  }
  server_->signal(SIGKILL);
  server_->wait();
  EXPECT_TRUE(showUntil(link, deskAt(4), [&] { return hasNote("trying again"); })) << notes_;
  const test::StartedProcess again(
      {test::filiformProgram().string(), "serve", set_, "--no-token", "--listen", "127.0.0.1:" + std::to_string(port)},
      folder_ / "err");
  EXPECT_TRUE(showUntil(link, deskAt(5), [&] { return hasNote("shown again at"); })) << notes_;
  ServiceSocket page(port, {.target = path("/page")});
  std::string seen;
  EXPECT_TRUE(showUntil(link, deskAt(5), [&] { return (seen = page.text()) == toJson(deskAt(5)); })) << seen;
  EXPECT_FALSE(link.refusal());
}

TEST_F(DeskSockets, TheLinkGoesWhereItsSceneIs) {
  start();
  ServiceSocket page = connect(path("/page"));
  DeskLink link(address(), "");
  for (int i = 0; i < 200 && !link.refusal(); ++i) link.show("r-other", deskAt(1)), std::this_thread::sleep_for(20ms);
  ASSERT_TRUE(link.refusal());
  EXPECT_NE(link.refusal()->find("open the same set"), std::string::npos) << *link.refusal();
  std::string seen;
  EXPECT_TRUE(showUntil(link, deskAt(6), [&] { return (seen = page.text()) == toJson(deskAt(6)); })) << seen;
  link.show("", deskAt(6));
  while (seen != tools::DeskRooms::kGone) seen = page.text();
}

TEST_F(DeskSockets, NamesOfSetsMayHaveAnyCharacters) {
  const std::string odd = folder_ / "a b'+\xC3\xBC.fil";
  ASSERT_EQ(runFiliform({"ingest", folder_ / "t.zip", "-o", odd}).exit_code, 0);
  revision_ = TileSet::open(odd)->revision();
  server_.emplace(std::vector<std::string>{odd}, folder_ / "err");
  const std::string where = "/v1/sets/a%20b%27+%C3%BC/desks/Anna-1._";
  ServiceSocket page = connect(where + "/page?revision=" + revision_);
  EXPECT_EQ(page.text(), tools::DeskRooms::kGone);
  DeskLink link(DeskAddress::parse("ws://127.0.0.1:" + std::to_string(server_->port()) + where), "");
  std::string seen;
  EXPECT_TRUE(showUntil(link, deskAt(2), [&] { return (seen = page.text()) == toJson(deskAt(2)); })) << seen;
}

TEST_F(DeskSockets, WrongOptionsEndViewBeforeItsWindow) {
  const std::string good = "ws://127.0.0.1:9/v1/sets/t/desks/anna", cell = folder_ / "cell.swc";
  test::writeBytes(cell, "1 1 0 0 0 1 -1\n2 1 9 0 0 1 1\n");
  for (const auto& [arguments, part] :
       {std::pair{std::vector<std::string>{set_, "--follow", "http://127.0.0.1:9/"}, "give ws://HOST:PORT"},
        {{set_, "--follow", "wss" + good.substr(2)}, "ssh -L"},
        {{cell, "--follow", good}, "--follow takes one tile set; name the set that the page shows"},
        {{"--follow", good}, "--follow takes one tile set; name the set that the page shows"},
        {{set_, "--web", "--follow", good}, "leave out --follow"}}) {
    std::vector<std::string> words = arguments;
    words.insert(words.begin(), "view");
    const auto outcome = runFiliform(words);
    EXPECT_EQ(outcome.exit_code, 2) << part;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

TEST_F(DeskSockets, ASecondDeskReplacesTheFirst) {
  start();
  DeskLink first(address(), ""), second(address(), "");
  EXPECT_TRUE(showUntil(first, deskAt(1), [&] { return hasNote("shown at"); })) << notes_;
  notes_.clear();
  EXPECT_TRUE(showUntil(second, deskAt(2), [&] { return hasNote("shown at"); })) << notes_;
  notes_.clear();
  EXPECT_TRUE(showUntil(first, deskAt(1), [&] { return hasNote("another desk"); })) << notes_;
  EXPECT_FALSE(first.refusal()) << "it was accepted before";
}

}  // namespace
}  // namespace filiform
