/* filiform for R: functions in the form that .C() calls. R CMD SHLIB builds it; nearest.R uses it. */
#include <filiform.h>
#include <math.h>

/* For each of `count` points (x, y, z): the distance to the nearest segment, um, and the id of its cell; NaN and -1
 * if the set has no segments. `status` is not 0 after an error, and `text` then says what is wrong. */
void filiform_r_nearest(char **name, double *points, int *count, double *distance, int *cell, int *status, char **text) {
  filiform_set *set = NULL;
  filiform_hit hit;
  *status = filiform_open(*name, NULL, &set);
  for (int i = 0; *status == FILIFORM_OK && i < *count; ++i) {
    size_t found = 0;
    *status = filiform_nearest(set, points + 3 * i, NULL, &hit, &found);
    distance[i] = found == 1 ? hit.distance_um : NAN;
    cell[i] = found == 1 ? (int)hit.cell : -1;
  }
  if (*status != FILIFORM_OK) *text = (char *)filiform_error_text(); /* R copies it */
  filiform_close(set);
}
