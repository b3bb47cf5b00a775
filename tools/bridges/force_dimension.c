// SPDX-License-Identifier: MIT
//
// A bridge to devices of Force Dimension (omega, delta, sigma), through their library libdhd. Never tried on hardware.
// The library's frame is x towards the person, y right, z up; frame D is x right, y up, z towards the person.
#include "tools/bridges/bridge.h"
#include "tools/bridges/vendor_library.h"

// Of the library's status. Newer libraries write more numbers than older ones.
enum { kInReset = 3, kHasForce = 5, kHasError = 9, kWhyOff = 14, kMostStatus = 64, kStatusSteps = 20 };

struct dhd {
  int (*count)(void);
  int (*open)(char number);
  int (*close)(char id);
  int (*enable_force)(unsigned char on, char id);
  int (*position)(double* x, double* y, double* z, char id);
  int (*velocity)(double* x, double* y, double* z, char id);
  unsigned (*buttons)(char id);
  int (*has_gripper)(char id);
  int (*gripper_as_button)(unsigned char on, char id);
  int (*status)(int status[], char id);
  int (*serial)(unsigned short* number, char id);
  int (*has_wrist)(char id);
  int (*orientation)(double matrix[3][3], char id);
  int (*set_force)(double x, double y, double z, char id);
  const char* (*name)(char id);
  const char* (*error)(void);
  char id;
  int turns;  // it has a wrist
  int steps, ready;
  const char* said;
};

static void say(struct dhd* dhd, const char* text) {
  if (text == dhd->said) return;
  fprintf(stderr, "bridge: %s\n", text);
  dhd->said = text;
}

// Whether the controller renders force. It ends the force itself: by its switch, at a velocity, by its watchdog. Only
// the person puts it on again.
static int has_force(struct dhd* dhd) {
#define BUTTON ": press the controller's force button"
  static const char* const whys[] = {"the force is off" BUTTON, "the force was switched off" BUTTON,
                                     "the device was too fast, so the controller has switched the force off" BUTTON,
                                     "the controller's watchdog has switched the force off" BUTTON};
  static const char on[] = "the force is on", error[] = "the controller reports an error" BUTTON;
  int status[kMostStatus] = {0};
  if (dhd->steps++ % kStatusSteps != 0) return dhd->ready;
  if (dhd->status(status, dhd->id) < 0) return -1;
  if (status[kInReset]) {
    say(dhd, "the device is not calibrated: put it into its rest, and press the controller's reset button");
  } else if (status[kHasError] || !status[kHasForce]) {
    const int why = status[kWhyOff];
    say(dhd, status[kHasError] ? error : whys[why >= 0 && why <= 3 ? why : 0]);
  } else {
    if (dhd->said != NULL) say(dhd, on);
    return 1;
  }
  return 0;
}

static int read_device(void* self, struct fb_state* state) {
  struct dhd* dhd = self;
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
  return dhd->ready = has_force(dhd);
}

static int write_force(void* self, const double force_N[3]) {
  const struct dhd* dhd = self;
  const double part = dhd->ready > 0 ? 1 : 0;
  if (dhd->set_force(part * force_N[2], part * force_N[0], part * force_N[1], dhd->id) < 0) return -1;
  return dhd->ready > 0;
}

static const char* advise(void* self) {
  const struct dhd* dhd = self;
  return dhd->ready == 0 && dhd->said != NULL ? dhd->said : "";
}

// Opens the device with this serial number, or the only one. Returns 0, and says which ones there are, if it cannot.
static int open_device(struct dhd* dhd, const char* wanted) {
  char found[160] = "";
  const int count = dhd->count();
  int i;
  for (i = 0; i < count; ++i) {
    unsigned short number = 0;
    const int id = dhd->open((char)i);
    const size_t length = strlen(found);
    if (id < 0) continue;
    dhd->id = (char)id;
    dhd->serial(&number, dhd->id);
    if (wanted != NULL ? number == strtoul(wanted, NULL, 10) : count == 1) return 1;
    snprintf(found + length, sizeof found - length, "%s%s serial %u", length > 0 ? ", " : "", dhd->name(dhd->id),
             number);
    dhd->close(dhd->id);
  }
  if (found[0] != 0)
    fprintf(stderr, "bridge: name one of the devices by its serial number, as in --device 1234: %s\n", found);
  else
    fprintf(stderr, "bridge: no Force Dimension device can be opened: %s\n", dhd->error());
  return 0;
}

int main(int argc, char** argv) {
  struct dhd dhd = {.ready = 0};
  const char *wanted, *address;
  void* library;
  int code;
  // The limits are low on purpose, because they were never tried: raise them for your device.
  struct bridge_device device = {.self = &dhd,
                                 .read = read_device,
                                 .write = write_force,
                                 .advice = advise,
                                 .hello = {.flags = FB_KNOWS_VELOCITY,
                                           .buttons = 1,
                                           .lo_D = {-0.04, -0.04, -0.04},
                                           .hi_D = {0.04, 0.04, 0.04},
                                           .peak_force_N = 6,
                                           .max_stiffness_N_m = 1000,
                                           .rate_Hz = 2000}};
  if (!read_arguments(argc, argv, &wanted, &address)) return 2;
  library = open_library("FILIFORM_LIBDHD", "libdhd.so");
  if (library == NULL || !find_function(library, "dhdGetDeviceCount", &dhd.count) ||
      !find_function(library, "dhdOpenID", &dhd.open) || !find_function(library, "dhdClose", &dhd.close) ||
      !find_function(library, "dhdEnableForce", &dhd.enable_force) ||
      !find_function(library, "dhdGetPosition", &dhd.position) ||
      !find_function(library, "dhdGetLinearVelocity", &dhd.velocity) ||
      !find_function(library, "dhdGetButtonMask", &dhd.buttons) ||
      !find_function(library, "dhdHasGripper", &dhd.has_gripper) ||
      !find_function(library, "dhdEmulateButton", &dhd.gripper_as_button) ||
      !find_function(library, "dhdGetStatus", &dhd.status) ||
      !find_function(library, "dhdGetSerialNumber", &dhd.serial) ||
      !find_function(library, "dhdHasWrist", &dhd.has_wrist) ||
      !find_function(library, "dhdGetOrientationFrame", &dhd.orientation) ||
      !find_function(library, "dhdSetForce", &dhd.set_force) ||
      !find_function(library, "dhdGetSystemName", &dhd.name) ||
      !find_function(library, "dhdErrorGetLastStr", &dhd.error))
    return 3;
  if (!open_device(&dhd, wanted)) return 3;
  snprintf(device.hello.name, FB_NAME_BYTES, wanted != NULL ? "force-dimension-%.40s" : "force-dimension", wanted);
  dhd.turns = dhd.has_wrist(dhd.id) != 0;
  if (dhd.turns) device.hello.flags |= FB_KNOWS_ORIENTATION;
  if (dhd.has_gripper(dhd.id)) dhd.gripper_as_button(1, dhd.id);
  fprintf(stderr, "bridge: %s\n", dhd.name(dhd.id));
  if (dhd.enable_force(1, dhd.id) < 0) {
    fprintf(stderr, "bridge: the force cannot be switched on: %s\n", dhd.error());
    code = 3;
  } else {
    code = bridge_run(&device, address);
  }
  dhd.enable_force(0, dhd.id);
  dhd.close(dhd.id);
  return code;
}
