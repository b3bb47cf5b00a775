// SPDX-License-Identifier: MIT
//
// A bridge to devices of 3D Systems (Touch, Touch X, Phantom), through the library libHD of OpenHaptics. Never tried on
// hardware. The library's frame is frame D, in millimetres. Its scheduler calls frame() in its own thread, 1000 times a
// second: each frame reads, evaluates the local model and writes.
#include "tools/bridges/bridge.h"
#include "tools/bridges/vendor_library.h"

enum {  // names and values of the library
  kDone = 0,
  kContinue = 1,
  kWarmMotors = 0x0200,
  kTooFast = 0x0203,
  kForceErrors = 0x02,  // the high byte: the force was too much, the device goes on
  kButtons = 0x2000,
  kPosition = 0x2050,
  kVelocity = 0x2051,
  kTransform = 0x2052,
  kWorkspace = 0x2551,
  kCalibrationStyle = 0x2555,
  kMostStiffness = 0x2602,
  kMostForce = 0x2603,
  kContinuousForce = 0x2604,
  kForce = 0x2700,
  kForceOutput = 0x4000,
  kPriority = 0x7fff,
  kCalibrated = 0x5000,
  kNeedsUpdate = 0x5001,
  kEncoderReset = 1,
  kMostErrors = 8
};
static const int64_t kOff_ns = 500000000, kCool_ns = 2000000000;  // without force after a force error, warm motors
static const int64_t kChecked_ns = 500000000;                     // from one check of the calibration to the next

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
  unsigned long (*schedule)(unsigned (*callback)(void*), void* data, unsigned short priority);
  void (*unschedule)(unsigned long handle);
  void (*begin)(unsigned device);
  void (*end)(unsigned device);
  void (*numbers)(unsigned what, double* values);
  void (*integers)(unsigned what, int* values);
  void (*set_numbers)(unsigned what, const double* values);
  unsigned (*calibration)(void);
  void (*calibrate)(unsigned style);
  struct hd_error (*error)(void);
  unsigned device;
  unsigned long handle;
  struct bridge* servo;
  int styles, buttons, lost, calibrated;
  int64_t off_until_ns, check_ns;
};

static int read_device(void* self, struct fb_state* state) {
  struct hd* hd = self;
  double p_mm[3], v_mm_s[3], transform[16], turn[3][3];  // the matrix by columns
  int i, j;
  hd->numbers(kPosition, p_mm);
  hd->numbers(kVelocity, v_mm_s);
  hd->numbers(kTransform, transform);
  hd->integers(kButtons, &hd->buttons);
  for (i = 0; i < 3; ++i) {
    state->p_D[i] = 1e-3 * p_mm[i];
    state->v_D[i] = 1e-3 * v_mm_s[i];
  }
  for (i = 0; i < 3; ++i)
    for (j = 0; j < 3; ++j) turn[i][j] = transform[4 * j + i];
  to_quaternion((const double(*)[3])turn, state->orientation);
  state->buttons = (uint32_t)hd->buttons;
  return hd->lost ? -1 : hd->off_until_ns == 0 && hd->calibrated;
}

static int write_force(void* self, const double force_N[3]) {
  static const double none[3] = {0, 0, 0};
  struct hd* hd = self;
  const int on = hd->off_until_ns == 0 && hd->calibrated && !hd->lost;
  hd->set_numbers(kForce, on ? force_N : none);
  return on;
}

// An inkwell calibrates the stylus that rests in it. Arms with encoders that begin at zero need a known posture.
static void check_calibration(struct hd* hd, int64_t now_ns) {
  const int before = hd->calibrated;
  unsigned needs;
  if (now_ns < hd->check_ns) return;
  hd->check_ns = now_ns + (before ? kChecked_ns : kChecked_ns / 10);
  needs = hd->calibration();
  if (needs == kNeedsUpdate || (needs != kCalibrated && hd->styles == kEncoderReset && hd->buttons != 0)) {
    // The best style: automatic, then inkwell, then a reset of the encoders.
    hd->calibrate(hd->styles & 2 ? 2 : hd->styles & 4 ? 4 : 1);
    needs = hd->calibration();
  }
  hd->calibrated = needs == kCalibrated;
  if (hd->calibrated && !before) bridge_say(hd->servo, "calibrated");
  if (!hd->calibrated && (before || hd->off_until_ns < 0))
    bridge_say(hd->servo, hd->styles == kEncoderReset
                              ? "not calibrated: hold all links of the arm at right angles and press the button"
                              : "not calibrated: put the stylus into its inkwell, then take it out");
  if (hd->off_until_ns < 0) hd->off_until_ns = 0;
}

