// Stands in where umockdev is not installed, so that its tests are reported as skipped.
#include <gtest/gtest.h>

TEST(SystemUsb, NeedsUmockdev) { GTEST_SKIP() << "umockdev is not installed: tools/setup installs it"; }
