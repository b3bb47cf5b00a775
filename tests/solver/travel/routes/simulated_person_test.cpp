#include "solver/travel/routes/simulated_person.h"

#include "index/cell/cell.h"
#include "index/errors.h"
#include "tests/support/no_alloc_guard.h"
#include "tests/support/numbers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::kDt_s;

// A neurite of `n` segments of 10 um with a right angle at every node.
Route staircase(std::uint32_t n = 20) {
  std::vector<GridPoint> positions;
  std::vector<std::uint32_t> parents;
  Vector3d p = Vector3d::Zero();
  for (std::uint32_t i = 0; i <= n; ++i) {
    positions.push_back(Grid().snap(p));
    parents.push_back(i == 0 ? kNoParent : i - 1);
    p[i % 2] += 10;
  }
  return Route(0, Grid(), positions, parents, 0, n);
}

ProxyPlace placeAt(const Route& route, double arc_um) {
  ProxyPlace place;
  place.tile = 0;
  place.p_W = route.pointAt(arc_um);
  const auto& points = route.points();
  std::size_t i = 1;
  while (i + 1 < points.size() && points[i].arc_um < arc_um) ++i;
  place.segment = {0, points[i].rank};  // the child is the later point
  place.t = 1 - (arc_um - points[i - 1].arc_um) / (points[i].arc_um - points[i - 1].arc_um);
  return place;
}

PersonParameters calm() {
  PersonParameters parameters;
  parameters.tremor_rms_m = 0;
  return parameters;
}

WorkspaceOptions box() { return {.zoom_um = 300}; }

TEST(SimulatedPerson, LeadsAProxyThatYieldsToTheTip) {
  const Route route = staircase();
  for (const double tremor : {0.0, 0.0005}) {
    PersonParameters parameters;
    parameters.tremor_rms_m = tremor;
    SimulatedPerson person(route, parameters, 3);
    Workspace workspace(box());
    double arc_um = 0;
    int ticks = 0;
    for (; person.status() != PersonStatus::arrived && ticks < 100000; ++ticks) {
      const ProxyPlace place = placeAt(route, arc_um);
      const Vector3d aim_W = workspace.toWorld(person.target_D(place, workspace, kDt_s));
      workspace.drift(place.p_W, kDt_s);
      // A proxy that steps along the route while that brings it nearer to the aim.
      for (int i = 0; i < 20 && arc_um < route.length_um(); ++i) {
        const double next_um = std::min(arc_um + 0.05, route.length_um());
        if ((route.pointAt(next_um) - aim_W).norm() > (route.pointAt(arc_um) - aim_W).norm()) break;
        arc_um = next_um;
      }
    }
    EXPECT_EQ(person.status(), PersonStatus::arrived);
    const double nominal_s = route.length_um() / workspace.scale_um_m() / parameters.speed_m_s;
    EXPECT_LT(ticks * kDt_s, 4 * nominal_s);
    EXPECT_GT(ticks * kDt_s, 0.9 * nominal_s);
    EXPECT_NEAR(person.reached_um(), route.length_um(), parameters.arrive_m * workspace.scale_um_m() * 1.01);
  }
}

TEST(SimulatedPerson, PushesBacksOffAndGivesUpWhenTheProxyStays) {
  const Route route = staircase();
  const PersonParameters parameters = calm();
  SimulatedPerson person(route, parameters, 1);
  const Workspace workspace(box());
  const ProxyPlace place = placeAt(route, 25);
  const Vector3d proxy_D = workspace.toDevice(place.p_W);
  Vector3d last_D = person.target_D(place, workspace, kDt_s);
  double time_s = 0, furthest_m = 0;
  bool pushed = false, backed_off = false;
  while (person.status() != PersonStatus::gave_up && time_s < 120) {
    const Vector3d target_D = person.target_D(place, workspace, kDt_s);
    EXPECT_LT((target_D - last_D).norm(), 0.0002);  // the aim moves continuously
    last_D = target_D;
    furthest_m = std::max(furthest_m, (target_D - proxy_D).norm());
    pushed |= person.status() == PersonStatus::pushing;
    backed_off |= person.status() == PersonStatus::backing_off;
    time_s += kDt_s;
  }
  EXPECT_EQ(person.status(), PersonStatus::gave_up);
  EXPECT_TRUE(pushed);
  EXPECT_TRUE(backed_off);
  EXPECT_EQ(person.back_offs(), parameters.tries);
  EXPECT_GT(furthest_m, parameters.lookahead_m + 0.9 * parameters.push_most_m - 0.01);
  EXPECT_DOUBLE_EQ(person.reached_um(), 25);
}

