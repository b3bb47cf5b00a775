// SPDX-License-Identifier: MIT
//
// The packets between filiform and a bridge, to the byte. device/BRIDGE.md describes the protocol. Copy this file into
// a bridge in C99, C++11 or later: it needs nothing else. All numbers are little-endian; all vectors are in frame D
// (metres, newtons, seconds; x right, y up, z towards the person). Thread rule: values and functions without state.
#pragma once

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { FB_VERSION = 1, FB_MAGIC = 0x424c4946 };  // the bytes F, I, L, B
enum { FB_CALL = 1, FB_HELLO = 2, FB_STATE = 3, FB_COMMAND = 4, FB_REFUSE = 5, FB_BYE = 6, FB_ADVICE = 7 };
enum {
  FB_HEAD_BYTES = 16,
  FB_HELLO_BYTES = 192,
  FB_STATE_BYTES = 144,
  FB_COMMAND_BYTES = 168,
  FB_REFUSE_BYTES = 24,
  FB_ADVICE_BYTES = 192,
  FB_MOST_BYTES = 192,
  FB_COOKIE_BYTES = 16,  // before each packet over UDP
  FB_NAME_BYTES = 64,
  FB_TEXT_BYTES = 176
};
// fb_hello.flags
enum {
  FB_KNOWS_VELOCITY = 1,     // STATE holds the device's own velocity; otherwise the bridge's estimate
  FB_KNOWS_ORIENTATION = 2,  // STATE holds the orientation of the stylus
  FB_IS_LED = 4,             // a simulated hand: it pulls towards fb_command.aim_D
  FB_PACES = 8,              // a STATE comes with the device's next sample; filiform needs no clock of its own
  FB_HOMES = 16,             // the device needs homing
  FB_OWN_SERVO = 32,         // the device's own thread renders: a COMMAND acts from its next period on
  FB_DELAY_SHIFT = 8         // bits 8 to 11: samples from a force to its effect in the state
};
// fb_state.flags
enum {
  FB_READY = 1,    // the device can render force
  FB_ARMED = 2,    // commands are rendered
  FB_FADING = 4,   // the force falls to zero; a command ends this only after an expiry
  FB_LOWERED = 8,  // the stiffness of the last command was above the device's limit and was lowered
  FB_FAULT = 16    // the device is lost
};
// fb_command.flags
enum {
  FB_ARM = 1,  // permits force; asked for at the beginning and after each expiry
  FB_AIM = 2   // aim_D is set
};
// fb_refuse.reason
enum { FB_OTHER_MASTER = 1, FB_OTHER_VERSION = 2, FB_OTHER_USER = 3 };

enum { FB_TTL_US = 20000 };  // longest time to live of a command

struct fb_hello {  // bridge to filiform, the answer to CALL
  uint32_t flags, buttons;
  double lo_D[3], hi_D[3];                  // workspace, m
  double peak_force_N, continuous_force_N;  // > 0; 0: unknown
  double max_stiffness_N_m, damping_Ns_m;   // 0: unknown
  double resolution_m, rate_Hz, slew_N_s;   // 0: continuous; rate of the bridge's own loop; growth of the force
  char name[FB_NAME_BYTES];                 // UTF-8, ends with a zero byte
};

struct fb_state {    // bridge to filiform, the answer to each COMMAND
  int64_t time_ns;   // of the sample, on the bridge's monotonic clock
  uint32_t answers;  // seq of the COMMAND that this STATE answers
  uint32_t flags, buttons;
  uint32_t refused;       // commands refused since HELLO
  double p_D[3], v_D[3];  // m, m/s
  double orientation[4];  // of the stylus, quaternion x y z w
  double force_N[3];      // rendered at the time of the sample
};

// filiform to bridge: a local model of the force, with the meaning of LOCAL MODEL in tools/serve/PROTOCOL.md:
// force(x) = force_N - K (x - at_D) - damping v. If x is farther than the radius, the difference is shortened to it.
struct fb_command {
  uint32_t flags;
  uint32_t ttl_us;  // the model holds for this time; more than FB_TTL_US counts as FB_TTL_US
  int64_t time_ns;  // on filiform's monotonic clock
  double force_N[3];
  double at_D[3];
  double stiffness_N_m[6];  // K, symmetric, without negative eigenvalue: xx xy xz yy yz zz
  double damping_Ns_m;      // >= 0
  double radius_m;          // >= 0
  double aim_D[3];          // for a led hand
};

