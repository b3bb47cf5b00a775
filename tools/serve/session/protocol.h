// SPDX-License-Identifier: MIT
//
// The binary frames of the protocol filiform.v1, to the byte: copy this file into a client in C++11 or later.
// tools/serve/PROTOCOL.md describes the protocol. All numbers are little-endian. Thread rule: values and functions
// without state.
//
//   unsigned char bytes[filiform::v1::kHandBytes];
//   filiform::v1::encode(hand, bytes);                                  // send as a binary WebSocket frame
//   filiform::v1::Proxy proxy;
//   if (filiform::v1::decode(received, size, proxy)) render(proxy.force_N);
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace filiform {
namespace v1 {

enum : std::uint16_t { kVersion = 1 };
enum : std::uint16_t { kHandKind = 1, kProxyKind = 2, kModelKind = 3 };
enum : std::size_t { kHandBytes = 64, kProxyBytes = 96, kModelHeadBytes = 192, kMostModelBytes = 65536 };
enum : std::uint32_t { kMostUnacknowledged = 8, kMostModelNodes = 1024, kMostModelLinks = 2048 };

// Hand::flags
enum : std::uint16_t { kLetGo = 1 };  // the person let go of the device: the force is zero, the proxy rests
// Proxy::flags
enum : std::uint16_t {
  kFrontier = 1,     // the proxy rests at tiles that the server is reading
  kCapped = 2,       // the search stopped at its limit: the proxy is the best place so far
  kSilent = 4,       // no HAND came for hold_s: the force is zero, the proxy rests
  kJumpWaits = 8,    // a jump waits for its tiles
  kUnreadable = 16,  // the proxy rests at a tile that cannot be read: the force is zero
  kNoPlace = 32,     // no jump has been made yet: there is no force
};

struct Hand {                    // client to server
  std::uint32_t seq = 0;         // of this frame: greater than that of the last one
  std::int64_t t_client_ns = 0;  // any clock of the client; comes back in PROXY
  double h_D[3] = {0, 0, 0};     // position of the device, m
  std::uint32_t ack = 0;         // Proxy::seq of the newest PROXY that the client has received; 0: none
  std::uint16_t flags = 0;
  float twist_D[3] = {0, 0, 0};  // rad/s: turns the world about the proxy; 0: does not turn
};

struct Proxy {             // server to client
  std::uint32_t seq = 0;   // counts the PROXY frames that are sent, from 1
  std::uint32_t hand = 0;  // Hand::seq of the newest HAND that the tick used; 0: none
  std::uint8_t mode = 0;   // 0 constrained, 1 free
  std::uint16_t flags = 0;
  std::int64_t t_client_ns = 0;                           // of that HAND
  double p_W[3] = {0, 0, 0};                              // proxy, um
  float p_D[3] = {0, 0, 0};                               // the same point on the device, m
  float force_N[3] = {0, 0, 0};                           // on the hand
  std::uint32_t cell = UINT32_MAX, segment = UINT32_MAX;  // as in the answers of `nearest`; UINT32_MAX: none
  float t = 0;                                            // on the segment: 0 at its child, 1 at its parent
  std::uint16_t visited = 0;                              // segments that the tick tested
  std::uint16_t replaced = 0;    // PROXY frames that newer ones replaced since the last sent; at most 65535
  std::int64_t t_server_ns = 0;  // time of the tick, from the beginning of the session
};

struct ModelHead {  // server to client; nodes, then links follow
  std::uint32_t hand = 0;
  std::int64_t t_server_ns = 0;
  double h_D[3] = {0, 0, 0};                    // the point about which the force is modelled, m
  float force_N[3] = {0, 0, 0};                 // there
  float stiffness_N_m[6] = {0, 0, 0, 0, 0, 0};  // symmetric, >= 0: xx xy xz yy yz zz; force(x) = force_N - K (x - h_D)
  float radius_m = 0;                           // use the model within this distance of h_D
  float ttl_s = 0;                              // and for this time
  float most_N = 0;                             // never render more
  float um_m = 0;                               // um of world for each m of device
  double p_W[3] = {0, 0, 0};                    // proxy, um; nodes are relative to it
  float p_D[3] = {0, 0, 0};                     // the same point on the device, m
  float rotation_WD[4] = {0, 0, 0,
                          1};  // x y z w; p_W + um_m * rotation (x - p_D) is a point x of the device in the world
  std::uint32_t cell = UINT32_MAX, segment = UINT32_MAX;  // of the proxy
  std::uint16_t nodes = 0, links = 0;
  std::uint8_t full = 0;  // 1: the neighbourhood did not fit
};

// ---- bytes

inline void put(unsigned char* at, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) at[i] = static_cast<unsigned char>(value >> (8 * i));
}
inline std::uint64_t get(const unsigned char* at, int bytes) {
  std::uint64_t value = 0;
  for (int i = 0; i < bytes; ++i) value |= static_cast<std::uint64_t>(at[i]) << (8 * i);
  return value;
}
inline void putDouble(unsigned char* at, double value) {
  std::uint64_t bits;
  std::memcpy(&bits, &value, 8);
  put(at, bits, 8);
}
inline double getDouble(const unsigned char* at) {
  const std::uint64_t bits = get(at, 8);
  double value;
  std::memcpy(&value, &bits, 8);
  return value;
}
inline void putFloat(unsigned char* at, float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, 4);
  put(at, bits, 4);
}
inline float getFloat(const unsigned char* at) {
  const std::uint32_t bits = static_cast<std::uint32_t>(get(at, 4));
  float value;
  std::memcpy(&value, &bits, 4);
  return value;
}
inline bool isKind(const unsigned char* at, std::uint16_t kind) {
  return get(at, 2) == kind && get(at + 2, 2) == kVersion;
}

