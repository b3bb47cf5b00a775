// SPDX-License-Identifier: MIT
//
// A bridge to devices of 3D Systems (Touch, Touch X, Phantom), through the library libHD of OpenHaptics. Never tried on
// hardware. The library's frame is frame D, in millimetres. Its scheduler calls exchange_frame() in its own thread; the
// bridge waits for it.
#include "tools/bridges/bridge.h"
#include "tools/bridges/vendor_library.h"

enum {
  kInvalid = -1,
  kDone = 0,
  kButtons = 0x2000,
  kPosition = 0x2050,
  kVelocity = 0x2051,
  kTransform = 0x2052,
  kForce = 0x2700,
  kForceOutput = 0x4000,
  kPriority = 0x7fff
};

struct hd_error {
  unsigned code;
  int internal;
  unsigned device;
};

struct hd {
  unsigned (*init)(const char* name);
  void (*disable)(unsigned device);
  void (*enable)(unsigned what);
  void (*start)(void);
  void (*stop)(void);
  void (*schedule)(unsigned (*callback)(void*), void* data, unsigned short priority);
  void (*begin)(unsigned device);
  void (*end)(unsigned device);
  void (*numbers)(unsigned what, double* values);
  void (*integers)(unsigned what, int* values);
  void (*set_numbers)(unsigned what, const double* values);
  struct hd_error (*error)(void);
  unsigned device;
  double p_mm[3], v_mm_s[3], force_N[3], transform[16];  // the matrix by columns
  int buttons, lost;
};

static unsigned exchange_frame(void* self) {
  struct hd* hd = self;
  hd->begin(hd->device);
  hd->numbers(kPosition, hd->p_mm);
  hd->numbers(kVelocity, hd->v_mm_s);
  hd->numbers(kTransform, hd->transform);
  hd->integers(kButtons, &hd->buttons);
  hd->set_numbers(kForce, hd->force_N);
  hd->end(hd->device);
  hd->lost = hd->error().code != 0;
  return kDone;
}

// Renders the force of the last step, and reads.
static int read_device(void* self, struct fb_state* state) {
  struct hd* hd = self;
  double turn[3][3];
  int i, j;
  hd->schedule(exchange_frame, hd, kPriority);
  for (i = 0; i < 3; ++i) {
    state->p_D[i] = 1e-3 * hd->p_mm[i];
    state->v_D[i] = 1e-3 * hd->v_mm_s[i];
  }
  for (i = 0; i < 3; ++i)
    for (j = 0; j < 3; ++j) turn[i][j] = hd->transform[4 * j + i];
  to_quaternion((const double(*)[3])turn, state->orientation);
  state->buttons = (uint32_t)hd->buttons;
  return hd->lost ? -1 : 1;
}

static int write_force(void* self, const double force_N[3]) {
  struct hd* hd = self;
  memcpy(hd->force_N, force_N, sizeof hd->force_N);
  hd->schedule(exchange_frame, hd, kPriority);
  return hd->lost ? -1 : 1;
}

int main(int argc, char** argv) {
  struct hd hd = {.lost = 0};
  void* const library = open_library("FILIFORM_LIBHD", "libHD.so");
  int code;
  struct bridge_device device = {.self = &hd,
                                 .read = read_device,
                                 .write = write_force,
                                 .hello = {.flags = FB_KNOWS_VELOCITY | FB_KNOWS_ORIENTATION,
                                           .buttons = 2,
                                           .lo_D = {-0.08, -0.06, -0.035},
                                           .hi_D = {0.08, 0.06, 0.035},
                                           .peak_force_N = 3.3,
                                           .continuous_force_N = 0.88,
                                           .max_stiffness_N_m = 500,
                                           .rate_Hz = 500,  // a step takes two frames of the scheduler
                                           .name = "openhaptics"}};
  if (library == NULL || !find_function(library, "hdInitDevice", &hd.init) ||
      !find_function(library, "hdDisableDevice", &hd.disable) || !find_function(library, "hdEnable", &hd.enable) ||
      !find_function(library, "hdStartScheduler", &hd.start) || !find_function(library, "hdStopScheduler", &hd.stop) ||
      !find_function(library, "hdScheduleSynchronous", &hd.schedule) ||
      !find_function(library, "hdBeginFrame", &hd.begin) || !find_function(library, "hdEndFrame", &hd.end) ||
      !find_function(library, "hdGetDoublev", &hd.numbers) || !find_function(library, "hdGetIntegerv", &hd.integers) ||
      !find_function(library, "hdSetDoublev", &hd.set_numbers) || !find_function(library, "hdGetError", &hd.error))
    return 3;
  hd.device = hd.init(NULL);
  if (hd.device == (unsigned)kInvalid) {
    fprintf(stderr, "bridge: no device of 3D Systems can be opened: see whether the vendor's diagnostic finds it\n");
    return 3;
  }
  hd.enable(kForceOutput);
  hd.start();
  code = bridge_run(&device, argc > 1 ? argv[1] : NULL);
  hd.stop();
  hd.disable(hd.device);
  return code;
}
