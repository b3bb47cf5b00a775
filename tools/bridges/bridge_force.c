// SPDX-License-Identifier: MIT
#include "tools/bridges/bridge_force.h"

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static double norm(const double a[3]) { return sqrt(dot(a, a)); }

// Gershgorin's bound: no eigenvalue of K is greater.
static double greatest_stiffness(const double k[6]) {
  const double x = fabs(k[0]) + fabs(k[1]) + fabs(k[2]);
  const double y = fabs(k[1]) + fabs(k[3]) + fabs(k[4]);
  const double z = fabs(k[2]) + fabs(k[4]) + fabs(k[5]);
  return fmax(x, fmax(y, z));
}

// All principal minors of a matrix without negative eigenvalue are >= 0; rounding is allowed for.
static int is_spring(const double k[6]) {
  const double most = greatest_stiffness(k), none = -1e-9 * most * most;
  const double det =
      k[0] * (k[3] * k[5] - k[4] * k[4]) - k[1] * (k[1] * k[5] - k[4] * k[2]) + k[2] * (k[1] * k[4] - k[3] * k[2]);
  return k[0] >= 0 && k[3] >= 0 && k[5] >= 0 && k[0] * k[3] - k[1] * k[1] >= none &&
         k[0] * k[5] - k[2] * k[2] >= none && k[3] * k[5] - k[4] * k[4] >= none && det >= none * most;
}

static int is_sane(const struct fb_command* c) {
  const int whole = fb_finite(c->force_N, 3) && fb_finite(c->at_D, 3) && fb_finite(c->stiffness_N_m, 6) &&
                    fb_finite(&c->damping_Ns_m, 1) && fb_finite(&c->radius_m, 1);
  if (!whole || ((c->flags & FB_AIM) != 0 && !fb_finite(c->aim_D, 3))) return 0;
  // Squares of greater numbers would overflow.
  if (norm(c->force_N) > 1e6 || norm(c->at_D) > 1e3 || greatest_stiffness(c->stiffness_N_m) > 1e9) return 0;
  return c->damping_Ns_m >= 0 && c->damping_Ns_m <= 1e6 && c->radius_m >= 0 && is_spring(c->stiffness_N_m);
}

void bridge_force_begin(struct bridge_force* force, double peak_force_N, double max_stiffness_N_m) {
  memset(force, 0, sizeof *force);
  force->limits.peak_force_N = peak_force_N;
  force->limits.max_stiffness_N_m = max_stiffness_N_m;
  force->limits.slew_N_s = 1000;
  force->limits.ramp_ns = FB_START_MS * (int64_t)1000000;
  force->limits.fade_ns = FB_FADE_MS * (int64_t)1000000;
  force->limits.resume_ns = FB_RESUME_MS * (int64_t)1000000;
}

double bridge_force_part(const struct bridge_force* force, int64_t now_ns) {
  return force->mode == BRIDGE_OFF ? 0 : fb_ramp_part(&force->ramp, (double)(now_ns - force->turned_ns));
}

// Begins a ramp of the present part, with this slope.
static void turn(struct bridge_force* force, int mode, double to, int64_t over_ns, int64_t now_ns) {
  const double from = bridge_force_part(force, now_ns);
  force->ramp.from = from;
  force->ramp.to = to;
  force->ramp.over = (double)over_ns * (mode == BRIDGE_ARMED ? to - from : 1);
  force->turned_ns = now_ns;
  force->mode = mode;
}

static void pass_time(struct bridge_force* force, int64_t now_ns) {
  if (force->mode == BRIDGE_ARMED && now_ns >= force->expires_ns) {
    if (bridge_force_part(force, force->expires_ns) >= 1) force->grow_ns = force->limits.resume_ns;
    turn(force, BRIDGE_FADING, 0, force->limits.fade_ns, force->expires_ns);
    force->resumes = 1;
  }
  if (force->mode == BRIDGE_FADING && bridge_force_part(force, now_ns) <= 0) force->mode = BRIDGE_OFF;
}

