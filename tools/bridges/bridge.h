// SPDX-License-Identifier: MIT
//
// Makes a device that a C program can read and write into a device of filiform. The program fills a bridge_device and
// calls bridge_run(), which listens, answers filiform (device/BRIDGE.md), and renders the local model of the force
// (bridge_force.h) at the program's own rate. Thread rule: one thread; all callbacks run on it. If `start` is set:
// read() and write() run on the thread that calls bridge_step(), the other callbacks on that of bridge_run().
#pragma once

#include "device/bridge/bridge_protocol.h"

#ifdef __cplusplus
extern "C" {
#endif

struct bridge;

struct bridge_device {
  struct fb_hello hello;  // what the device is and can; rate_Hz > 0 is the rate of read() and write()
  void* self;             // passed to the callbacks
  // Sets p_D, buttons, and what hello.flags promises of v_D and orientation. Returns 1; 0: not ready to render force;
  // -1: lost.
  int (*read)(void* self, struct fb_state* state);
  // Renders the force (N) until the next call. Returns 1; 0: the device's force is off, so it renders zero; -1: lost.
  int (*write)(void* self, const double force_N[3]);
  // Instead of read() and write(), for a device that waits for its next sample: renders the force (N) until the next
  // call, waits, then sets the state as read() does, its time_ns and the force that was sent. NULL for other devices.
  int (*exchange)(void* self, const double force_N[3], struct fb_state* state);
  // Why the device is not ready, or was lost; "" for nothing. NULL for other devices.
  const char* (*advice)(void* self);
  // For FB_IS_LED: the hand pulls towards this point (m). NULL for other devices.
  void (*lead)(void* self, const double aim_D[3]);
  // For a library that calls back in a thread of its own: begins calls of bridge_step(servo) from there, at rate_Hz.
  // Returns 1; -1: lost. stop() ends these calls. NULL: bridge_run() itself calls read() and write().
  int (*start)(void* self, struct bridge* servo);
  void (*stop)(void* self);
};

// Reads the device, obeys the newest COMMAND, and writes the force. For the servo thread of `start`. Never waits, but
// with FILIFORM_BRIDGE_LOG it writes a line of the log.
void bridge_step(struct bridge* servo);

// Prints a line for the person soon: "bridge: NAME: TEXT". `text` stays valid. Any thread; never waits.
void bridge_say(struct bridge* servo, const char* text);

// Serves one master at a time until SIGINT or SIGTERM, or until the device is lost. `address`: the path of a socket,
// udp:127.0.0.1:PORT, fd:N for a connected socket that was inherited, or NULL or "" for NAME.bridge in the folder of
// bridges. Prints a line with the address when it listens. With fd:N it ends when its master has gone and the force has
// faded. The last force written is zero. Returns the exit code of the program: 0; 2 for a wrong address or
// description; 3 for an address that cannot be used, or a lost device. FILIFORM_BRIDGE_LOG names a file for the
// rendered forces: rows of time_ns, time of the newest command (ns), mode (bridge_force.h), force (N), position x y z
// (m).
int bridge_run(const struct bridge_device* device, const char* address);

// The system's monotonic clock, ns.
int64_t bridge_now_ns(void);

#ifdef __cplusplus
}
#endif
