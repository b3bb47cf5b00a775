#include "device/recording/replay.h"

#include "device/simulated/null_device.h"
#include "device/simulated/simulated_hand.h"
#include "tests/support/devices/device_states.h"
#include "tests/support/temp_folder.h"

#include <bit>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <random>
#include <signal.h>
#include <sstream>
#include <sys/resource.h>
#include <thread>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::sameBits;

std::string replayMessageOf(const std::string& path) {
  try {
    ReplayDevice replay(path);
  } catch (const DeviceError& error) {
    return error.what();
  }
  return "";
}

// A device that returns arbitrary bits: NaN with payloads, negative zeros, subnormals, every status.
class WildDevice : public HapticDevice {
 public:
  explicit WildDevice(bool oriented = false) {
    capabilities_.senses_orientation = oriented;
    capabilities_.name = "wild \x01 device";
    capabilities_.workspace_lo_D = {-1, -2, -3};
    capabilities_.workspace_hi_D = {4, 5, 6};
    capabilities_.peak_force_N = 7;
    capabilities_.continuous_force_N = 8;
    capabilities_.max_stiffness_N_m = 9;
    capabilities_.damping_Ns_m = 10;
    capabilities_.resolution_m = 11;
    capabilities_.nominal_rate_Hz = 12;
    capabilities_.delay_samples = 2;
    capabilities_.buttons = 4;
    capabilities_.senses_rotation = true;
    capabilities_.rate_control = true;
    capabilities_.needs_homing = true;
    capabilities_.paces_loop = true;
  }
  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceStatus status() const noexcept override { return status_; }
  void open() override { status_ = DeviceStatus::homing; }
  void close() noexcept override { status_ = DeviceStatus::closed; }
  DeviceState exchange(const Wrench&) noexcept override {
    DeviceState s;
    const auto any = [this] { return std::bit_cast<double>(random_()); };
    s.time_s = any();
    s.p_D = {any(), any(), -0.0};
    s.v_D = {any(), std::numeric_limits<double>::denorm_min(), any()};
    s.twist_D = {any(), any(), any()};
    if (capabilities_.senses_orientation) s.orientation_D.coeffs() << any(), any(), -0.0, any();
    s.buttons = static_cast<std::uint32_t>(random_());
    s.status = static_cast<DeviceStatus>(random_() % 5);
    return s;
  }

 private:
  DeviceCapabilities capabilities_;
  DeviceStatus status_ = DeviceStatus::closed;
  std::mt19937_64 random_{7};
};

Wrench wildWrench(int i) {
  Wrench wrench;
  wrench.force_N = {std::sin(i), i % 7 == 0 ? std::numeric_limits<double>::quiet_NaN() : 0.5, -0.0};
  wrench.torque_Nm = {0, i * 1e-300, 1};
  return wrench;
}

TEST(ReplayDevice, ReturnsEveryRecordedStateBitForBit) {
  for (const auto& [writer_thread, oriented] :
       {std::pair(true, false), std::pair(false, false), std::pair(true, true)}) {
    const test::TempFolder folder;
    const std::string path = folder.file("run.rec");
    std::vector<DeviceState> states;
    {
      std::ofstream file(path, std::ios::binary);
      RecordingDevice recording(std::make_unique<WildDevice>(oriented), file, {.writer_thread = writer_thread});
      recording.open();
      for (int i = 0; i < 3000; ++i) states.push_back(recording.exchange(wildWrench(i)));
      EXPECT_FALSE(recording.whole());
      recording.finish();
      EXPECT_TRUE(recording.whole());
      recording.finish();
    }

    ReplayDevice replay(path);
    EXPECT_EQ(test::readBytes(path)[8], oriented ? 5 : 4) << "older programs read what has no orientation";
    EXPECT_EQ(replay.capabilities().senses_orientation, oriented);
    EXPECT_EQ(replay.exchanges(), 3000U);
    EXPECT_EQ(replay.status(), DeviceStatus::closed);
    for (int round = 0; round < 2; ++round) {
      replay.open();
      EXPECT_EQ(replay.status(), DeviceStatus::homing) << "as the device was when it had been opened";
      for (int i = 0; i < 3000; ++i) ASSERT_TRUE(sameBits(replay.exchange(wildWrench(i)), states[i])) << i;
      EXPECT_TRUE(replay.finished());
      EXPECT_EQ(replay.differingWrenches(), 0U);
      DeviceState last = states.back();
      last.status = DeviceStatus::closed;
      EXPECT_TRUE(sameBits(replay.exchange({}), last)) << "afterwards the hand is gone";
    }
  }
}

