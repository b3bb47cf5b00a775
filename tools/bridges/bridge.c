// SPDX-License-Identifier: MIT
#include "tools/bridges/bridge.h"

#include "tools/bridges/bridge_force.h"
#include "tools/bridges/latest.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

enum { kMostPackets = 64, kPathBytes = 108 };     // packets a round: a flood must not stop the device's loop
static const int64_t kSilence_ns = 1000000000;    // over UDP, a master that is silent for so long has gone
static const int64_t kStandstill_ns = 500000000;  // a servo thread that is silent for so long has ended
static const int64_t kLastFrames_ns = 20000000;   // for a servo thread to write its last force
static const int64_t kPatience_ns = 1500000;      // exchange() waits so long for the next COMMAND of a master at 1 kHz
static const int64_t kHurry_ns = 500000;          // the same once the master is late
static const int64_t kLate_ns = 3000000;
static const double kVelocityTime_s = 0.005;      // of the low pass of an estimated velocity
static const char kLost[] = "the device was lost: connect it and start again";

struct order {  // from the sockets to the servo
  uint32_t ends, commands, seq;
  int after_end;  // the command came after the last end
  int64_t time_ns;
  struct fb_command command;
};

struct bridge {
  const struct bridge_device* device;
  // Of the thread that calls bridge_step().
  struct bridge_force force;
  struct fb_state state;  // the newest sample
  struct order obeyed;
  int64_t command_ns;
  uint32_t refused_before;
  FILE* log;
  // Between the threads.
  struct latest orders, states;
  atomic_int lost, ended;  // ended: the force is zero from now on
  _Atomic(const char*) said;
  // Of bridge_run()'s thread.
  struct order order;
  struct fb_state shown;      // the newest state
  int udp, listener, master;  // sockets; -1: none. Over UDP `listener` is the only socket
  char path[kPathBytes];      // of the socket; empty over UDP
  unsigned char cookie[FB_COOKIE_BYTES];
  struct sockaddr_in peer;  // the master over UDP
  int has_peer;
  int64_t heard_ns;
  uint32_t sent, answers, undecoded;
  int called, commanded;         // a CALL, a COMMAND wait for their answer
  int is_private;                // the master's socket was inherited: there will be no other
  const char *advised, *spoken;  // the newest advice that was sent; what bridge_say() said, until the device is ready
  int64_t spoken_ns;
};

static volatile sig_atomic_t stopped = 0;

static void stop(int signal_number) {
  (void)signal_number;
  stopped = 1;
}

int64_t bridge_now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static int complain(const char* what, const char* where) {
  fprintf(stderr, "bridge: %s: %s\n", where, what);
  return -1;
}

// ---- addresses

// The folder of bridges: XDG_RUNTIME_DIR/filiform, or /tmp/filiform-UID. Only this user may enter it.
static int make_folder(char* folder, size_t size) {
  const char* runtime = getenv("XDG_RUNTIME_DIR");
  struct stat found;
  if (runtime != NULL && runtime[0] == '/')
    snprintf(folder, size, "%s/filiform", runtime);
  else
    snprintf(folder, size, "/tmp/filiform-%u", (unsigned)geteuid());
  if (mkdir(folder, 0700) != 0 && errno != EEXIST) return complain(strerror(errno), folder);
  if (lstat(folder, &found) != 0 || !S_ISDIR(found.st_mode) || found.st_uid != geteuid() || (found.st_mode & 077) != 0)
    return complain("is not a folder that only you may enter: remove it, or set its mode to 0700", folder);
  return 0;
}

static int bind_path(struct bridge* b) {
  struct sockaddr_un address;
  struct stat found;
  mode_t mask;
  int bound;
  memset(&address, 0, sizeof address);
  address.sun_family = AF_UNIX;
  memcpy(address.sun_path, b->path, kPathBytes);
  b->listener = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (b->listener < 0) return complain(strerror(errno), b->path);
  if (lstat(b->path, &found) == 0) {
    // A socket that nobody listens at stayed behind when its bridge was killed.
    if (!S_ISSOCK(found.st_mode) || connect(b->listener, (struct sockaddr*)&address, sizeof address) == 0 ||
        errno != ECONNREFUSED)
      return complain("is in use: stop the bridge there, or choose another path", b->path);
    unlink(b->path);
    close(b->listener);
    b->listener = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  }
  mask = umask(0177);
  bound = bind(b->listener, (struct sockaddr*)&address, sizeof address);
  umask(mask);
  if (bound != 0 || listen(b->listener, 8) != 0) return complain(strerror(errno), b->path);
  return 0;
}

