// The documented calls of libdhd that tools/bridges/force_dimension.c uses: a device that yields 1 mm for each newton,
// and lies at (1, 2, 3) cm in the library's frame without force.
static double force[3];
static int on;

int dhdOpen(void) { return 0; }
int dhdClose(char id) { return id == 0 ? 0 : -1; }
int dhdEnableForce(unsigned char value, char id) {
  on = value;
  return id == 0 ? 0 : -1;
}
int dhdGetPosition(double* x, double* y, double* z, char id) {
  *x = 0.01 + 1e-3 * force[0];
  *y = 0.02 + 1e-3 * force[1];
  *z = 0.03 + 1e-3 * force[2];
  return id == 0 ? 1 : -1;
}
int dhdGetLinearVelocity(double* x, double* y, double* z, char id) {
  *x = 0.1;
  *y = 0.2;
  *z = 0.3;
  return id == 0 ? 0 : -1;
}
unsigned dhdGetButtonMask(char id) { return id == 0 ? 5 : 0; }
int dhdHasWrist(char id) { return id == 0; }
// A turn about z, upwards, with sine 0.96 and cosine 0.28.
int dhdGetOrientationFrame(double matrix[3][3], char id) {
  int i;
  for (i = 0; i < 3; ++i) matrix[i][0] = matrix[i][1] = matrix[i][2] = 0;
  matrix[0][0] = matrix[1][1] = 0.28;
  matrix[1][0] = 0.96;
  matrix[0][1] = -0.96;
  matrix[2][2] = 1;
  return id == 0 ? 0 : -1;
}
int dhdSetForce(double x, double y, double z, char id) {
  force[0] = on ? x : 0;
  force[1] = on ? y : 0;
  force[2] = on ? z : 0;
  return id == 0 ? 0 : -1;
}
const char* dhdGetSystemName(char id) { return id == 0 ? "mock" : ""; }
const char* dhdErrorGetLastStr(void) { return "no error"; }