// `at` has room for kHandBytes.
inline void encode(const Hand& hand, unsigned char* at) {
  std::memset(at, 0, kHandBytes);
  put(at, kHandKind, 2);
  put(at + 2, kVersion, 2);
  put(at + 4, hand.seq, 4);
  put(at + 8, static_cast<std::uint64_t>(hand.t_client_ns), 8);
  for (int i = 0; i < 3; ++i) putDouble(at + 16 + 8 * i, hand.h_D[i]);
  put(at + 40, hand.ack, 4);
  put(at + 44, hand.flags, 2);
  for (int i = 0; i < 3; ++i) putFloat(at + 48 + 4 * i, hand.twist_D[i]);
}

// False, with `hand` unchanged, unless the bytes are a HAND of this version. Values may be of any size, or NaN.
inline bool decode(const unsigned char* at, std::size_t size, Hand& hand) {
  if (size != kHandBytes || !isKind(at, kHandKind)) return false;
  hand.seq = static_cast<std::uint32_t>(get(at + 4, 4));
  hand.t_client_ns = static_cast<std::int64_t>(get(at + 8, 8));
  for (int i = 0; i < 3; ++i) hand.h_D[i] = getDouble(at + 16 + 8 * i);
  hand.ack = static_cast<std::uint32_t>(get(at + 40, 4));
  hand.flags = static_cast<std::uint16_t>(get(at + 44, 2));
  for (int i = 0; i < 3; ++i) hand.twist_D[i] = getFloat(at + 48 + 4 * i);
  return true;
}

// `at` has room for kProxyBytes.
inline void encode(const Proxy& proxy, unsigned char* at) {
  std::memset(at, 0, kProxyBytes);
  put(at, kProxyKind, 2);
  put(at + 2, kVersion, 2);
  put(at + 4, proxy.seq, 4);
  put(at + 8, proxy.hand, 4);
  put(at + 12, proxy.mode, 1);
  put(at + 14, proxy.flags, 2);
  put(at + 16, static_cast<std::uint64_t>(proxy.t_client_ns), 8);
  for (int i = 0; i < 3; ++i) putDouble(at + 24 + 8 * i, proxy.p_W[i]);
  for (int i = 0; i < 3; ++i) putFloat(at + 48 + 4 * i, proxy.p_D[i]);
  for (int i = 0; i < 3; ++i) putFloat(at + 60 + 4 * i, proxy.force_N[i]);
  put(at + 72, proxy.cell, 4);
  put(at + 76, proxy.segment, 4);
  putFloat(at + 80, proxy.t);
  put(at + 84, proxy.visited, 2);
  put(at + 86, proxy.replaced, 2);
  put(at + 88, static_cast<std::uint64_t>(proxy.t_server_ns), 8);
}

// False, with `proxy` unchanged, unless the bytes are a PROXY of this version.
inline bool decode(const unsigned char* at, std::size_t size, Proxy& proxy) {
  if (size != kProxyBytes || !isKind(at, kProxyKind)) return false;
  proxy.seq = static_cast<std::uint32_t>(get(at + 4, 4));
  proxy.hand = static_cast<std::uint32_t>(get(at + 8, 4));
  proxy.mode = at[12];
  proxy.flags = static_cast<std::uint16_t>(get(at + 14, 2));
  proxy.t_client_ns = static_cast<std::int64_t>(get(at + 16, 8));
  for (int i = 0; i < 3; ++i) proxy.p_W[i] = getDouble(at + 24 + 8 * i);
  for (int i = 0; i < 3; ++i) proxy.p_D[i] = getFloat(at + 48 + 4 * i);
  for (int i = 0; i < 3; ++i) proxy.force_N[i] = getFloat(at + 60 + 4 * i);
  proxy.cell = static_cast<std::uint32_t>(get(at + 72, 4));
  proxy.segment = static_cast<std::uint32_t>(get(at + 76, 4));
  proxy.t = getFloat(at + 80);
  proxy.visited = static_cast<std::uint16_t>(get(at + 84, 2));
  proxy.replaced = static_cast<std::uint16_t>(get(at + 86, 2));
  proxy.t_server_ns = static_cast<std::int64_t>(get(at + 88, 8));
  return true;
}