TEST(ReplayDevice, HasTheCapabilitiesOfTheDevice) {
  const test::TempFolder folder;
  WildDevice wild;
  {
    std::ofstream file(folder.file("r"), std::ios::binary);
    RecordingDevice recording(std::make_unique<WildDevice>(), file);
    recording.open();
    EXPECT_TRUE(recording.capabilities().paces_loop);
    recording.finish();
  }
  const ReplayDevice replay(folder.file("r"));
  const DeviceCapabilities& a = replay.capabilities();
  const DeviceCapabilities& b = wild.capabilities();
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.workspace_lo_D, b.workspace_lo_D);
  EXPECT_EQ(a.workspace_hi_D, b.workspace_hi_D);
  EXPECT_EQ(a.peak_force_N, b.peak_force_N);
  EXPECT_EQ(a.continuous_force_N, b.continuous_force_N);
  EXPECT_EQ(a.max_stiffness_N_m, b.max_stiffness_N_m);
  EXPECT_EQ(a.damping_Ns_m, b.damping_Ns_m);
  EXPECT_EQ(a.resolution_m, b.resolution_m);
  EXPECT_EQ(a.nominal_rate_Hz, b.nominal_rate_Hz);
  EXPECT_EQ(a.delay_samples, b.delay_samples);
  EXPECT_EQ(a.buttons, b.buttons);
  EXPECT_EQ(a.senses_rotation, b.senses_rotation);
  EXPECT_EQ(a.rate_control, b.rate_control);
  EXPECT_EQ(a.needs_homing, b.needs_homing);
  EXPECT_FALSE(a.paces_loop) << "a replay never blocks";
}

TEST(ReplayDevice, CountsWrenchesThatDiffer) {
  const test::TempFolder folder;
  {
    std::ofstream file(folder.file("r"), std::ios::binary);
    RecordingDevice recording(std::make_unique<NullDevice>(), file);
    recording.open();
    for (int i = 0; i < 10; ++i) recording.exchange(wildWrench(i));
    recording.finish();
  }
  ReplayDevice replay(folder.file("r"));
  replay.open();
  for (int i = 0; i < 10; ++i) {
    Wrench wrench = wildWrench(i);
    if (i == 4) wrench.force_N.z() = 0.0;  // it was a negative zero
    replay.exchange(wrench);
  }
  EXPECT_EQ(replay.differingWrenches(), 1U);
}

std::string smallRecording(const test::TempFolder& folder, bool oriented = false) {
  const std::string path = folder.file("small.rec");
  std::ofstream file(path, std::ios::binary);
  std::unique_ptr<HapticDevice> device;
  if (oriented)
    device = std::make_unique<WildDevice>(true);
  else
    device = std::make_unique<SimulatedHand>(SimulatedHandOptions{});
  RecordingDevice recording(std::move(device), file, {.writer_thread = false});
  recording.open();
  for (int i = 0; i < 5; ++i) recording.exchange(wildWrench(i));
  recording.finish();
  return test::readBytes(path);
}

TEST(ReplayDevice, SaysWhereAnyCutRecordingEnds) {
  for (const bool oriented : {false, true}) {
    const test::TempFolder folder;
    const std::string whole = smallRecording(folder, oriented);
    const std::string path = folder.file("cut.rec");
    for (std::size_t length = 0; length < whole.size(); ++length) {
      test::writeBytes(path, whole.substr(0, length));
      const std::string message = replayMessageOf(path);
      EXPECT_NE(message.find("at byte"), std::string::npos) << length << ": " << message;
      EXPECT_NE(message.find("cut"), std::string::npos) << length << ": " << message;
      EXPECT_EQ(message.rfind(path, 0), 0U) << message;
    }
    test::writeBytes(path, whole + "x");
    EXPECT_NE(replayMessageOf(path), "");
  }
}

