#include "tools/serve/desk/desk_rooms.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

constexpr auto kDesk = DeskMember::Role::desk, kPage = DeskMember::Role::page;

struct OneClient {
  explicit OneClient(DeskMember::Role role)
      : member(std::make_shared<DeskMember>(
            role, [this] { ++told; }, [this](const DeskRefusal& why) { ended = why; })) {}
  int told = 0;
  std::optional<DeskRefusal> ended;
  std::shared_ptr<DeskMember> member;
};

std::string placeAt(double x) {
  DeskPlace place;
  place.proxy_W = {x, 0, 0};
  return toJson(place);
}

class DeskRoomsTest : public ::testing::Test {
 protected:
  std::optional<DeskRefusal> enter(OneClient& client, const DeskRoomName& name = {"column", "anna", "r-1"}) {
    return rooms_.enter(client.member, name, 0);
  }
  DeskRooms rooms_;
};

TEST_F(DeskRoomsTest, PagesGetTheNewestPlaceOnce) {
  OneClient desk(kDesk), page(kPage), late(kPage), other(kPage);
  EXPECT_FALSE(enter(desk));
  EXPECT_FALSE(enter(page));
  EXPECT_FALSE(enter(other, {"column", "bert", "r-1"}));
  EXPECT_EQ(page.member->takeNews(), DeskRooms::kGone);
  EXPECT_FALSE(rooms_.receive(desk.member, placeAt(1), 0));
  EXPECT_FALSE(rooms_.receive(desk.member, placeAt(2), 0));
  EXPECT_EQ(page.told, 3);
  EXPECT_EQ(page.member->takeNews(), placeAt(2)) << "a page that reads slowly misses older places";
  EXPECT_EQ(page.member->takeNews(), std::nullopt);
  EXPECT_FALSE(enter(late));
  EXPECT_EQ(late.member->takeNews(), placeAt(2));
  EXPECT_EQ(other.member->takeNews(), DeskRooms::kGone);
  EXPECT_EQ(desk.told, 1);
  EXPECT_EQ(desk.member->takeNews(), DeskRooms::kWelcome);
}

TEST_F(DeskRoomsTest, ADeskThatLeavesIsGone) {
  OneClient desk(kDesk), page(kPage), again(kDesk);
  enter(desk);
  enter(page);
  rooms_.receive(desk.member, placeAt(1), 0);
  rooms_.leave(desk.member);
  EXPECT_EQ(page.member->takeNews(), DeskRooms::kGone);
  EXPECT_FALSE(rooms_.receive(desk.member, placeAt(1), 0));
  EXPECT_EQ(page.member->takeNews(), std::nullopt);
  enter(again);
  rooms_.receive(again.member, placeAt(3), 0);
  EXPECT_EQ(page.member->takeNews(), placeAt(3));
  rooms_.leave(again.member);
  rooms_.leave(again.member);
  rooms_.leave(page.member);
  EXPECT_EQ(rooms_.rooms(), 0u);
}

TEST_F(DeskRoomsTest, AnotherDeskTakesTheName) {
  OneClient first(kDesk), second(kDesk), page(kPage);
  enter(page);
  enter(first);
  EXPECT_FALSE(enter(second));
  ASSERT_TRUE(first.ended);
  EXPECT_EQ(first.ended->code, DeskCode::replaced);
  rooms_.leave(first.member);
  rooms_.receive(second.member, placeAt(5), 0);
  EXPECT_EQ(page.member->takeNews(), placeAt(5)) << "the first one's end does not end the second";
}

TEST_F(DeskRoomsTest, RevisionsAreApart) {
  OneClient desk(kDesk), page(kPage);
  enter(desk, {"column", "anna", "r-2"});
  enter(page, {"column", "anna", "r-1"});
  rooms_.receive(desk.member, placeAt(1), 0);
  EXPECT_EQ(page.member->takeNews(), DeskRooms::kGone);
}

TEST_F(DeskRoomsTest, WhatIsNoPlaceEndsTheConnection) {
  OneClient desk(kDesk), page(kPage);
  enter(desk);
  enter(page);
  page.member->takeNews();
  for (const auto& [member, text] :
       {std::pair{desk.member, std::string("{}")}, {desk.member, std::string(2000, ' ')}, {page.member, placeAt(1)}}) {
    const auto refused = rooms_.receive(member, text, 0);
    ASSERT_TRUE(refused);
    EXPECT_EQ(refused->code, DeskCode::policy);
  }
  EXPECT_EQ(page.member->takeNews(), std::nullopt);
}

TEST_F(DeskRoomsTest, TheRateIsBounded) {
  OneClient desk(kDesk);
  enter(desk);
  double now_s = 0;
  for (int i = 0; i < 6000; ++i) ASSERT_FALSE(rooms_.receive(desk.member, placeAt(i), now_s += 0.01)) << i;
  int passed = 0;
  now_s += 1;
  while (!rooms_.receive(desk.member, placeAt(0), now_s)) ++passed;
  EXPECT_EQ(passed, static_cast<int>(DeskRooms::kMostAtOnce));
}

TEST_F(DeskRoomsTest, RoomsAndPagesAreBounded) {
  std::vector<std::unique_ptr<OneClient>> clients;
  const auto one = [&](DeskMember::Role role, const std::string& name) {
    clients.push_back(std::make_unique<OneClient>(role));
    return enter(*clients.back(), {"column", name, "r-1"});
  };
  for (std::size_t i = 0; i < DeskRooms::kPages; ++i) EXPECT_FALSE(one(kPage, "0"));
  EXPECT_EQ(one(kPage, "0")->code, DeskCode::full);
  EXPECT_FALSE(one(kDesk, "0")) << "there is always room for the desk";
  for (std::size_t i = 1; i < DeskRooms::kRooms; ++i) EXPECT_FALSE(one(kDesk, std::to_string(i)));
  EXPECT_EQ(one(kDesk, "more")->code, DeskCode::full);
  EXPECT_EQ(rooms_.rooms(), DeskRooms::kRooms);
}

}  // namespace
}  // namespace filiform::tools
