// SPDX-License-Identifier: MIT
//
// The one rule by which forces grow after a start and fall at an end: the part of a force that is rendered, linear in
// time. The force law, the drivers and the bridges use it; each keeps the time of the begin. Copy this file into a
// bridge beside bridge_protocol.h. Thread rule: values and a function without state.
#pragma once

#ifdef __cplusplus
extern "C" {
#endif

// Milliseconds: from zero after a start; from the present part after a short silence; to zero.
enum { FB_START_MS = 500, FB_RESUME_MS = 50, FB_FADE_MS = 50 };

struct fb_ramp {
  double from, to;  // parts, 0 to 1
  double over;      // the time from one to the other, in any unit; <= 0: at once
};

// The part at a time after the begin, in the unit of `over`.
static inline double fb_ramp_part(const struct fb_ramp* ramp, double elapsed) {
  if (elapsed >= ramp->over) return ramp->to;
  return elapsed > 0 ? ramp->from + (ramp->to - ramp->from) * (elapsed / ramp->over) : ramp->from;
}

#ifdef __cplusplus
}
#endif
