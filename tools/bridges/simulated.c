// SPDX-License-Identifier: MIT
//
// A bridge to a simulated device: the example to begin with. README.md explains it line by line.
#include "tools/bridges/bridge.h"

#include <stdio.h>

struct hand {  // a mass on a spring and a damper, as a hand that holds the device
  double p_D[3], v_D[3], aim_D[3], force_N[3];
  int64_t time_ns;
};

static const double kMass_kg = 0.15, kDamping_Ns_m = 5.5, kStiffness_N_m = 200, kStep_s = 1e-4;

static int read_hand(void* self, struct fb_state* state) {
  struct hand* hand = self;
  const int64_t now_ns = bridge_now_ns();
  double left_s = 1e-9 * (double)(now_ns - hand->time_ns);
  int i;
  for (left_s = left_s < 0.1 ? left_s : 0.1; left_s > 0; left_s -= kStep_s) {
    const double dt_s = left_s < kStep_s ? left_s : kStep_s;
    for (i = 0; i < 3; ++i) {
      const double pull_N = kStiffness_N_m * (hand->aim_D[i] - hand->p_D[i]) - kDamping_Ns_m * hand->v_D[i];
      hand->v_D[i] += dt_s * (pull_N + hand->force_N[i]) / kMass_kg;
      hand->p_D[i] += dt_s * hand->v_D[i];
    }
  }
  hand->time_ns = now_ns;
  for (i = 0; i < 3; ++i) {
    state->p_D[i] = hand->p_D[i];
    state->v_D[i] = hand->v_D[i];
  }
  state->buttons = 0;
  return 1;
}

static int write_force(void* self, const double force_N[3]) {
  struct hand* hand = self;
  memcpy(hand->force_N, force_N, sizeof hand->force_N);
  return 1;
}

static void lead(void* self, const double aim_D[3]) {
  struct hand* hand = self;
  memcpy(hand->aim_D, aim_D, sizeof hand->aim_D);
}

int main(int argc, char** argv) {
  struct hand hand = {.time_ns = bridge_now_ns()};
  struct bridge_device device = {
      .self = &hand,
      .read = read_hand,
      .write = write_force,
      .lead = lead,
      .hello = {.flags = FB_KNOWS_VELOCITY | FB_IS_LED,
                .lo_D = {-0.06, -0.06, -0.06},
                .hi_D = {0.06, 0.06, 0.06},
                .peak_force_N = 8,
                .continuous_force_N = 8,
                .max_stiffness_N_m = 2000,
                .damping_Ns_m = 0.5,
                .rate_Hz = 2000,
                .name = "simulated"},
  };
  if (argc > 2 || (argc == 2 && argv[1][0] == '-')) {
    fprintf(stderr, "usage: simulated [PATH | udp:127.0.0.1:PORT]\n");
    return 2;
  }
  return bridge_run(&device, argc == 2 ? argv[1] : NULL);
}
