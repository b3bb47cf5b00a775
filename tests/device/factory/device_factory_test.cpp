#include "device/factory/device_factory.h"

#include "device/falcon/falcon.h"
#include "device/gamepad/gamepad.h"
#include "device/haply/haply_device.h"
#include "device/recording/replay.h"
#include "device/simulated/null_device.h"
#include "device/simulated/simulated_hand.h"
#include "device/spacemouse/spacemouse.h"
#include "tests/support/temp_folder.h"

#include <fstream>

#include <gtest/gtest.h>

namespace filiform {
namespace {

TEST(DeviceFactory, MakesEveryDeviceItOffers) {
  for (const char* spec : {"sim", "sim:loose", "sim:medium", "sim:firm"}) {
    const auto device = makeDevice(spec, {.period_s = 0.002, .delay_samples = 2});
    ASSERT_NE(dynamic_cast<SimulatedHand*>(device.get()), nullptr) << spec;
    EXPECT_EQ(device->capabilities().nominal_rate_Hz, 500);
    EXPECT_EQ(device->capabilities().delay_samples, 2);
    EXPECT_EQ(device->status(), DeviceStatus::closed);
  }
  EXPECT_NE(dynamic_cast<NullDevice*>(makeDevice("null").get()), nullptr);
  for (const char* spec : {"falcon,direct", "falcon:,direct", "falcon:/no/such/file,direct", "falcon,1-2,direct",
                           "falcon:/no/such/file,1-2,direct"})
    EXPECT_NE(dynamic_cast<Falcon*>(makeDevice(spec).get()), nullptr) << spec;

  for (const char* spec : {"spacemouse", "spacemouse:1-2"}) {
    const auto device = makeDevice(spec);
    ASSERT_NE(dynamic_cast<SpaceMouse*>(device.get()), nullptr) << spec;
    EXPECT_EQ(device->status(), DeviceStatus::closed);
  }

  for (const char* spec : {"gamepad", "gamepad:/dev/input/event7"})
    EXPECT_NE(dynamic_cast<Gamepad*>(makeDevice(spec).get()), nullptr) << spec;

  for (const char* spec : {"haply", "haply,049D", "haply:localhost:10001", "haply:localhost:10001,049D"}) {
    EXPECT_NE(dynamic_cast<HaplyDevice*>(makeDevice(spec, {.direct = true}).get()), nullptr) << spec;
    EXPECT_NE(dynamic_cast<HaplyDevice*>(makeDevice(std::string(spec) + ",direct").get()), nullptr) << spec;
  }

  const test::TempFolder folder;
  const std::string path = folder.file("with:colon.rec");
  std::ofstream file(path, std::ios::binary);
  RecordingDevice recording(makeDevice("null"), file);
  recording.open();
  recording.finish();
  EXPECT_NE(dynamic_cast<ReplayDevice*>(makeDevice("replay:" + path).get()), nullptr);
}

TEST(DeviceFactory, NamesWhatThereIs) {
  for (const char* spec : {"falcons", "spacemouses", "", "nul", "null:x", "haplys", "mouse", "SIM:loose"}) {
    try {
      makeDevice(spec);
      ADD_FAILURE() << spec << " was made";
    } catch (const DeviceError& error) {
      EXPECT_NE(std::string(error.what()).find(deviceChoices()), std::string::npos) << error.what();
    }
  }
  EXPECT_THROW(makeDevice("sim:"), DeviceError);
  EXPECT_THROW(makeDevice("sim:iron"), DeviceError);
  EXPECT_THROW(makeDevice("haply:here"), UnknownDevice);
  EXPECT_THROW(makeDevice("replay:"), DeviceError);
  EXPECT_THROW(makeDevice("replay"), DeviceError);
  EXPECT_THROW(makeDevice("replay:/no/such/file"), DeviceError);
}

}  // namespace
}  // namespace filiform
