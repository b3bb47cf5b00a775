/* Your own device in C: the program gives the position of a hand and gets the force on it, once a millisecond.
 *
 *   c_device SET.fil */
#include <filiform.h>

#include <math.h>
#include <stdio.h>

int main(int count, char **arguments) {
  if (count != 2) return fprintf(stderr, "usage: c_device SET.fil\n"), 2;
  filiform_set *set = NULL;
  filiform_travel *travel = NULL;
  filiform_travel_options options = FILIFORM_INIT(options);
  filiform_tick tick = FILIFORM_INIT(tick);
  const double start_um[3] = {0, 700, 0};
  double hand_m[3] = {0, 0, 0};
  options.realtime = 1; /* a tick never waits for the disk */
  int status = filiform_open(arguments[1], NULL, &set);
  if (status == FILIFORM_OK) status = filiform_travel_open(set, &options, &travel);
  if (status == FILIFORM_OK) status = filiform_travel_jump_to(travel, start_um);
  for (int i = 0; status == FILIFORM_OK && i < 1000; ++i) { /* your loop */
    hand_m[0] += 1e-5 + 1e-6 * tick.force_N[0];             /* read your device here */
    status = filiform_travel_tick(travel, hand_m, 0.001, &tick);
  } /* command tick.force_N here: at most 8 N */
  if (status != FILIFORM_OK) return fprintf(stderr, "c_device: %s\n", filiform_error_text()), 1;
  const double *f = tick.force_N;
  printf("after 1000 ticks: %g N\n", sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]));
  filiform_travel_close(travel);
  return filiform_close(set);
}