struct fb_packet {
  int kind;
  uint32_t seq;  // counts the packets of the sender from 1
  union {
    struct fb_hello hello;
    struct fb_state state;
    struct fb_command command;
    uint32_t reason;           // FB_REFUSE
    char text[FB_TEXT_BYTES];  // FB_ADVICE: why the device is not ready, UTF-8, ends with a zero byte; may be empty
  } is;
};

// ---- bytes

static inline unsigned char* fb_put(unsigned char* at, uint64_t value, int bytes) {
  int i;
  for (i = 0; i < bytes; ++i) at[i] = (unsigned char)(value >> (8 * i));
  return at + bytes;
}
static inline uint64_t fb_get(const unsigned char** at, int bytes) {
  uint64_t value = 0;
  int i;
  for (i = 0; i < bytes; ++i) value |= (uint64_t)(*at)[i] << (8 * i);
  *at += bytes;
  return value;
}
static inline unsigned char* fb_put_numbers(unsigned char* at, const double* values, int count) {
  int i;
  for (i = 0; i < count; ++i) {
    uint64_t bits;
    memcpy(&bits, &values[i], 8);
    at = fb_put(at, bits, 8);
  }
  return at;
}
static inline void fb_get_numbers(const unsigned char** at, double* values, int count) {
  int i;
  for (i = 0; i < count; ++i) {
    const uint64_t bits = fb_get(at, 8);
    memcpy(&values[i], &bits, 8);
  }
}
static inline int fb_finite(const double* values, int count) {
  int i;
  for (i = 0; i < count; ++i)
    if (!isfinite(values[i])) return 0;
  return 1;
}

// Bytes of a packet of this kind; 0: no such kind.
static inline size_t fb_size(int kind) {
  switch (kind) {
    case FB_CALL:
    case FB_BYE:
      return FB_HEAD_BYTES;
    case FB_HELLO:
      return FB_HELLO_BYTES;
    case FB_STATE:
      return FB_STATE_BYTES;
    case FB_COMMAND:
      return FB_COMMAND_BYTES;
    case FB_REFUSE:
      return FB_REFUSE_BYTES;
    case FB_ADVICE:
      return FB_ADVICE_BYTES;
    default:
      return 0;
  }
}

// Writes the packet. Returns its size, at most FB_MOST_BYTES; 0 for an unknown kind.
static inline size_t fb_encode(const struct fb_packet* packet, unsigned char* bytes) {
  const size_t size = fb_size(packet->kind);
  unsigned char* at = bytes;
  if (size == 0) return 0;
  memset(bytes, 0, size);
  at = fb_put(at, FB_MAGIC, 4);
  at = fb_put(at, FB_VERSION, 2);
  at = fb_put(at, (uint64_t)packet->kind, 2);
  at = fb_put(at, packet->seq, 4);
  at = fb_put(at, size, 4);
  if (packet->kind == FB_HELLO) {
    const struct fb_hello* h = &packet->is.hello;
    at = fb_put(at, h->flags, 4);
    at = fb_put(at, h->buttons, 4);
    at = fb_put_numbers(at, h->lo_D, 3);
    at = fb_put_numbers(at, h->hi_D, 3);
    at = fb_put_numbers(at, &h->peak_force_N, 1);
    at = fb_put_numbers(at, &h->continuous_force_N, 1);
    at = fb_put_numbers(at, &h->max_stiffness_N_m, 1);
    at = fb_put_numbers(at, &h->damping_Ns_m, 1);
    at = fb_put_numbers(at, &h->resolution_m, 1);
    at = fb_put_numbers(at, &h->rate_Hz, 1);
    at = fb_put_numbers(at, &h->slew_N_s, 1);
    memcpy(at, h->name, FB_NAME_BYTES - 1);
  } else if (packet->kind == FB_STATE) {
    const struct fb_state* s = &packet->is.state;
    at = fb_put(at, (uint64_t)s->time_ns, 8);
    at = fb_put(at, s->answers, 4);
    at = fb_put(at, s->flags, 4);
    at = fb_put(at, s->buttons, 4);
    at = fb_put(at, s->refused, 4);
    at = fb_put_numbers(at, s->p_D, 3);
    at = fb_put_numbers(at, s->v_D, 3);
    at = fb_put_numbers(at, s->orientation, 4);
    fb_put_numbers(at, s->force_N, 3);
  } else if (packet->kind == FB_COMMAND) {
    const struct fb_command* c = &packet->is.command;
    at = fb_put(at, c->flags, 4);
    at = fb_put(at, c->ttl_us, 4);
    at = fb_put(at, (uint64_t)c->time_ns, 8);
    at = fb_put_numbers(at, c->force_N, 3);
    at = fb_put_numbers(at, c->at_D, 3);
    at = fb_put_numbers(at, c->stiffness_N_m, 6);
    at = fb_put_numbers(at, &c->damping_Ns_m, 1);
    at = fb_put_numbers(at, &c->radius_m, 1);
    fb_put_numbers(at, c->aim_D, 3);
  } else if (packet->kind == FB_REFUSE) {
    fb_put(at, packet->is.reason, 4);
  } else if (packet->kind == FB_ADVICE) {
    memcpy(at, packet->is.text, FB_TEXT_BYTES - 1);
  }
  return size;
}

