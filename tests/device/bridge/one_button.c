// A bridge to a simulated device with a stylus and one button: its hand goes where it is led, and presses the button
// while it is away from the person. Arguments: ADDRESS [mirrored | stiff | nan | flat]: x is turned around, or the
// description is wrong.
#include "tools/bridges/bridge.h"

static double aim_D[3], sign = 1;

static int read_hand(void* self, struct fb_state* state) {
  int i;
  (void)self;
  for (i = 0; i < 3; ++i) state->p_D[i] += 0.02 * ((i == 0 ? sign : 1) * aim_D[i] - state->p_D[i]);
  state->orientation[3] = 1;
  state->buttons = state->p_D[2] < -0.02;
  return 1;
}

static int write_force(void* self, const double force_N[3]) {
  (void)self;
  (void)force_N;
  return 1;
}

static void lead(void* self, const double to_D[3]) {
  (void)self;
  memcpy(aim_D, to_D, sizeof aim_D);
}

int main(int argc, char** argv) {
  struct bridge_device device = {.read = read_hand,
                                 .write = write_force,
                                 .lead = lead,
                                 .hello = {.flags = FB_IS_LED | FB_KNOWS_ORIENTATION,
                                           .buttons = 1,
                                           .lo_D = {-0.06, -0.06, -0.06},
                                           .hi_D = {0.06, 0.06, 0.06},
                                           .peak_force_N = 8,
                                           .max_stiffness_N_m = 1000,
                                           .rate_Hz = 1000,
                                           .name = "one-button"}};
  const char* const how = argc > 2 ? argv[2] : "";
  if (strcmp(how, "mirrored") == 0) sign = -1;
  if (strcmp(how, "stiff") == 0) device.hello.max_stiffness_N_m = 1e9;
  if (strcmp(how, "nan") == 0) device.hello.peak_force_N = NAN;
  if (strcmp(how, "flat") == 0) device.hello.hi_D[1] = device.hello.lo_D[1];
  return bridge_run(&device, argc > 1 ? argv[1] : NULL);
}