TEST(Recording, CutAnywhereIsClosedAfterItsLastWholeExchange) {
  const test::TempFolder folder;
  const std::string file = folder.file("r");
  {
    std::ofstream out(file, std::ios::binary);
    RecordingDevice recording(std::make_unique<NullDevice>(), out);
    recording.open();
    for (int i = 0; i < 10; ++i) recording.exchange(wildWrench(i));
    recording.finish();
  }
  const std::string whole = test::readBytes(file);
  EXPECT_EQ(closeRecording(file), 10U);
  EXPECT_EQ(test::readBytes(file), whole);
  constexpr std::size_t kExchange = 200, kClosing = 24;
  const std::size_t header = whole.size() - kClosing - 10 * kExchange;
  for (std::size_t size = header; size < whole.size(); size += 7) {
    test::writeBytes(file, whole.substr(0, size));
    if (size < header + kClosing) continue;  // no room for a closing mark
    const std::size_t count = (size - header - kClosing) / kExchange;
    ASSERT_EQ(closeRecording(file), count) << size;
    EXPECT_EQ(ReplayDevice(file).exchanges(), count) << size;
    EXPECT_LE(test::readBytes(file).size(), size);
  }
  test::writeBytes(file, whole.substr(0, header / 2));
  EXPECT_THROW(closeRecording(file), DeviceError);
}

TEST(ReplayDevice, NoticesAnyFlippedByte) {
  const test::TempFolder folder;
  const std::string whole = smallRecording(folder, true);
  const std::string path = folder.file("flipped.rec");
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x10);
    test::writeBytes(path, bytes);
    EXPECT_NE(replayMessageOf(path), "") << "byte " << at;
  }
}

TEST(ReplayDevice, KeepsTheMarksOfEveryExchangeAndTheWordsOfTheDevice) {
  const test::TempFolder folder;
  const std::string path = folder.file("marked.rec");
  const auto marksOf = [](std::uint32_t i) {
    RunMarks marks;
    marks.bits = i * 2654435761u;
    marks.count = i % 7;
    for (std::uint32_t k = 0; k < marks.count; ++k) marks.values[k] = i + k;
    return marks;
  };
  std::ofstream file(path, std::ios::binary);
  RecordingDevice recording(std::make_unique<NullDevice>(), file,
                            {.device = "null", .options = "told", .marked = true});
  recording.open();
  for (std::uint32_t i = 0; i < 100; ++i) {
    recording.exchange({});
    if (i % 3 != 0) recording.mark(marksOf(i));
    recording.relax();  // its state is not used
  }
  recording.finish();
  ReplayDevice replay(path);
  EXPECT_TRUE(replay.marked());
  EXPECT_EQ(replay.device(), "null");
  EXPECT_EQ(readRecordingWords(path).device, "null");
  EXPECT_EQ(readRecordingWords(path).options, "told");
  ASSERT_EQ(replay.exchanges(), 100u);
  replay.open();
  for (std::uint32_t i = 0; i < 100; ++i) {
    replay.relax();
    replay.exchange({});
    const RunMarks expected = i % 3 != 0 ? marksOf(i) : RunMarks();
    EXPECT_EQ(replay.marks().bits, expected.bits);
    EXPECT_EQ(replay.marks().count, expected.count);
    EXPECT_EQ(replay.marks().values, expected.values);
  }
}

TEST(ReplayDevice, NamesBothVersionsOfANewerFormat) {
  const test::TempFolder folder;
  std::string bytes = smallRecording(folder);
  bytes[8] = 6;
  test::writeBytes(folder.file("new.rec"), bytes);
  const std::string message = replayMessageOf(folder.file("new.rec"));
  EXPECT_NE(message.find("version 6"), std::string::npos) << message;
  EXPECT_NE(message.find("versions 4 and 5"), std::string::npos) << message;
}

TEST(ReplayDevice, RefusesWhatIsNoRecording) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("t"), "1 1 0 0 0 1 -1\n");
  EXPECT_NE(replayMessageOf(folder.file("t")).find("not a recording"), std::string::npos);
  EXPECT_NE(replayMessageOf(folder.file("missing")).find("cannot open"), std::string::npos);
  EXPECT_NE(replayMessageOf(folder.path()).find("cannot read"), std::string::npos) << "a folder";
  EXPECT_NE(replayMessageOf(folder.file("a\nb")).find("a\\x0ab"), std::string::npos) << "one line, whatever the name";
}

TEST(RecordingDevice, PassesEverythingThrough) {
  const test::TempFolder folder;
  std::ofstream file(folder.file("r"), std::ios::binary);
  RecordingDevice recording(std::make_unique<NullDevice>(), file);
  auto& inner = dynamic_cast<NullDevice&>(recording.inner());
  EXPECT_EQ(recording.status(), DeviceStatus::closed);
  recording.open();
  EXPECT_THROW(recording.open(), DeviceError);
  inner.setPosition({0.01, 0, 0});
  Wrench wrench;
  wrench.force_N = {3, 2, 1};
  EXPECT_EQ(recording.exchange(wrench).p_D.x(), 0.01);
  EXPECT_EQ(inner.lastWrench().force_N, wrench.force_N);
  inner.setStatus(DeviceStatus::fault);
  EXPECT_EQ(recording.exchange(wrench).status, DeviceStatus::fault);
  EXPECT_EQ(recording.status(), DeviceStatus::fault);
  recording.close();
  EXPECT_EQ(recording.status(), DeviceStatus::closed);
}

