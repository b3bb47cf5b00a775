// The documented calls of libHD that tools/bridges/openhaptics.c uses: a device that yields 1 mm for each newton, and
// lies at (10, 20, 30) mm without force. Calls outside a frame, or out of order, end the program.
#include <stdlib.h>

struct mock_error {
  unsigned code;
  int internal;
  unsigned device;
};
static double force[3];
static int on, started, framed;

static void require(int kept) {
  if (!kept) abort();
}

unsigned hdInitDevice(const char* name) {
  require(name == NULL);
  return 7;
}
void hdDisableDevice(unsigned device) { require(device == 7 && !started); }
void hdEnable(unsigned what) { on = on || what == 0x4000; }
void hdStartScheduler(void) { started = 1; }
void hdStopScheduler(void) { started = 0; }
void hdScheduleSynchronous(unsigned (*callback)(void*), void* data, unsigned short priority) {
  require(started && priority > 0);
  require(callback(data) == 0);
}
void hdBeginFrame(unsigned device) {
  require(device == 7 && !framed);
  framed = 1;
}
void hdEndFrame(unsigned device) {
  require(device == 7 && framed);
  framed = 0;
}
void hdGetDoublev(unsigned what, double* values) {
  // A turn about y with sine 0.96 and cosine 0.28, by columns.
  static const double turn[16] = {0.28, 0, -0.96, 0, 0, 1, 0, 0, 0.96, 0, 0.28, 0, 10, 20, 30, 1};
  int i;
  require(framed && (what == 0x2050 || what == 0x2051 || what == 0x2052));
  for (i = 0; what == 0x2052 && i < 16; ++i) values[i] = turn[i];
  if (what == 0x2052) return;
  for (i = 0; i < 3; ++i) values[i] = what == 0x2050 ? 10 * (i + 1) + force[i] : 100 * (i + 1);
}
void hdGetIntegerv(unsigned what, int* values) {
  require(framed && what == 0x2000);
  *values = 2;
}
void hdSetDoublev(unsigned what, const double* values) {
  int i;
  require(framed && what == 0x2700 && on);
  for (i = 0; i < 3; ++i) force[i] = values[i];
}
struct mock_error hdGetError(void) {
  const struct mock_error none = {0, 0, 7};
  return none;
}
