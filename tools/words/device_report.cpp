#include "tools/words/device_report.h"

#include "device/haply/haply_device.h"

#include <cstdio>
#include <ostream>
#include <sys/utsname.h>

#include <nlohmann/json.hpp>

namespace filiform::tools {
namespace {

using Json = nlohmann::ordered_json;

Json vectorJson(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json capabilitiesJson(const DeviceCapabilities& c) {
  return {{"workspace_lo_m", vectorJson(c.workspace_lo_D)},
          {"workspace_hi_m", vectorJson(c.workspace_hi_D)},
          {"peak_force_N", c.peak_force_N},
          {"max_stiffness_N_m", c.max_stiffness_N_m},
          {"damping_Ns_m", c.damping_Ns_m},
          {"nominal_rate_Hz", c.nominal_rate_Hz},
          {"delay_samples", c.delay_samples},
          {"buttons", c.buttons},
          {"senses_rotation", c.senses_rotation}};
}

Json transportJson(const HapticDevice& device) {
  const auto* haply = dynamic_cast<const HaplyDevice*>(&device);
  if (haply == nullptr) return nullptr;
  const HaplyTransport& t = haply->transport();
  const HaplyCounters& n = haply->counters();
  return {{"version", t.version},
          {"dialect", t.dialect},
          {"period_s", t.period_s},
          {"slow_period_s", t.slow_period_s},
          {"delay_states", t.delay_states},
          {"stiffness_N_m", t.stiffness_N_m},
          {"messages", n.messages},
          {"states", n.states},
          {"unanswered", n.unanswered},
          {"unreadable", n.unreadable},
          {"jumps", n.jumps}};
}

Json walkJson(const DeviceWalkFound& walk) {
  Json springs = Json::array(), sweep = Json::array();
  for (const DeviceWalkFound::Spring& spring : walk.springs)
    springs.push_back({{"moved_m", spring.moved_m}, {"force_N", spring.force_N}, {"stopped", spring.stopped}});
  for (const DeviceWalkFound::Step& step : walk.sweep)
    sweep.push_back({{"stiffness_N_m", step.stiffness_N_m},
                     {"speed_m_s", step.speed_m_s},
                     {"reversals", step.reversals},
                     {"vibrates", step.vibrates}});
  return {{"workspace", {{"lo_m", vectorJson(walk.lo_D)}, {"hi_m", vectorJson(walk.hi_D)}}},
          {"gravity", {{"drift_m", vectorJson(walk.drift_m)}, {"fastest_m_s", walk.fastest_drift_m_s}}},
          {"springs", springs},
          {"damping", {{"taken_J", walk.damped_J}, {"fastest_m_s", walk.fastest_damped_m_s}}},
          {"sweep", sweep},
          {"sweep_stopped", walk.sweep_stopped}};
}

}  // namespace

std::string fixed(double value, int digits) {
  char text[48];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

Json deviceReport(const std::string& device_name, const HapticDevice& device, const DeviceCheck& check) {
  utsname system{};
  uname(&system);
  const DeviceCapabilities& can = device.capabilities();
  Json report{
      {"format", "filiform.device-report"},
      {"version", 1},
      {"program", FILIFORM_VERSION},
      {"system", std::string(system.sysname) + ' ' + system.release + ' ' + system.machine},
      {"device", device_name.substr(0, device_name.find(':'))},
      {"name", can.name},
      {"capabilities", capabilitiesJson(can)},
      {"transport", transportJson(device)},
      {"homing_s", check.homing_s},
      {"exchanges", check.exchanges},
      {"seconds", check.seconds},
      {"rate_Hz", check.rate_Hz},
      {"longest_gap_s", check.longest_gap_s},
      {"reports", check.reports},
      {"pressed", check.buttons},
      {"ramp", {{"force_N", check.force_N}, {"moved_m", vectorJson(check.moved_m)}, {"stopped", check.stopped}}},
      {"walk", nullptr},
      {"refusals", check.refusals}};
  if (check.walk) report["walk"] = walkJson(*check.walk);
  return report;
}

void printWalk(std::ostream& out, const DeviceWalkFound& walk, bool renders_force) {
  const Eigen::Vector3d size_mm = 1e3 * (walk.hi_D - walk.lo_D), drift_mm = 1e3 * walk.drift_m;
  out << "  reach    " << fixed(size_mm.x(), 1) << ", " << fixed(size_mm.y(), 1) << ", " << fixed(size_mm.z(), 1)
      << " mm along x, y, z\n";
  if (!renders_force) return;
  out << "  gravity  the resting handle drifted by " << fixed(drift_mm.x(), 1) << ", " << fixed(drift_mm.y(), 1) << ", "
      << fixed(drift_mm.z(), 1) << " mm\n  springs ";
  for (const DeviceWalkFound::Spring& spring : walk.springs)
    out << ' ' << fixed(1e3 * spring.moved_m, 1) << " mm at " << fixed(spring.force_N, 2) << " N"
        << (spring.stopped ? " (stopped);" : ";");
  out << "\n  damping  took " << fixed(1e3 * walk.damped_J, 2) << " mJ from the hand\n  sweep    ";
  for (const DeviceWalkFound::Step& step : walk.sweep)
    out << fixed(step.stiffness_N_m, 0) << (step.vibrates ? " vibrates" : " stable") << "; ";
  out << (walk.sweep_stopped ? "stopped: the handle moved too far" : "N/m") << '\n';
}

}  // namespace filiform::tools