// Bytes of a LOCAL MODEL with its nodes and links.
inline std::size_t modelBytes(const ModelHead& model) {
  return kModelHeadBytes + 12u * static_cast<std::size_t>(model.nodes) + 4u * static_cast<std::size_t>(model.links);
}

// Writes the first kModelHeadBytes. Node i then goes to byte 192 + 12 i (three floats, um, relative to p_W), link j to
// byte 192 + 12 nodes + 4 j (the positions of two nodes, 2 bytes each).
inline void encode(const ModelHead& model, unsigned char* at) {
  std::memset(at, 0, kModelHeadBytes);
  put(at, kModelKind, 2);
  put(at + 2, kVersion, 2);
  put(at + 4, model.hand, 4);
  put(at + 8, static_cast<std::uint64_t>(model.t_server_ns), 8);
  for (int i = 0; i < 3; ++i) putDouble(at + 16 + 8 * i, model.h_D[i]);
  for (int i = 0; i < 3; ++i) putFloat(at + 40 + 4 * i, model.force_N[i]);
  for (int i = 0; i < 6; ++i) putFloat(at + 52 + 4 * i, model.stiffness_N_m[i]);
  putFloat(at + 76, model.radius_m);
  putFloat(at + 80, model.ttl_s);
  putFloat(at + 84, model.most_N);
  putFloat(at + 88, model.um_m);
  put(at + 92, model.cell, 4);
  for (int i = 0; i < 3; ++i) putDouble(at + 96 + 8 * i, model.p_W[i]);
  for (int i = 0; i < 3; ++i) putFloat(at + 120 + 4 * i, model.p_D[i]);
  for (int i = 0; i < 4; ++i) putFloat(at + 132 + 4 * i, model.rotation_WD[i]);
  put(at + 148, model.segment, 4);
  put(at + 152, model.nodes, 2);
  put(at + 154, model.links, 2);
  put(at + 156, model.full, 1);
}

// False, with `model` unchanged, unless the bytes are a whole LOCAL MODEL of this version whose links are in range.
inline bool decode(const unsigned char* at, std::size_t size, ModelHead& model) {
  if (size < kModelHeadBytes || !isKind(at, kModelKind)) return false;
  ModelHead read;
  read.hand = static_cast<std::uint32_t>(get(at + 4, 4));
  read.t_server_ns = static_cast<std::int64_t>(get(at + 8, 8));
  for (int i = 0; i < 3; ++i) read.h_D[i] = getDouble(at + 16 + 8 * i);
  for (int i = 0; i < 3; ++i) read.force_N[i] = getFloat(at + 40 + 4 * i);
  for (int i = 0; i < 6; ++i) read.stiffness_N_m[i] = getFloat(at + 52 + 4 * i);
  read.radius_m = getFloat(at + 76);
  read.ttl_s = getFloat(at + 80);
  read.most_N = getFloat(at + 84);
  read.um_m = getFloat(at + 88);
  read.cell = static_cast<std::uint32_t>(get(at + 92, 4));
  for (int i = 0; i < 3; ++i) read.p_W[i] = getDouble(at + 96 + 8 * i);
  for (int i = 0; i < 3; ++i) read.p_D[i] = getFloat(at + 120 + 4 * i);
  for (int i = 0; i < 4; ++i) read.rotation_WD[i] = getFloat(at + 132 + 4 * i);
  read.segment = static_cast<std::uint32_t>(get(at + 148, 4));
  read.nodes = static_cast<std::uint16_t>(get(at + 152, 2));
  read.links = static_cast<std::uint16_t>(get(at + 154, 2));
  read.full = at[156];
  if (size != modelBytes(read)) return false;
  const unsigned char* const links = at + kModelHeadBytes + 12u * static_cast<std::size_t>(read.nodes);
  for (std::size_t i = 0; i < 2u * static_cast<std::size_t>(read.links); ++i)
    if (get(links + 2 * i, 2) >= read.nodes) return false;
  model = read;
  return true;
}

}  // namespace v1
}  // namespace filiform