TEST(SimulatedPerson, ProgressResetsFailedTries) {
  const Route route = staircase();
  const PersonParameters parameters = calm();
  SimulatedPerson person(route, parameters, 1);
  const Workspace workspace(box());
  for (int stage = 0; stage < 4; ++stage) {
    const int before = person.back_offs();
    const ProxyPlace place = placeAt(route, 10 + 10 * stage);
    for (int tick = 0; tick < 200000 && person.back_offs() < before + parameters.tries - 1; ++tick)
      person.target_D(place, workspace, kDt_s);
    EXPECT_NE(person.status(), PersonStatus::gave_up);
  }
  EXPECT_EQ(person.back_offs(), 4 * (parameters.tries - 1));
}

TEST(SimulatedPerson, OffTheRouteIsNotArrived) {
  const Route route = staircase(2);
  SimulatedPerson person(route, calm(), 1);
  const Workspace workspace(box());
  ProxyPlace place = placeAt(route, route.length_um());
  place.segment.cell = 7;
  person.target_D(place, workspace, kDt_s);
  EXPECT_NE(person.status(), PersonStatus::arrived);
  place.segment.cell = 0;
  person.target_D(place, workspace, kDt_s);
  EXPECT_EQ(person.status(), PersonStatus::arrived);
}

TEST(SimulatedPerson, TremorHasItsSizeAndCorrelationTime) {
  const Route route = staircase();
  PersonParameters parameters;
  SimulatedPerson person(route, parameters, 11), steady(route, calm(), 11);
  const Workspace workspace(box());
  const ProxyPlace place = placeAt(route, 0);
  std::vector<Vector3d> tremor;
  for (int tick = 0; tick < 400000; ++tick) {
    // The decisions are the same with and without tremor; only the tremor differs.
    const Vector3d aim_D = person.target_D(place, workspace, kDt_s) - steady.target_D(place, workspace, kDt_s);
    tremor.push_back(aim_D);
  }
  for (int axis = 0; axis < 3; ++axis) {
    double sum = 0, squares = 0, lagged = 0;
    constexpr std::size_t kLag = 150;
    for (std::size_t i = 0; i < tremor.size(); ++i) {
      sum += tremor[i][axis];
      squares += tremor[i][axis] * tremor[i][axis];
      if (i >= kLag) lagged += tremor[i][axis] * tremor[i - kLag][axis];
    }
    const double n = static_cast<double>(tremor.size());
    EXPECT_NEAR(std::sqrt(squares / n), 0.0005, 0.00005);
    EXPECT_NEAR(sum / n, 0, 0.00005);
    EXPECT_NEAR(lagged / squares, std::exp(-1), 0.08);
  }
}

TEST(SimulatedPerson, AimErrorIsConstantMostlyInDepthAndLeavesTheTremor) {
  const Route route = staircase();
  const Workspace workspace(box());
  const ProxyPlace place = placeAt(route, 0);
  int nearer = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    PersonParameters wrong;
    wrong.aim_error_m = 0.002;
    SimulatedPerson person(route, wrong, seed), right(route, {}, seed);
    Vector3d error_m;
    for (int tick = 0; tick < 300; ++tick) {
      const Vector3d differ_m = person.target_D(place, workspace, kDt_s) - right.target_D(place, workspace, kDt_s);
      if (tick == 0) error_m = differ_m;
      ASSERT_TRUE(differ_m.isApprox(error_m, 1e-9));
    }
    EXPECT_NEAR(error_m.norm(), 0.002, 1e-12);
    EXPECT_GT(std::abs(error_m.z()), 0.8 * 0.002);
    nearer += error_m.z() > 0;
  }
  EXPECT_GT(nearer, 8);
  EXPECT_LT(nearer, 32);
}

