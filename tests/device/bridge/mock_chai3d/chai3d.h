// The documented classes of CHAI3D 3 that tools/bridges/chai3d.cpp uses. The devices are an omega.6 and a Falcon, which
// yield 1 mm for each newton, and lie at (1, 2, 3) cm in CHAI3D's frame without force. FILIFORM_MOCK=one: only the
// first.
#pragma once

#include <cstdlib>
#include <memory>
#include <string>

namespace chai3d {

struct cVector3d {
  cVector3d() = default;
  cVector3d(double x, double y, double z) : v{x, y, z} {}
  double x() const { return v[0]; }
  double y() const { return v[1]; }
  double z() const { return v[2]; }
  double v[3] = {};
};

struct cMatrix3d {
  double operator()(unsigned row, unsigned column) const { return m[row][column]; }
  double m[3][3] = {};
};

struct cHapticDeviceInfo {
  std::string m_modelName;
  double m_maxLinearForce = 0, m_maxLinearStiffness = 0, m_workspaceRadius = 0;
  bool m_sensedRotation = false;
};

class cGenericHapticDevice {
 public:
  bool open() { return is_open_ = true; }
  bool close() { return !(is_open_ = false); }
  bool calibrate(bool /*force*/ = false) { return is_open_; }
  bool enableForces(bool on) { return has_force_ = on; }
  void setEnableGripperUserSwitch(bool) {}
  cHapticDeviceInfo getSpecifications() const { return info; }
  bool getPosition(cVector3d& p) {
    p = cVector3d(0.01 + 1e-3 * force_.x(), 0.02 + 1e-3 * force_.y(), 0.03 + 1e-3 * force_.z());
    return is_open_;
  }
  bool getLinearVelocity(cVector3d& v) {
    v = cVector3d(0.1, 0.2, 0.3);
    return is_open_;
  }
  bool getRotation(cMatrix3d& turn) {  // about z, upwards, with sine 0.96 and cosine 0.28
    turn = cMatrix3d{{{0.28, -0.96, 0}, {0.96, 0.28, 0}, {0, 0, 1}}};
    return is_open_;
  }
  bool getUserSwitches(unsigned& held) {
    held = 1;
    return is_open_;
  }
  bool setForce(const cVector3d& force) {
    force_ = has_force_ ? force : cVector3d();
    return is_open_;
  }
  cHapticDeviceInfo info;

 private:
  bool is_open_ = false, has_force_ = false;
  cVector3d force_;
};
using cGenericHapticDevicePtr = std::shared_ptr<cGenericHapticDevice>;

class cHapticDeviceHandler {
 public:
  unsigned getNumDevices() { return std::getenv("FILIFORM_MOCK") != nullptr ? 1 : 2; }
  bool getDeviceSpecifications(cHapticDeviceInfo& info, unsigned number = 0) {
    info = number == 0 ? cHapticDeviceInfo{"omega.6", 12, 5000, 0.075, true}
                       : cHapticDeviceInfo{"Falcon", 8, 3000, 0.04, false};
    return number < getNumDevices();
  }
  bool getDevice(cGenericHapticDevicePtr& device, unsigned number = 0) {
    device = std::make_shared<cGenericHapticDevice>();
    return getDeviceSpecifications(device->info, number);
  }
};

}  // namespace chai3d