// The cookie: 32 hexadecimal digits in a file that only this user may read. Made if it is absent.
static int read_cookie(struct bridge* b) {
  char path[512], digits[2 * FB_COOKIE_BYTES + 1] = "";
  const char* named = getenv("FILIFORM_BRIDGE_COOKIE");
  struct stat found;
  int file, i;
  unsigned byte;
  if (named != NULL && named[0] != 0) {
    snprintf(path, sizeof path, "%s", named);
  } else {
    char folder[480];
    if (make_folder(folder, sizeof folder) != 0) return -1;
    snprintf(path, sizeof path, "%s/cookie", folder);
  }
  file = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (file >= 0) {
    if (getrandom(b->cookie, sizeof b->cookie, 0) != (ssize_t)sizeof b->cookie) return complain("no randomness", path);
    for (i = 0; i < FB_COOKIE_BYTES; ++i) snprintf(digits + 2 * i, 3, "%02x", b->cookie[i]);
    if (write(file, digits, 32) != 32) return complain("cannot be written", path);
    close(file);
    return 0;
  }
  file = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
  if (file < 0) return complain(strerror(errno), path);
  if (fstat(file, &found) != 0 || found.st_uid != geteuid() || (found.st_mode & 077) != 0 ||
      read(file, digits, 32) != 32)
    return complain("must be a file of 32 hexadecimal digits that only you may read: remove it", path);
  close(file);
  for (i = 0; i < FB_COOKIE_BYTES; ++i) {
    if (sscanf(digits + 2 * i, "%2x", &byte) != 1) return complain("has no 32 hexadecimal digits: remove it", path);
    b->cookie[i] = (unsigned char)byte;
  }
  return 0;
}

static int bind_port(struct bridge* b, const char* address) {
  struct sockaddr_in here;
  char host[32] = "", *colon;
  snprintf(host, sizeof host, "%s", address + 4);
  colon = strrchr(host, ':');
  memset(&here, 0, sizeof here);
  here.sin_family = AF_INET;
  if (colon == NULL) return complain("give udp:127.0.0.1:PORT", address);
  *colon = 0;
  here.sin_port = htons((uint16_t)atoi(colon + 1));
  if (inet_pton(AF_INET, host, &here.sin_addr) != 1 || (ntohl(here.sin_addr.s_addr) >> 24) != 127)
    return complain("only addresses of this machine are allowed: give udp:127.0.0.1:PORT", address);
  if (read_cookie(b) != 0) return -1;
  b->udp = 1;
  b->listener = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (b->listener < 0 || bind(b->listener, (struct sockaddr*)&here, sizeof here) != 0)
    return complain(strerror(errno), address);
  return 0;
}

static int listen_at(struct bridge* b, const char* address) {
  if (address != NULL && strncmp(address, "fd:", 3) == 0) {
    b->is_private = 1;
    b->master = atoi(address + 3);
    return fcntl(b->master, F_SETFD, FD_CLOEXEC) == 0 ? 0 : complain(strerror(errno), address);
  }
  if (address != NULL && strncmp(address, "udp:", 4) == 0) return bind_port(b, address);
  if (address != NULL && address[0] != 0) {
    if (strlen(address) >= kPathBytes) return complain("is too long for a socket: at most 107 bytes", address);
    snprintf(b->path, kPathBytes, "%s", address);
  } else {
    char folder[64], name[FB_NAME_BYTES];
    int i;
    snprintf(name, sizeof name, "%s", b->device->hello.name);
    for (i = 0; name[i] != 0; ++i)
      if (name[i] == '/' || name[i] == ' ') name[i] = '-';
    if (make_folder(folder, sizeof folder) != 0) return -1;
    if (snprintf(b->path, kPathBytes, "%.60s/%.38s.bridge", folder, name) >= kPathBytes) return -1;
  }
  return bind_path(b);
}

