#include "solver/workspace/history.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

ProxyPlace at(double x) {
  ProxyPlace place;
  place.tile = 0;
  place.p_W = {x, 0, 0};
  return place;
}

double x(const std::optional<ProxyPlace>& place) { return place ? place->p_W.x() : -1; }

TEST(NavigationHistory, GoesBackAndForwardToTheUsersPlaces) {
  NavigationHistory history;
  EXPECT_FALSE(history.back(at(0)));
  EXPECT_FALSE(history.forward(at(0)));
  history.jump(ProxyPlace{}, at(1));
  history.jump(at(2), at(3));            // from 1 the proxy travelled to 2, then jumped to 3
  EXPECT_EQ(x(history.back(at(4))), 2);  // from 3 it travelled to 4, then went back
  EXPECT_FALSE(history.back(at(2)));
  EXPECT_EQ(x(history.forward(at(2))), 4);
  EXPECT_FALSE(history.forward(at(4)));
}

TEST(NavigationHistory, AJumpDropsThePlacesAhead) {
  NavigationHistory history;
  history.jump(at(0), at(1));
  history.jump(at(1), at(2));
  EXPECT_EQ(x(history.back(at(2))), 1);
  history.jump(at(1), at(7));
  EXPECT_FALSE(history.forward(at(7)));
  EXPECT_EQ(x(history.back(at(7))), 1);
  EXPECT_EQ(x(history.back(at(1))), 0);
}

TEST(NavigationHistory, ForgetsTheOldestBeyondItsLength) {
  NavigationHistory history(3);
  for (int i = 0; i < 10; ++i) history.jump(at(i), at(i + 1));
  EXPECT_EQ(x(history.back(at(10))), 9);
  EXPECT_EQ(x(history.back(at(9))), 8);
  EXPECT_FALSE(history.back(at(8)));
}

TEST(NavigationHistory, KeepsBookmarksByName) {
  NavigationHistory history;
  history.setBookmark("soma", at(1));
  history.setBookmark("axon", at(2));
  history.setBookmark("soma", at(3));
  EXPECT_EQ(x(history.bookmark("soma")), 3);
  EXPECT_FALSE(history.bookmark("none"));
  EXPECT_EQ(history.bookmarks(), (std::vector<std::string>{"axon", "soma"}));
  EXPECT_TRUE(history.removeBookmark("soma"));
  EXPECT_FALSE(history.removeBookmark("soma"));
  EXPECT_FALSE(history.bookmark("soma"));
}

}  // namespace
}  // namespace filiform