TEST(SimulatedPerson, IsTheSameForASeed) {
  const Route route = staircase();
  SimulatedPerson a(route, {}, 5), b(route, {}, 5), c(route, {}, 6);
  const Workspace workspace(box());
  bool differs = false;
  for (int tick = 0; tick < 1000; ++tick) {
    const ProxyPlace place = placeAt(route, 0.01 * tick);
    const Vector3d target_D = a.target_D(place, workspace, kDt_s);
    ASSERT_EQ(target_D, b.target_D(place, workspace, kDt_s));
    differs |= target_D != c.target_D(place, workspace, kDt_s);
  }
  EXPECT_TRUE(differs);
  // The first numbers are the same on every machine: mt19937_64 is specified bit for bit, and all other operations are
  // exact or correctly rounded.
  SimulatedPerson fresh(route, {}, 1);
  std::mt19937_64 random(1);
  double first = -6;
  for (int i = 0; i < 12; ++i) first += static_cast<double>(random() >> 11) * 0x1p-53;
  PersonParameters parameters;
  const Vector3d aim_D = SimulatedPerson(route, calm(), 1).target_D(placeAt(route, 0), workspace, kDt_s);
  EXPECT_EQ(fresh.target_D(placeAt(route, 0), workspace, kDt_s).x(), aim_D.x() + parameters.tremor_rms_m * first);
}

TEST(SimulatedPerson, StaysInTheBoxAndFiniteWhateverItSees) {
  const Route route = staircase();
  const double infinity = std::numeric_limits<double>::infinity(), nan = std::numeric_limits<double>::quiet_NaN();
  for (const double zoom_um : {1e-6, 1.0, 300.0, 1e6}) {
    for (const double dt_s : {1e-6, 1e-3, 1.0, 0.0, -1.0, nan, infinity}) {
      SimulatedPerson person(route, {}, 1);
      const Workspace workspace(WorkspaceOptions{.zoom_um = zoom_um});
      for (int tick = 0; tick < 200; ++tick) {
        const Vector3d target_D = person.target_D(placeAt(route, tick), workspace, dt_s);
        ASSERT_TRUE(target_D.allFinite());
        ASSERT_LE(target_D.cwiseAbs().maxCoeff(), 0.06);
      }
    }
  }
}

TEST(SimulatedPerson, DecidesWithoutAllocation) {
  const Route route = staircase();
  SimulatedPerson person(route, {}, 1);
  const Workspace workspace(box());
  const ProxyPlace place = placeAt(route, 25);
  Vector3d sum = Vector3d::Zero();
  test::NoAllocGuard guard;
  for (int tick = 0; tick < 10000; ++tick) sum += person.target_D(place, workspace, kDt_s);
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.total(), 0u) << calls.first;
  EXPECT_TRUE(sum.allFinite());
  EXPECT_GT(person.back_offs(), 0);
}

TEST(SimulatedPerson, RefusesParametersThatMakeNoSense) {
  const Route route = staircase();
  const auto refuses = [&](auto change) {
    PersonParameters parameters;
    change(parameters);
    EXPECT_THROW(SimulatedPerson(route, parameters, 1), UsageError);
  };
  refuses([](PersonParameters& p) { p.speed_m_s = 0; });
  refuses([](PersonParameters& p) { p.speed_m_s = std::numeric_limits<double>::quiet_NaN(); });
  refuses([](PersonParameters& p) { p.lookahead_m = -1; });
  refuses([](PersonParameters& p) { p.tremor_rms_m = -1; });
  refuses([](PersonParameters& p) { p.tremor_time_s = 0; });
  refuses([](PersonParameters& p) { p.tries = 0; });
}

}  // namespace
}  // namespace filiform