// ---- orders

static void obey(struct bridge* b, const struct order* order) {
  const int is_new = order->commands != b->obeyed.commands, ended = order->ends != b->obeyed.ends;
  const int ready = (b->state.flags & FB_READY) != 0;
  int taken = is_new && !order->after_end &&
              bridge_force_command(&b->force, order->seq, &order->command, ready, order->time_ns);
  if (ended) {
    bridge_force_end(&b->force, order->time_ns);
    b->refused_before = b->force.refused;
  }
  if (is_new && order->after_end)
    taken = bridge_force_command(&b->force, order->seq, &order->command, ready, order->time_ns);
  if (taken) b->command_ns = order->time_ns;
  b->obeyed = *order;
}

static void give_order(struct bridge* b, int64_t now_ns) {
  b->order.time_ns = now_ns;
  if (b->device->start != NULL)
    latest_write(&b->orders, &b->order, sizeof b->order);
  else
    obey(b, &b->order);
}

static void end_force(struct bridge* b, int64_t now_ns) {
  ++b->order.ends;
  b->order.after_end = 0;
  give_order(b, now_ns);
}

// ---- packets

static void send_packet(struct bridge* b, int socket_number, const struct sockaddr_in* to, struct fb_packet* packet) {
  unsigned char bytes[FB_COOKIE_BYTES + FB_MOST_BYTES];
  size_t size;
  packet->seq = ++b->sent;
  size = fb_encode(packet, bytes + FB_COOKIE_BYTES);
  memcpy(bytes, b->cookie, FB_COOKIE_BYTES);
  // A packet for which there is no room is lost; its reader is behind.
  if (to != NULL)
    (void)!sendto(socket_number, bytes, FB_COOKIE_BYTES + size, MSG_NOSIGNAL | MSG_DONTWAIT, (const struct sockaddr*)to,
                  sizeof *to);
  else
    (void)!send(socket_number, bytes + FB_COOKIE_BYTES, size, MSG_NOSIGNAL | MSG_DONTWAIT);
}

static void refuse(struct bridge* b, int socket_number, const struct sockaddr_in* to, uint32_t reason) {
  struct fb_packet packet;
  memset(&packet, 0, sizeof packet);
  packet.kind = FB_REFUSE;
  packet.is.reason = reason;
  send_packet(b, socket_number, to, &packet);
}

static void drop_master(struct bridge* b, int64_t now_ns) {
  if (b->master >= 0) close(b->master);
  b->master = -1;
  b->has_peer = b->called = b->commanded = 0;
  end_force(b, now_ns);
}

static void take(struct bridge* b, const unsigned char* bytes, size_t size, int64_t now_ns) {
  struct fb_packet packet;
  if (!fb_decode(bytes, size, &packet)) {
    ++b->undecoded;
    return;
  }
  b->heard_ns = now_ns;
  if (packet.kind == FB_BYE) drop_master(b, now_ns);
  if (packet.kind == FB_CALL) {
    end_force(b, now_ns);
    b->undecoded = 0;
    b->called = 1;
  }
  if (packet.kind != FB_COMMAND) return;
  b->commanded = 1;
  b->answers = b->order.seq = packet.seq;
  b->order.command = packet.is.command;
  b->order.after_end = 1;
  ++b->order.commands;
  give_order(b, now_ns);
  if (b->device->lead != NULL && (packet.is.command.flags & FB_AIM) != 0 && fb_finite(packet.is.command.aim_D, 3))
    b->device->lead(b->device->self, packet.is.command.aim_D);
}

static void read_socket(struct bridge* b, int64_t now_ns) {
  unsigned char bytes[FB_MOST_BYTES + 1];
  int i;
  for (i = 0; i < kMostPackets && b->master >= 0; ++i) {
    const ssize_t size = recv(b->master, bytes, sizeof bytes, MSG_DONTWAIT);
    if (size > 0)
      take(b, bytes, (size_t)size, now_ns);
    else if (size == 0 || (errno != EAGAIN && errno != EINTR))
      drop_master(b, now_ns);
    else
      return;
  }
}