static void judge_errors(struct hd* hd, int64_t now_ns) {
  int i;
  for (i = 0; i < kMostErrors; ++i) {
    const unsigned code = hd->error().code;
    if (code == 0) return;
    if (code >> 8 != kForceErrors) {
      if (!hd->lost) bridge_say(hd->servo, "the device was lost, or the scheduler failed: connect it and start again");
      hd->lost = 1;
      return;
    }
    if (hd->off_until_ns == 0)
      bridge_say(hd->servo, code == kWarmMotors ? "the motors are warm: no force for 2 s"
                            : code == kTooFast  ? "the hand was too fast: no force for 0.5 s"
                                                : "the force was too large for the device: no force for 0.5 s");
    hd->off_until_ns = now_ns + (code == kWarmMotors ? kCool_ns : kOff_ns);
  }
}

static unsigned frame(void* self) {
  struct hd* hd = self;
  const int64_t now_ns = bridge_now_ns();
  check_calibration(hd, now_ns);
  if (hd->off_until_ns > 0 && now_ns >= hd->off_until_ns) hd->off_until_ns = 0;
  hd->begin(hd->device);
  bridge_step(hd->servo);
  hd->end(hd->device);
  judge_errors(hd, now_ns);
  return kContinue;
}

static int start(void* self, struct bridge* servo) {
  struct hd* hd = self;
  hd->servo = servo;
  hd->handle = hd->schedule(frame, hd, kPriority);
  hd->enable(kForceOutput);
  hd->start();
  if (hd->error().code == 0) return 1;
  bridge_say(servo, "the scheduler cannot start: see whether the library's licence is valid");
  return -1;
}

static void stop(void* self) {
  struct hd* hd = self;
  hd->stop();
  hd->unschedule(hd->handle);
}

// Takes workspace and limits from the device. Returns 0 if it does not state them.
static int describe(struct hd* hd, struct fb_hello* hello) {
  double workspace_mm[6] = {0}, most_N = 0, continuous_N = 0, most_N_mm = 0;
  int i;
  hd->numbers(kWorkspace, workspace_mm);
  hd->numbers(kMostForce, &most_N);
  hd->numbers(kContinuousForce, &continuous_N);
  hd->numbers(kMostStiffness, &most_N_mm);
  hd->integers(kCalibrationStyle, &hd->styles);
  for (i = 0; i < 3; ++i) {
    hello->lo_D[i] = 1e-3 * workspace_mm[i];
    hello->hi_D[i] = 1e-3 * workspace_mm[3 + i];
  }
  hello->peak_force_N = most_N;
  hello->continuous_force_N = continuous_N;
  // Low on purpose: raise it when your device is stable at more.
  hello->max_stiffness_N_m = fmin(1e3 * most_N_mm, 500);
  return hd->error().code == 0;
}

int main(int argc, char** argv) {
  struct hd hd = {.calibrated = 1, .off_until_ns = -1};  // -1: the calibration was not yet checked
  const char *name, *address;
  struct bridge_device device = {
      .self = &hd,
      .read = read_device,
      .write = write_force,
      .start = start,
      .stop = stop,
      .hello = {.flags = FB_KNOWS_VELOCITY | FB_KNOWS_ORIENTATION, .buttons = 2, .rate_Hz = 1000}};
  void* library;
  int code;
  if (!read_arguments(argc, argv, &name, &address)) return 2;
  library = open_library("FILIFORM_LIBHD", "libHD.so");
  if (library == NULL || !find_function(library, "hdInitDevice", &hd.init) ||
      !find_function(library, "hdDisableDevice", &hd.disable) || !find_function(library, "hdEnable", &hd.enable) ||
      !find_function(library, "hdStartScheduler", &hd.start) || !find_function(library, "hdStopScheduler", &hd.stop) ||
      !find_function(library, "hdScheduleAsynchronous", &hd.schedule) ||
      !find_function(library, "hdUnschedule", &hd.unschedule) || !find_function(library, "hdBeginFrame", &hd.begin) ||
      !find_function(library, "hdEndFrame", &hd.end) || !find_function(library, "hdGetDoublev", &hd.numbers) ||
      !find_function(library, "hdGetIntegerv", &hd.integers) ||
      !find_function(library, "hdSetDoublev", &hd.set_numbers) ||
      !find_function(library, "hdCheckCalibration", &hd.calibration) ||
      !find_function(library, "hdUpdateCalibration", &hd.calibrate) || !find_function(library, "hdGetError", &hd.error))
    return 3;
  snprintf(device.hello.name, FB_NAME_BYTES, name != NULL ? "openhaptics-%.40s" : "openhaptics", name);
  hd.device = hd.init(name);
  if (hd.device == ~0u || hd.error().code != 0) {
    fprintf(stderr, "bridge: %s cannot be opened: see whether the vendor's diagnostic finds it, and under which name\n",
            name != NULL ? name : "the device of 3D Systems");
    return 3;
  }
  if (describe(&hd, &device.hello)) {
    code = bridge_run(&device, address);
  } else {
    fprintf(stderr, "bridge: the device does not state its workspace and its largest force: update its driver\n");
    code = 3;
  }
  hd.disable(hd.device);
  return code;
}
