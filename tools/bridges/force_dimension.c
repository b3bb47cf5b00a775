// SPDX-License-Identifier: MIT
//
// A bridge to devices of Force Dimension (omega, delta, sigma), through their library libdhd. Never tried on hardware.
// The library's frame is x towards the person, y right, z up; frame D is x right, y up, z towards the person.
#include "tools/bridges/bridge.h"
#include "tools/bridges/vendor_library.h"

struct dhd {
  int (*open)(void);
  int (*close)(char id);
  int (*enable_force)(unsigned char on, char id);
  int (*position)(double* x, double* y, double* z, char id);
  int (*velocity)(double* x, double* y, double* z, char id);
  unsigned (*buttons)(char id);
  int (*has_wrist)(char id);
  int (*orientation)(double matrix[3][3], char id);
  int (*set_force)(double x, double y, double z, char id);
  const char* (*name)(char id);
  const char* (*error)(void);
  char id;
  int turns;  // it has a wrist
};

static int read_device(void* self, struct fb_state* state) {
  const struct dhd* dhd = self;
  double x, y, z, turn_L[3][3], turn[3][3];
  int i, j;
  // 0, or 1 if the library has no newer sample; negative: an error.
  if (dhd->position(&x, &y, &z, dhd->id) < 0) return -1;
  state->p_D[0] = y;
  state->p_D[1] = z;
  state->p_D[2] = x;
  if (dhd->velocity(&x, &y, &z, dhd->id) < 0) return -1;
  state->v_D[0] = y;
  state->v_D[1] = z;
  state->v_D[2] = x;
  if (dhd->turns) {
    if (dhd->orientation(turn_L, dhd->id) < 0) return -1;
    for (i = 0; i < 3; ++i)
      for (j = 0; j < 3; ++j) turn[i][j] = turn_L[(i + 1) % 3][(j + 1) % 3];  // axes y, z, x of the library
    to_quaternion((const double(*)[3])turn, state->orientation);
  }
  state->buttons = dhd->buttons(dhd->id);
  return 1;
}

static int write_force(void* self, const double force_N[3]) {
  const struct dhd* dhd = self;
  return dhd->set_force(force_N[2], force_N[0], force_N[1], dhd->id) < 0 ? -1 : 1;
}

int main(int argc, char** argv) {
  struct dhd dhd;
  void* const library = open_library("FILIFORM_LIBDHD", "libdhd.so");
  int code, id;
  // The limits are low on purpose, because they were never tried: raise them for your device.
  struct bridge_device device = {.self = &dhd,
                                 .read = read_device,
                                 .write = write_force,
                                 .hello = {.flags = FB_KNOWS_VELOCITY,
                                           .buttons = 8,
                                           .lo_D = {-0.04, -0.04, -0.04},
                                           .hi_D = {0.04, 0.04, 0.04},
                                           .peak_force_N = 6,
                                           .max_stiffness_N_m = 1000,
                                           .rate_Hz = 2000,
                                           .name = "force-dimension"}};
  if (library == NULL || !find_function(library, "dhdOpen", &dhd.open) ||
      !find_function(library, "dhdClose", &dhd.close) || !find_function(library, "dhdEnableForce", &dhd.enable_force) ||
      !find_function(library, "dhdGetPosition", &dhd.position) ||
      !find_function(library, "dhdGetLinearVelocity", &dhd.velocity) ||
      !find_function(library, "dhdGetButtonMask", &dhd.buttons) ||
      !find_function(library, "dhdHasWrist", &dhd.has_wrist) ||
      !find_function(library, "dhdGetOrientationFrame", &dhd.orientation) ||
      !find_function(library, "dhdSetForce", &dhd.set_force) ||
      !find_function(library, "dhdGetSystemName", &dhd.name) ||
      !find_function(library, "dhdErrorGetLastStr", &dhd.error))
    return 3;
  id = dhd.open();
  if (id < 0) {
    fprintf(stderr, "bridge: no Force Dimension device can be opened: %s\n", dhd.error());
    return 3;
  }
  dhd.id = (char)id;
  dhd.turns = dhd.has_wrist(dhd.id) != 0;
  if (dhd.turns) device.hello.flags |= FB_KNOWS_ORIENTATION;
  fprintf(stderr, "bridge: %s\n", dhd.name(dhd.id));
  code = dhd.enable_force(1, dhd.id) < 0 ? 3 : bridge_run(&device, argc > 1 ? argv[1] : NULL);
  dhd.enable_force(0, dhd.id);
  dhd.close(dhd.id);
  return code;
}
