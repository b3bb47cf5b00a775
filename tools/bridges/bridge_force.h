// SPDX-License-Identifier: MIT
//
// The force that a bridge renders: evaluates the local model of the newest COMMAND, and lets the force fade if no
// COMMAND comes. A state machine without a clock of its own: the caller passes the time. device/BRIDGE.md states its
// rules. Thread rule: thread-compatible.
//
//            ARM, the device is ready                 time to live is over, bye, lost
//   off  ----------------------------->  armed (ramp)  ------------------------------>  fading (50 ms)  ---->  off
//                                              <------------------------------------------
//                                               COMMAND, if the time to live was over: the ramp begins at the present
//                                               part
#pragma once

#include "device/bridge/bridge_protocol.h"
#include "device/force_ramp.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { BRIDGE_OFF = 0, BRIDGE_ARMED = 1, BRIDGE_FADING = 2 };

struct bridge_limits {
  double peak_force_N;       // > 0; a longer force is shortened and keeps its direction
  double max_stiffness_N_m;  // 0: no limit; a stiffer model is lowered in the whole
  double slew_N_s;           // > 0; limits the growth of the force that the hand's own motion does not cause
  int64_t ramp_ns;           // after ARM the force grows from zero over this time
  int64_t fade_ns;           // after the time to live the force falls to zero over this time
  int64_t resume_ns;         // a force that was full and has faded in part grows again, as fast as from zero over this
};

struct bridge_force {
  struct bridge_limits limits;
  int mode;
  struct fb_command command;  // the newest that was accepted
  uint32_t seq;               // of it; 0: none
  int64_t expires_ns;
  struct fb_ramp ramp;  // of the part of the model that is rendered, in ns since turned_ns
  int64_t turned_ns;
  int64_t grow_ns;  // how fast the force grows: ramp_ns since ARM, resume_ns once it was full
  int resumes;      // 1: a COMMAND ends the fade
  double last_N[3], last_p_D[3];
  int64_t last_ns;
  int lowered;  // 1: the stiffness of the newest command was lowered
  uint32_t refused, lost;
};

// Slew of 1000 N/s, times as in force_ramp.h.
void bridge_force_begin(struct bridge_force* force, double peak_force_N, double max_stiffness_N_m);

// Takes a COMMAND. `ready`: the device can render force. Returns 1 if the command is rendered from now on, otherwise 0.
// Refuses, and counts as refused: numbers that are not finite, a negative stiffness, damping or radius, and a seq that
// is not newer than the last one. Without effect, and not counted: a command while off without ARM, and while fading
// after bridge_force_end().
int bridge_force_command(struct bridge_force* force, uint32_t seq, const struct fb_command* command, int ready,
                         int64_t now_ns);

// The master has gone or the device is not ready: the fade begins now. The next master may begin with any seq.
void bridge_force_end(struct bridge_force* force, int64_t now_ns);

// The part of the model that is rendered at this time, 0 to 1.
double bridge_force_part(const struct bridge_force* force, int64_t now_ns);

// Sets out_N to the force (N) at p_D (m) and v_D (m/s). Times must not fall from call to call. The force is zero from
// expiry + fade_ns on, and if p_D or v_D is not finite.
void bridge_force_at(struct bridge_force* force, const double p_D[3], const double v_D[3], int64_t now_ns,
                     double out_N[3]);

#ifdef __cplusplus
}
#endif