TEST(RecordingDevice, KeepsTheExchangesOfARunThatNobodyFinished) {
  const test::TempFolder folder;
  {
    std::ofstream file(folder.file("r"), std::ios::binary);
    RecordingDevice recording(std::make_unique<NullDevice>(), file);
    recording.open();
    for (int i = 0; i < 7; ++i) recording.exchange({});
  }
  EXPECT_EQ(ReplayDevice(folder.file("r")).exchanges(), 7U);
}

TEST(RecordingDevice, SaysWhatItLostWhenNobodyDrained) {
  const test::TempFolder folder;
  std::ofstream file(folder.file("r"), std::ios::binary);
  RecordingDevice recording(std::make_unique<NullDevice>(), file, {.capacity = 64, .writer_thread = false});
  recording.open();
  for (int i = 0; i < 5000; ++i) recording.exchange({});
  recording.drain();
  for (int i = 0; i < 10; ++i) recording.exchange({});  // the queue has room again, after a gap
  std::string message;
  try {
    recording.finish();
  } catch (const DeviceError& error) {
    message = error.what();
  }
  const std::size_t kept = ReplayDevice(folder.file("r")).exchanges();
  EXPECT_EQ(kept, 64U);
  EXPECT_NE(message.find("the first " + std::to_string(kept) + " exchanges"), std::string::npos) << message;
  EXPECT_NE(message.find(std::to_string(5010 - kept) + " after"), std::string::npos) << message;
}

TEST(RecordingDevice, LosesNothingWhileAnotherThreadWrites) {
  const test::TempFolder folder;
  constexpr std::uint32_t kExchanges = 50000;
  {
    std::ofstream file(folder.file("r"), std::ios::binary);
    RecordingDevice recording(std::make_unique<NullDevice>(), file, {.capacity = kExchanges});
    recording.open();
    std::thread haptic([&recording] {
      auto& inner = dynamic_cast<NullDevice&>(recording.inner());
      for (std::uint32_t i = 0; i < kExchanges; ++i) {
        inner.setButtons(i);
        recording.exchange({});
      }
    });
    for (int i = 0; i < 20; ++i) recording.drain();
    haptic.join();
    recording.finish();
  }
  ReplayDevice replay(folder.file("r"));
  replay.open();
  ASSERT_EQ(replay.exchanges(), kExchanges);
  for (std::uint32_t i = 0; i < kExchanges; ++i) ASSERT_EQ(replay.exchange({}).buttons, i);
}

TEST(RecordingDevice, IsOverWhenItsStreamCannotBeWritten) {
  const test::TempFolder folder;
  {
    std::ofstream file(folder.file("no/such/folder/r"), std::ios::binary);
    RecordingDevice recording(std::make_unique<NullDevice>(), file);
    EXPECT_THROW(recording.open(), DeviceError);
    EXPECT_EQ(recording.status(), DeviceStatus::closed);
  }
  // Simulates a full disk: the kernel refuses to write beyond this size.
  const auto old_handler = signal(SIGXFSZ, SIG_IGN);
  rlimit old_limit{};
  getrlimit(RLIMIT_FSIZE, &old_limit);
  const rlimit small{20000, old_limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  for (const bool writer_thread : {true, false}) {
    std::ofstream file(folder.file("full"), std::ios::binary);
    RecordingDevice recording(std::make_unique<NullDevice>(), file, {.writer_thread = writer_thread});
    recording.open();
    for (int i = 0; i < 1000; ++i) recording.exchange({});
    EXPECT_THROW(recording.finish(), DeviceError);
    EXPECT_FALSE(recording.whole());
    EXPECT_EQ(recording.exchange({}).status, DeviceStatus::ready) << "the hand goes on";
  }
  setrlimit(RLIMIT_FSIZE, &old_limit);
  signal(SIGXFSZ, old_handler);
}

TEST(RecordingDevice, RefusesToRecordNothing) {
  std::ostringstream out;
  EXPECT_THROW(RecordingDevice(nullptr, out), DeviceError);
  EXPECT_THROW(RecordingDevice(std::make_unique<NullDevice>(), out, {.capacity = 0}), DeviceError);
}

}  // namespace
}  // namespace filiform
