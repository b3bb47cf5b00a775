// The documented calls of libdhd that tools/bridges/force_dimension.c uses: a device that yields 1 mm for each newton,
// and lies at (1, 2, 3) cm in the library's frame without force. Its gripper is held closed.
//
// FILIFORM_MOCK="FAULT:READ ..." names faults and the reading of the position at which they begin: off (the force was
// switched off, for 400 readings), fast (the velocity limit, likewise), reset (not calibrated, likewise); two:1: two
// devices are connected.
#include <stdlib.h>
#include <string.h>

static double force[3];
static int on, reads, opened = -1, emulates;

static int frame_of(const char* fault) {
  const char* const faults = getenv("FILIFORM_MOCK");
  const char* const found = faults != NULL ? strstr(faults, fault) : NULL;
  return found != NULL ? atoi(found + strlen(fault) + 1) : 0;
}
static int is_in(const char* fault) {
  const int begin = frame_of(fault);
  return begin > 0 && reads >= begin && reads < begin + 400;
}
static int result(char id, int value) { return id == opened && opened >= 0 ? value : -1; }

int dhdGetDeviceCount(void) { return frame_of("two") ? 2 : 1; }
int dhdOpenID(char number) { return opened = number; }
int dhdGetSerialNumber(unsigned short* number, char id) {
  *number = (unsigned short)(1203 + id);
  return result(id, 0);
}
int dhdClose(char id) {
  const int closed = result(id, 0);
  opened = -1;
  return closed;
}
int dhdEnableForce(unsigned char value, char id) {
  on = value;
  return result(id, 0);
}
int dhdGetStatus(int status[16], char id) {
  memset(status, 0, 16 * sizeof *status);
  status[3] = is_in("reset");
  status[5] = on && !is_in("off") && !is_in("fast") && !is_in("reset");
  status[14] = is_in("off") ? 1 : is_in("fast") ? 2 : 0;
  return result(id, 0);
}
int dhdGetPosition(double* x, double* y, double* z, char id) {
  ++reads;
  if (is_in("off") || is_in("fast")) force[0] = force[1] = force[2] = 0;
  *x = 0.01 + 1e-3 * force[0];
  *y = 0.02 + 1e-3 * force[1];
  *z = 0.03 + 1e-3 * force[2];
  return result(id, 1);
}
int dhdGetLinearVelocity(double* x, double* y, double* z, char id) {
  *x = 0.1;
  *y = 0.2;
  *z = 0.3;
  return result(id, 0);
}
int dhdHasGripper(char id) { return result(id, 0) == 0; }
int dhdEmulateButton(unsigned char value, char id) {
  emulates = value;
  return result(id, 0);
}
unsigned dhdGetButtonMask(char id) { return result(id, 0) == 0 && emulates ? 1 : 0; }
int dhdHasWrist(char id) { return result(id, 0) == 0; }
// A turn about z, upwards, with sine 0.96 and cosine 0.28.
int dhdGetOrientationFrame(double matrix[3][3], char id) {
  int i;
  for (i = 0; i < 3; ++i) matrix[i][0] = matrix[i][1] = matrix[i][2] = 0;
  matrix[0][0] = matrix[1][1] = 0.28;
  matrix[1][0] = 0.96;
  matrix[0][1] = -0.96;
  matrix[2][2] = 1;
  return result(id, 0);
}
int dhdSetForce(double x, double y, double z, char id) {
  force[0] = on ? x : 0;
  force[1] = on ? y : 0;
  force[2] = on ? z : 0;
  return result(id, 0);
}
const char* dhdGetSystemName(char id) { return result(id, 0) == 0 ? "mock" : ""; }
const char* dhdErrorGetLastStr(void) { return "no error"; }
