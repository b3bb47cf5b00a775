#include "solver/travel/routes/route_choice.h"

#include "index/errors.h"

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(RouteChoice, ItsTextGivesItAgain) {
  for (const char* text : {"longest", "1:4", "-1:4", "random:0", "random:18446744073709551615", "tour:0",
                           "tour:18446744073709551615", "-9223372036854775808:9223372036854775807"})
    EXPECT_EQ(toString(routeChoiceOf(text)), text);
  EXPECT_EQ(routeChoiceOf("longest"), RouteChoice());
  EXPECT_EQ(routeChoiceOf("tour:7"), (RouteChoice{.kind = RouteChoice::Kind::tour, .seed = 7}));
}

TEST(RouteChoice, RefusesOtherTexts) {
  for (const char* text : {"",
                           "1",
                           "1:",
                           ":4",
                           "1:x",
                           "1:4:5",
                           "random",
                           "random:",
                           "random:-1",
                           "random:1.5",
                           "Longest",
                           "1 : 4",
                           "18446744073709551617:4",
                           "tour",
                           "tour:",
                           "tour:x",
                           "tour:-1",
                           "tour:1.5",
                           "tour:1 ",
                           "tour:18446744073709551616",
                           "tours:1"})
    EXPECT_THROW(routeChoiceOf(text), UsageError) << text;
}

}  // namespace
}  // namespace filiform