static void read_datagrams(struct bridge* b, int64_t now_ns) {
  unsigned char bytes[FB_COOKIE_BYTES + FB_MOST_BYTES + 1];
  int i, j;
  for (i = 0; i < kMostPackets; ++i) {
    struct sockaddr_in from;
    socklen_t from_size = sizeof from;
    const ssize_t size = recvfrom(b->listener, bytes, sizeof bytes, MSG_DONTWAIT, (struct sockaddr*)&from, &from_size);
    unsigned char differs = 0;
    int is_peer, is_call;
    if (size < 0) return;
    if (size < FB_COOKIE_BYTES + FB_HEAD_BYTES) continue;
    for (j = 0; j < FB_COOKIE_BYTES; ++j) differs |= bytes[j] ^ b->cookie[j];
    if (differs != 0) continue;  // without an answer
    is_peer = b->has_peer && from.sin_port == b->peer.sin_port && from.sin_addr.s_addr == b->peer.sin_addr.s_addr;
    is_call = bytes[FB_COOKIE_BYTES + 6] == FB_CALL;
    if (!b->has_peer && is_call) {
      b->peer = from;
      b->has_peer = is_peer = 1;
    }
    if (is_peer)
      take(b, bytes + FB_COOKIE_BYTES, (size_t)size - FB_COOKIE_BYTES, now_ns);
    else if (b->has_peer && is_call)
      refuse(b, b->listener, &from, FB_OTHER_MASTER);
  }
}

static void accept_master(struct bridge* b) {
  struct ucred user;
  socklen_t size = sizeof user;
  const int arrived = accept4(b->listener, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (arrived < 0) return;
  if (getsockopt(arrived, SOL_SOCKET, SO_PEERCRED, &user, &size) != 0 || user.uid != geteuid()) {
    refuse(b, arrived, NULL, FB_OTHER_USER);
  } else if (b->master >= 0) {
    refuse(b, arrived, NULL, FB_OTHER_MASTER);
  } else {
    b->master = arrived;
    return;
  }
  close(arrived);
}

// ---- the device

static void estimate_velocity(struct fb_state* state, const double before_D[3], double dt_s) {
  int i;
  for (i = 0; i < 3; ++i)
    state->v_D[i] = (state->v_D[i] * kVelocityTime_s + state->p_D[i] - before_D[i]) / (kVelocityTime_s + dt_s);
}

void bridge_say(struct bridge* b, const char* text) { atomic_store(&b->said, text); }

// Returns as read() does.
static int read_and_write(struct bridge* b) {
  static const double none[3] = {0, 0, 0};
  const double before_D[3] = {b->state.p_D[0], b->state.p_D[1], b->state.p_D[2]};
  const int64_t before_ns = b->state.time_ns;
  const int could = b->device->read(b->device->self, &b->state);
  struct fb_state* s = &b->state;
  struct order order;
  int rendered;
  s->time_ns = bridge_now_ns();
  if (before_ns > 0 && (b->device->hello.flags & FB_KNOWS_VELOCITY) == 0)
    estimate_velocity(s, before_D, 1e-9 * (double)(s->time_ns - before_ns));
  if (b->device->start != NULL && latest_read(&b->orders, &order, sizeof order)) obey(b, &order);
  if (could <= 0) bridge_force_end(&b->force, s->time_ns);
  bridge_force_at(&b->force, s->p_D, s->v_D, s->time_ns, s->force_N);
  rendered = b->device->write(b->device->self, could < 0 || b->ended ? none : s->force_N);
  if (rendered <= 0) memcpy(s->force_N, none, sizeof none);
  return rendered < 0 ? -1 : could;
}

static int exchange(struct bridge* b) {
  double force_N[3];
  int could;
  bridge_force_at(&b->force, b->state.p_D, b->state.v_D, bridge_now_ns(), force_N);
  could = b->device->exchange(b->device->self, force_N, &b->state);
  if (could <= 0) bridge_force_end(&b->force, bridge_now_ns());
  return could;
}

void bridge_step(struct bridge* b) {
  struct fb_state* s = &b->state;
  const int could = b->device->exchange != NULL ? exchange(b) : read_and_write(b);
  if (could < 0) b->lost = 1;
  s->flags = (could > 0 ? FB_READY : 0) | (b->force.mode == BRIDGE_ARMED ? FB_ARMED : 0) |
             (b->force.mode == BRIDGE_FADING ? FB_FADING : 0) | (b->force.lowered ? FB_LOWERED : 0) |
             (b->lost ? FB_FAULT : 0);
  s->refused = b->force.refused - b->refused_before;
  latest_write(&b->states, s, sizeof *s);
  if (b->log != NULL) {
    const double* f = s->force_N;
    fprintf(b->log, "%lld %lld %d %.9g %.9g %.9g %.9g\n", (long long)bridge_now_ns(), (long long)b->command_ns,
            b->force.mode, sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]), s->p_D[0], s->p_D[1], s->p_D[2]);
  }
}

