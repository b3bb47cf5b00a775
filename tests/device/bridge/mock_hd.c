// The documented calls of libHD that tools/bridges/openhaptics.c uses, with the library's timing: a scheduler thread
// with frames of 1 ms calls the callbacks. The device yields 1 mm for each newton, and lies at (10, 20, 30) mm without
// force. Calls outside a frame, from another thread, or out of order, end the program.
//
// FILIFORM_MOCK_HD="FAULT:FRAME ..." names faults and the frames at which they begin: warm (motors, for 200 frames,
// each of which reports an error if it has force), velocity (one error), inkwell (the stylus needs its inkwell, for 400
// frames), unplug (each frame reports an error), licence (the scheduler refuses). FILIFORM_MOCK_HD_FRAMES names a file
// for the number of frames and the last force.
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { kWarm = 0x0200, kVelocityError = 0x0203, kLost = 0x0302, kRefused = 0x0500 };

struct mock_error {
  unsigned code;
  int internal;
  unsigned device;
};
static unsigned opened, error, (*callback)(void*);
static void* callback_data;
static double force[3];
static int on, framed, calibrated = 1;
static volatile int started, frame;
static pthread_t scheduler;

static void require(int kept) {
  if (!kept) abort();
}

// The frame of a fault; 0: none.
static int frame_of(const char* fault) {
  const char* const faults = getenv("FILIFORM_MOCK_HD");
  const char* const found = faults != NULL ? strstr(faults, fault) : NULL;
  return found != NULL ? atoi(found + strlen(fault) + 1) : 0;
}

static int is_in(const char* fault, int frames) {
  const int begin = frame_of(fault);
  return begin > 0 && frame >= begin && frame - begin < frames;
}

static void* run(void* unused) {
  struct timespec due;
  (void)unused;
  clock_gettime(CLOCK_MONOTONIC, &due);
  while (started) {
    due.tv_nsec += 1000000;
    if (due.tv_nsec >= 1000000000) {
      due.tv_nsec -= 1000000000;
      ++due.tv_sec;
    }
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
    ++frame;
    if (frame == frame_of("inkwell")) calibrated = 0;
    if (callback != NULL && callback(callback_data) == 0) callback = NULL;
    require(!framed);
  }
  return NULL;
}

unsigned hdInitDevice(const char* name) {
  if (name == NULL) opened = 7;
  if (name != NULL && strcmp(name, "Left") == 0) opened = 8;
  return opened != 0 ? opened : ~0u;
}
void hdDisableDevice(unsigned device) { require(device == opened && !started); }
void hdEnable(unsigned what) { on = on || what == 0x4000; }
void hdStartScheduler(void) {
  if (frame_of("licence")) {
    error = kRefused;
    return;
  }
  started = 1;
  require(pthread_create(&scheduler, NULL, run, NULL) == 0);
}
void hdStopScheduler(void) {
  const char* const named = getenv("FILIFORM_MOCK_HD_FRAMES");
  FILE* file;
  if (!started) return;
  started = 0;
  pthread_join(scheduler, NULL);
  file = named != NULL ? fopen(named, "w") : NULL;
  if (file == NULL) return;
  fprintf(file, "%d %g %g %g\n", frame, force[0], force[1], force[2]);
  fclose(file);
}
unsigned long hdScheduleAsynchronous(unsigned (*called)(void*), void* data, unsigned short priority) {
  require(priority > 0 && callback == NULL);
  callback_data = data;
  callback = called;
  return 1;
}
void hdUnschedule(unsigned long handle) {
  require(handle == 1);
  callback = NULL;
}
unsigned hdCheckCalibration(void) {
  if (is_in("inkwell", 400)) return 0x5002;
  return calibrated ? 0x5000 : 0x5001;
}
void hdUpdateCalibration(unsigned style) {
  require(style == 4);
  calibrated = !is_in("inkwell", 400);
}
void hdBeginFrame(unsigned device) {
  require(device == opened && !framed && pthread_equal(pthread_self(), scheduler));
  framed = 1;
}
void hdEndFrame(unsigned device) {
  const int has_force = force[0] != 0 || force[1] != 0 || force[2] != 0;
  require(device == opened && framed);
  framed = 0;
  if (is_in("warm", 200) && has_force) error = kWarm;
  if (is_in("velocity", 1)) error = kVelocityError;
  if (is_in("unplug", 1 << 30)) error = kLost;
}
void hdGetDoublev(unsigned what, double* values) {
  // A turn about y with sine 0.96 and cosine 0.28, by columns.
  static const double turn[16] = {0.28, 0, -0.96, 0, 0, 1, 0, 0, 0.96, 0, 0.28, 0, 10, 20, 30, 1};
  static const double reach[6] = {-190, -135, -85, 190, 135, 85};
  int i;
  if (what == 0x2551) memcpy(values, reach, sizeof reach);
  if (what == 0x2602) *values = 0.5;  // N/mm
  if (what == 0x2603) *values = 3.4;
  if (what == 0x2604) *values = 0.9;
  if (what == 0x2551 || (what >= 0x2602 && what <= 0x2604)) return;
  require(framed && (what == 0x2050 || what == 0x2051 || what == 0x2052));
  for (i = 0; what == 0x2052 && i < 16; ++i) values[i] = turn[i];
  if (what == 0x2052) return;
  for (i = 0; i < 3; ++i) values[i] = what == 0x2050 ? 10 * (i + 1) + force[i] : 100 * (i + 1);
}
void hdGetIntegerv(unsigned what, int* values) {
  if (what == 0x2555) {
    *values = 4;
    return;
  }
  require(framed && what == 0x2000);
  *values = 2;
}
void hdSetDoublev(unsigned what, const double* values) {
  int i;
  require(framed && what == 0x2700 && on);
  for (i = 0; i < 3; ++i) force[i] = values[i];
}
struct mock_error hdGetError(void) {
  const struct mock_error found = {error, 0, opened};
  error = 0;
  return found;
}
