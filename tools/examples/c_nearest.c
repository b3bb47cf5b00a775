/* Finds the segment nearest to a point, and how far along its cell the farthest tip is.
 *
 *   c_nearest SET.fil X Y Z */
#include <filiform.h>

#include <stdio.h>
#include <stdlib.h>

static int failed(void) {
  fprintf(stderr, "c_nearest: %s\n", filiform_error_text());
  return 1;
}

int main(int count, char **arguments) {
  if (count != 5) {
    fprintf(stderr, "usage: c_nearest SET.fil X Y Z\n");
    return 2;
  }
  const double point_um[3] = {atof(arguments[2]), atof(arguments[3]), atof(arguments[4])};
  filiform_set *set = NULL;
  filiform_cell *cell = NULL;
  filiform_hit hit;
  size_t found = 0;
  if (filiform_open(arguments[1], NULL, &set) != FILIFORM_OK) return failed();
  if (filiform_nearest(set, point_um, NULL, &hit, &found) != FILIFORM_OK) return failed();
  if (found == 0) return 0; /* the set is empty */

  filiform_cell_info info = FILIFORM_INIT(info);
  const filiform_place place = {.segment = hit.segment, .t = hit.t};
  filiform_place tip;
  double length_um = 0;
  if (filiform_get_cell_info(set, hit.cell, &info) != FILIFORM_OK) return failed();
  if (filiform_cell_open(set, hit.cell, &cell) != FILIFORM_OK) return failed();
  if (filiform_cell_farthest_tip(cell, place, &tip, NULL, &length_um) != FILIFORM_OK) return failed();
  printf("%s at %.17g um, %.2f um from the farthest tip\n", info.name, hit.distance_um, length_um);
  filiform_cell_close(cell);
  filiform_close(set);
  return 0;
}