// Reads a packet. Returns 1, or 0 if the bytes are not one whole packet of this version. Numbers may still be NaN.
static inline int fb_decode(const unsigned char* bytes, size_t size, struct fb_packet* packet) {
  const unsigned char* at = bytes;
  if (size < FB_HEAD_BYTES || fb_get(&at, 4) != (uint64_t)FB_MAGIC || fb_get(&at, 2) != (uint64_t)FB_VERSION) return 0;
  packet->kind = (int)fb_get(&at, 2);
  packet->seq = (uint32_t)fb_get(&at, 4);
  if (fb_get(&at, 4) != size || fb_size(packet->kind) != size) return 0;
  if (packet->kind == FB_HELLO) {
    struct fb_hello* h = &packet->is.hello;
    h->flags = (uint32_t)fb_get(&at, 4);
    h->buttons = (uint32_t)fb_get(&at, 4);
    fb_get_numbers(&at, h->lo_D, 3);
    fb_get_numbers(&at, h->hi_D, 3);
    fb_get_numbers(&at, &h->peak_force_N, 1);
    fb_get_numbers(&at, &h->continuous_force_N, 1);
    fb_get_numbers(&at, &h->max_stiffness_N_m, 1);
    fb_get_numbers(&at, &h->damping_Ns_m, 1);
    fb_get_numbers(&at, &h->resolution_m, 1);
    fb_get_numbers(&at, &h->rate_Hz, 1);
    fb_get_numbers(&at, &h->slew_N_s, 1);
    memcpy(h->name, at, FB_NAME_BYTES);
    h->name[FB_NAME_BYTES - 1] = 0;
  } else if (packet->kind == FB_STATE) {
    struct fb_state* s = &packet->is.state;
    s->time_ns = (int64_t)fb_get(&at, 8);
    s->answers = (uint32_t)fb_get(&at, 4);
    s->flags = (uint32_t)fb_get(&at, 4);
    s->buttons = (uint32_t)fb_get(&at, 4);
    s->refused = (uint32_t)fb_get(&at, 4);
    fb_get_numbers(&at, s->p_D, 3);
    fb_get_numbers(&at, s->v_D, 3);
    fb_get_numbers(&at, s->orientation, 4);
    fb_get_numbers(&at, s->force_N, 3);
  } else if (packet->kind == FB_COMMAND) {
    struct fb_command* c = &packet->is.command;
    c->flags = (uint32_t)fb_get(&at, 4);
    c->ttl_us = (uint32_t)fb_get(&at, 4);
    c->time_ns = (int64_t)fb_get(&at, 8);
    fb_get_numbers(&at, c->force_N, 3);
    fb_get_numbers(&at, c->at_D, 3);
    fb_get_numbers(&at, c->stiffness_N_m, 6);
    fb_get_numbers(&at, &c->damping_Ns_m, 1);
    fb_get_numbers(&at, &c->radius_m, 1);
    fb_get_numbers(&at, c->aim_D, 3);
  } else if (packet->kind == FB_REFUSE) {
    packet->is.reason = (uint32_t)fb_get(&at, 4);
  } else if (packet->kind == FB_ADVICE) {
    memcpy(packet->is.text, at, FB_TEXT_BYTES);
    packet->is.text[FB_TEXT_BYTES - 1] = 0;
  }
  return 1;
}

#ifdef __cplusplus
}
#endif
