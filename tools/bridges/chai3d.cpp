// SPDX-License-Identifier: MIT
//
// A bridge to the devices that CHAI3D 3 opens: Falcon, omega, delta, sigma, lambda, Touch, Phantom. Never run on
// hardware. CHAI3D's frame is x towards the person, y right, z up, with its origin at the centre of the workspace;
// frame D is x right, y up, z towards the person.
#include "chai3d.h"

#include "tools/bridges/bridge.h"
#include "tools/bridges/vendor_library.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <string>

namespace {

struct Opened {
  chai3d::cGenericHapticDevicePtr device;
  bool turns = false;
};

void toD(const chai3d::cVector3d& v, double v_D[3]) {
  v_D[0] = v.y();
  v_D[1] = v.z();
  v_D[2] = v.x();
}

int readDevice(void* self, fb_state* state) {
  auto& device = *static_cast<Opened*>(self)->device;
  chai3d::cVector3d p, v;
  if (!device.getPosition(p) || !device.getLinearVelocity(v)) return -1;
  toD(p, state->p_D);
  toD(v, state->v_D);
  if (static_cast<Opened*>(self)->turns) {
    chai3d::cMatrix3d turn_C;
    double turn[3][3];
    if (!device.getRotation(turn_C)) return -1;
    for (unsigned i = 0; i < 3; ++i)
      for (unsigned j = 0; j < 3; ++j) turn[i][j] = turn_C((i + 1) % 3, (j + 1) % 3);  // axes y, z, x of CHAI3D
    const double(&matrix)[3][3] = turn;
    to_quaternion(matrix, state->orientation);
  }
  unsigned held = 0;
  device.getUserSwitches(held);
  state->buttons = held;
  return 1;
}

int writeForce(void* self, const double force_N[3]) {
  return static_cast<Opened*>(self)->device->setForce(chai3d::cVector3d(force_N[2], force_N[0], force_N[1])) ? 1 : -1;
}

// CHAI3D does not state the number of buttons.
unsigned buttonsOf(const std::string& model) {
  if (model.find("alcon") != std::string::npos) return 4;
  return model.find("hantom") != std::string::npos || model.find("ouch") != std::string::npos ? 2 : 1;
}

void describe(const chai3d::cHapticDeviceInfo& info, fb_hello& hello) {
  const double side_m = info.m_workspaceRadius / std::sqrt(3.0);  // of the cube within the sphere
  for (int i = 0; i < 3; ++i) {
    hello.lo_D[i] = -side_m;
    hello.hi_D[i] = side_m;
  }
  hello.flags = FB_KNOWS_VELOCITY | (info.m_sensedRotation ? FB_KNOWS_ORIENTATION : 0);
  hello.buttons = buttonsOf(info.m_modelName);
  hello.peak_force_N = info.m_maxLinearForce;
  // Low on purpose: raise it when your device is stable at more.
  hello.max_stiffness_N_m = std::fmin(info.m_maxLinearStiffness, 500);
  hello.rate_Hz = 1000;
}

}  // namespace

int main(int argc, char** argv) {
  const char *wanted = nullptr, *address = nullptr;
  if (read_arguments(argc, argv, &wanted, &address) == 0) return 2;
  chai3d::cHapticDeviceHandler handler;
  const unsigned count = handler.getNumDevices();
  unsigned number = 0;
  const std::string text = wanted != nullptr ? wanted : "0";
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || *end != 0 || number >= count || (wanted == nullptr && count > 1)) {
    std::string list;
    for (unsigned i = 0; i < count; ++i) {
      chai3d::cHapticDeviceInfo info;
      handler.getDeviceSpecifications(info, i);
      list += (i > 0 ? ", " : "") + std::to_string(i) + " " + info.m_modelName;
    }
    if (count == 0)
      std::fprintf(stderr, "bridge: CHAI3D finds no device: connect it, and install its driver\n");
    else
      std::fprintf(stderr, "bridge: name one of the devices by its number, as in --device 1: %s\n", list.c_str());
    return 3;
  }
  Opened opened;
  if (!handler.getDevice(opened.device, number) || !opened.device->open() || !opened.device->calibrate()) {
    std::fprintf(stderr, "bridge: CHAI3D cannot open or calibrate the device: close other programs that use it\n");
    return 3;
  }
  const chai3d::cHapticDeviceInfo info = opened.device->getSpecifications();
  opened.turns = info.m_sensedRotation;
  opened.device->setEnableGripperUserSwitch(true);
  bridge_device device{};
  device.self = &opened;
  device.read = readDevice;
  device.write = writeForce;
  describe(info, device.hello);
  std::snprintf(device.hello.name, FB_NAME_BYTES, wanted != nullptr ? "chai3d-%.40s" : "chai3d", wanted);
  std::fprintf(stderr, "bridge: %s\n", info.m_modelName.c_str());
  opened.device->enableForces(true);
  const int code = bridge_run(&device, address);
  opened.device->enableForces(false);
  opened.device->close();
  return code;
}