static void answer(struct bridge* b) {
  const int socket_number = b->udp ? b->listener : b->master;
  const struct sockaddr_in* to = b->udp ? &b->peer : NULL;
  struct fb_packet packet;
  const char* advice;
  if (socket_number < 0 || (b->udp && !b->has_peer)) return;
  memset(&packet, 0, sizeof packet);
  if (b->called) {
    packet.kind = FB_HELLO;
    packet.is.hello = b->device->hello;
    packet.is.hello.flags |= b->device->start != NULL ? FB_OWN_SERVO : 0;
    packet.is.hello.slew_N_s = b->force.limits.slew_N_s;
    send_packet(b, socket_number, to, &packet);
    b->advised = NULL;
  }
  advice = b->device->advice != NULL ? b->device->advice(b->device->self) : NULL;
  if (advice == NULL || (b->lost && advice[0] == 0)) advice = b->spoken;
  if ((b->commanded || b->lost) && advice != NULL) {
    if (advice != b->advised && (b->advised != NULL || advice[0] != 0)) {
      packet.kind = FB_ADVICE;
      snprintf(packet.is.text, FB_TEXT_BYTES, "%s", advice);
      send_packet(b, socket_number, to, &packet);
    }
    b->advised = advice;
  }
  if (b->commanded || b->lost) {  // the loss is told without a question
    packet.kind = FB_STATE;
    packet.is.state = b->shown;
    packet.is.state.answers = b->answers;
    packet.is.state.refused += b->undecoded;
    send_packet(b, socket_number, to, &packet);
  }
  b->called = b->commanded = 0;
}

static void print_said(struct bridge* b, const char* otherwise) {
  const char* const said = atomic_exchange(&b->said, NULL);
  if (said != NULL) {
    b->spoken = said;
    b->spoken_ns = bridge_now_ns();
  }
  if (said != NULL || otherwise != NULL) complain(said != NULL ? said : otherwise, b->device->hello.name);
}

// The newest state; without a servo thread, of now.
static void take_state(struct bridge* b, int64_t now_ns) {
  if (b->device->start == NULL) bridge_step(b);
  latest_read(&b->states, &b->shown, sizeof b->shown);
  if (b->spoken != NULL && (b->shown.flags & FB_READY) != 0 && b->shown.time_ns > b->spoken_ns) b->spoken = "";
  if (b->device->start == NULL || now_ns - b->shown.time_ns < kStandstill_ns) return;
  bridge_say(b, "the library's thread stands still: restart the vendor's driver, then the bridge");
  b->lost = 1;
}