int bridge_force_command(struct bridge_force* force, uint32_t seq, const struct fb_command* command, int ready,
                         int64_t now_ns) {
  const int64_t ttl_us = command->ttl_us < FB_TTL_US ? command->ttl_us : FB_TTL_US;
  double stiffest;
  int i;
  pass_time(force, now_ns);
  if (!is_sane(command) || (force->seq != 0 && (int32_t)(seq - force->seq) <= 0)) {
    ++force->refused;
    return 0;
  }
  if (force->seq != 0) force->lost += seq - force->seq - 1;
  force->seq = seq;
  if (!ready || (force->mode == BRIDGE_FADING && !force->resumes)) return 0;
  if (force->mode == BRIDGE_OFF && (command->flags & FB_ARM) == 0) return 0;
  if (force->mode == BRIDGE_OFF) force->grow_ns = force->limits.ramp_ns;
  if (force->mode != BRIDGE_ARMED) turn(force, BRIDGE_ARMED, 1, force->grow_ns, now_ns);
  force->command = *command;
  force->expires_ns = now_ns + 1000 * ttl_us;
  stiffest = greatest_stiffness(command->stiffness_N_m);
  force->lowered = force->limits.max_stiffness_N_m > 0 && stiffest > force->limits.max_stiffness_N_m;
  for (i = 0; force->lowered && i < 6; ++i)
    force->command.stiffness_N_m[i] *= force->limits.max_stiffness_N_m / stiffest;
  return 1;
}

void bridge_force_end(struct bridge_force* force, int64_t now_ns) {
  pass_time(force, now_ns);
  if (force->mode == BRIDGE_ARMED) turn(force, BRIDGE_FADING, 0, force->limits.fade_ns, now_ns);
  force->resumes = 0;
  force->seq = 0;
}

void bridge_force_at(struct bridge_force* force, const double p_D[3], const double v_D[3], int64_t now_ns,
                     double out_N[3]) {
  const struct fb_command* c = &force->command;
  const double* k = c->stiffness_N_m;
  double d[3], moved[3], far, part, size, allowed, kept = 0, dt_s;
  int i;
  pass_time(force, now_ns);
  part = fb_finite(p_D, 3) && fb_finite(v_D, 3) ? bridge_force_part(force, now_ns) : 0;
  for (i = 0; i < 3; ++i) {
    out_N[i] = 0;
    d[i] = p_D[i] - c->at_D[i];
    moved[i] = p_D[i] - force->last_p_D[i];
  }
  dt_s = fmin(fmax(1e-9 * (double)(now_ns - force->last_ns), 0), 0.01);
  force->last_ns = now_ns;
  if (part > 0) {
    far = norm(d);
    for (i = 0; far > c->radius_m && i < 3; ++i) d[i] *= c->radius_m / far;
    out_N[0] = part * (c->force_N[0] - (k[0] * d[0] + k[1] * d[1] + k[2] * d[2]) - c->damping_Ns_m * v_D[0]);
    out_N[1] = part * (c->force_N[1] - (k[1] * d[0] + k[3] * d[1] + k[4] * d[2]) - c->damping_Ns_m * v_D[1]);
    out_N[2] = part * (c->force_N[2] - (k[2] * d[0] + k[4] * d[1] + k[5] * d[2]) - c->damping_Ns_m * v_D[2]);
    size = norm(out_N);
    // The last force along the new one, what the hand's own motion adds, and the slew.
    if (size > 0) kept = fmin(fmax(dot(force->last_N, out_N) / size, 0), size);
    allowed = kept + greatest_stiffness(k) * fmin(norm(moved), dt_s) + force->limits.slew_N_s * dt_s;
    allowed = fmin(allowed, force->limits.peak_force_N);
    for (i = 0; i < 3; ++i) out_N[i] = size <= allowed ? out_N[i] : size < 1e12 ? out_N[i] * (allowed / size) : 0;
  }
  for (i = 0; i < 3; ++i) {
    force->last_N[i] = out_N[i];
    force->last_p_D[i] = isfinite(p_D[i]) ? p_D[i] : 0;
  }
}
