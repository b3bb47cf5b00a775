#include "solver/workspace/navigation_link.h"

#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(NavigationLink, LosesNoCommand) {
  NavigationLink link;
  constexpr int kCommands = 20000;
  std::thread sender([&] {
    NavigationCommand command;
    for (int i = 0; i < kCommands; ++i) {
      command.factor = i;
      command.place.t = 2 * i;
      while (!link.commands.push(command)) std::this_thread::yield();
    }
  });
  NavigationCommand command;
  for (int i = 0; i < kCommands; ++i) {
    while (!link.commands.pop(command)) std::this_thread::yield();
    ASSERT_EQ(command.factor, i);
    ASSERT_EQ(command.place.t, 2 * i);
  }
  sender.join();
}

TEST(NavigationLink, SnapshotsArriveWholeAndNeverGoBack) {
  NavigationLink link;
  constexpr std::uint64_t kLast = 20000;
  std::thread haptic([&] {
    NavigationSnapshot snapshot;
    for (std::uint64_t i = 1; i <= kLast; ++i) {
      snapshot.tick = snapshot.frontiers = i;
      snapshot.p_W = snapshot.force_N = Vector3d::Constant(static_cast<double>(i));
      link.snapshots.publish(snapshot);
    }
  });
  NavigationSnapshot seen;
  std::uint64_t last = 0;
  while (last < kLast) {
    if (!link.snapshots.take(seen)) {
      std::this_thread::yield();
      continue;
    }
    ASSERT_GT(seen.tick, last);
    last = seen.tick;
    ASSERT_EQ(seen.frontiers, last);
    ASSERT_EQ(seen.p_W, Vector3d::Constant(static_cast<double>(last)));
    ASSERT_EQ(seen.force_N, seen.p_W);
  }
  haptic.join();
}

}  // namespace
}  // namespace filiform