static void serve(struct bridge* b) {
  const int64_t period_ns = b->device->start != NULL ? 10000000 : (int64_t)(1e9 / b->device->hello.rate_Hz);
  int64_t due_ns = bridge_now_ns();
  while (!stopped && !b->lost && (!b->is_private || b->master >= 0 || b->force.mode != BRIDGE_OFF)) {
    struct pollfd ready[2] = {{b->listener, POLLIN, 0}, {b->master, POLLIN, 0}};
    const int64_t wait_ns = due_ns - bridge_now_ns();
    const struct timespec wait = {0, wait_ns > 0 ? (long)wait_ns : 0};
    const int waiting = ppoll(ready, 2, &wait, NULL);
    const int64_t now_ns = bridge_now_ns();
    // The master first: the bridge must know that its master has gone before it takes another one.
    if (waiting > 0 && b->master >= 0 && ready[1].revents != 0) read_socket(b, now_ns);
    if (waiting > 0 && ready[0].revents != 0) {
      if (b->udp)
        read_datagrams(b, now_ns);
      else
        accept_master(b);
    }
    if (b->udp && b->has_peer && now_ns - b->heard_ns > kSilence_ns) drop_master(b, now_ns);
    // A command acts at once; without one the device's own rate goes on.
    const int acts = b->commanded || now_ns >= due_ns;
    if (acts) take_state(b, now_ns);
    // What a servo thread says of the loss may come just before the loss itself.
    if (!b->lost)
      print_said(b, NULL);
    else if (b->said != NULL)
      b->spoken = b->said;
    else if (b->spoken == NULL || b->spoken[0] == 0 || now_ns - b->spoken_ns > kLastFrames_ns)
      b->spoken = kLost;
    answer(b);
    if (acts && b->device->exchange != NULL)
      due_ns = bridge_now_ns() + (now_ns - b->order.time_ns < kLate_ns ? kPatience_ns : kHurry_ns);
    else if (now_ns >= due_ns)
      due_ns = now_ns - due_ns > period_ns ? now_ns + period_ns : due_ns + period_ns;
  }
}

// What filiform refuses in a description; NULL: nothing.
static const char* wrong_description(const struct fb_hello* hello) {
  int i;
  if (!(hello->rate_Hz >= 10 && hello->rate_Hz <= 1e5)) return "needs a rate of 10 to 100000 Hz";
  if (!(hello->peak_force_N > 0 && hello->peak_force_N <= 1000)) return "needs a peak force of 0 to 1000 N";
  if (!(hello->max_stiffness_N_m >= 0 && hello->max_stiffness_N_m <= 1e6))
    return "needs a greatest stiffness of 0 to 1000000 N/m";
  for (i = 0; i < 3; ++i)
    if (!(hello->lo_D[i] >= -10 && hello->hi_D[i] <= 10 && hello->hi_D[i] - hello->lo_D[i] >= 1e-3))
      return "needs a workspace at least 1 mm wide, and within 10 m";
  return NULL;
}

int bridge_run(const struct bridge_device* device, const char* address) {
  static const double none[3] = {0, 0, 0};
  const char* log = getenv("FILIFORM_BRIDGE_LOG");
  const char* const wrong = wrong_description(&device->hello);
  const struct timespec last_frames = {0, (long)kLastFrames_ns};
  struct sigaction action;
  struct bridge b;
  memset(&b, 0, sizeof b);
  b.device = device;
  b.listener = b.master = -1;
  if (wrong != NULL) {
    complain(wrong, device->hello.name);
    return 2;
  }
  bridge_force_begin(&b.force, device->hello.peak_force_N, device->hello.max_stiffness_N_m);
  if (device->hello.slew_N_s > 0) b.force.limits.slew_N_s = device->hello.slew_N_s;
  if (listen_at(&b, address) != 0) {
    if (b.listener >= 0) close(b.listener);
    return 3;
  }
  memset(&action, 0, sizeof action);
  action.sa_handler = stop;
  sigaction(SIGINT, &action, NULL);
  sigaction(SIGTERM, &action, NULL);
  if (log != NULL && log[0] != 0) b.log = fopen(log, "w");
  if (b.log != NULL) setvbuf(b.log, NULL, _IOLBF, 0);
  b.shown.time_ns = bridge_now_ns();
  if (device->start != NULL && device->start(device->self, &b) < 0) {
    b.lost = 1;
  } else {
    if (!b.is_private) printf("%s: use filiform's --device bridge:%s\n", device->hello.name, b.udp ? address : b.path);
    fflush(stdout);
    serve(&b);
  }
  b.ended = 1;
  if (device->stop != NULL) {
    nanosleep(&last_frames, NULL);
    device->stop(device->self);
  } else if (device->exchange != NULL) {
    device->exchange(device->self, none, &b.state);
  } else {
    device->write(device->self, none);
  }
  if (b.path[0] != 0) unlink(b.path);
  if (b.master >= 0) close(b.master);
  if (b.listener >= 0) close(b.listener);
  if (b.log != NULL) fclose(b.log);
  print_said(&b, b.lost && (b.spoken == NULL || b.spoken == kLost) ? kLost : NULL);
  return b.lost ? 3 : 0;
}
