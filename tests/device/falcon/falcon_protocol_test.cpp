#include "device/falcon/falcon_protocol.h"

#include "tests/support/no_alloc_guard.h"
#include "tests/support/sanitized.h"

#include <deque>
#include <optional>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::string asCharacters(std::span<const std::uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

std::string number(std::int16_t value) {
  std::string text;
  for (int shift = 0; shift < 16; shift += 4)
    text += static_cast<char>('A' + ((static_cast<std::uint16_t>(value) >> shift) & 15));
  return text;
}

std::string reportText(const FalconReport& report, char unknown = 'A') {
  std::string text = "<";
  for (const std::int16_t count : report.counts) text += number(count);
  text += static_cast<char>('A' + report.buttons + 16 * report.homed);
  text += unknown;
  return text + ">";
}

struct Parsed {
  std::vector<FalconReport> reports;
  FalconReportParser parser;
};

Parsed parse(const std::string& text) {
  Parsed parsed;
  for (const char c : text)
    if (parsed.parser.push(static_cast<std::uint8_t>(c))) parsed.reports.push_back(parsed.parser.report());
  return parsed;
}

TEST(FalconProtocol, CommandsArePackedLeastNibbleFirst) {
  FalconCommand command;
  command.motors = {-1447, 0x1234, 4095};
  EXPECT_EQ(asCharacters(packFalconCommand(command)), "<JFKPEDCBPPPAAA>");
  command.motors = {0, -1, -4095};
  EXPECT_EQ(asCharacters(packFalconCommand(command)), "<AAAAPPPPBAAPAA>");
}

TEST(FalconProtocol, LampsAndHomingAreBitsOfOneByte) {
  const auto flag = [](const FalconCommand& command) { return packFalconCommand(command)[13]; };
  EXPECT_EQ(flag({}), 'A');
  EXPECT_EQ(flag({.homing = true}), 'A' + 1);
  EXPECT_EQ(flag({.green = true}), 'A' + 2);
  EXPECT_EQ(flag({.blue = true}), 0x45);  // as captured from the vendor's driver
  EXPECT_EQ(flag({.red = true}), 'A' + 8);
  EXPECT_EQ(flag({.green = true, .blue = true, .red = true, .homing = true}), 'A' + 15);
}

TEST(FalconProtocol, ReportsAreReadWithButtonsAndHomedBits) {
  Parsed parsed = parse("<JFKPAAAAPPPPAA>");
  ASSERT_EQ(parsed.reports.size(), 1u);
  EXPECT_EQ(parsed.reports[0].counts, (std::array<std::int16_t, 3>{-1447, 0, -1}));
  EXPECT_EQ(parsed.reports[0].buttons, 0);
  EXPECT_FALSE(parsed.reports[0].allHomed());
  for (int buttons = 0; buttons < 16; ++buttons)
    for (int homed = 0; homed < 8; ++homed) {
      FalconReport report;
      report.counts = {12, -30000, 32767};
      report.buttons = static_cast<std::uint8_t>(buttons);
      report.homed = static_cast<std::uint8_t>(homed);
      parsed = parse(reportText(report));
      ASSERT_EQ(parsed.reports.size(), 1u) << buttons << ' ' << homed;
      EXPECT_EQ(parsed.reports[0].counts, report.counts);
      EXPECT_EQ(parsed.reports[0].buttons, buttons);
      EXPECT_EQ(parsed.reports[0].homed, homed);
      EXPECT_EQ(parsed.reports[0].allHomed(), homed == 7);
    }
}

TEST(FalconProtocol, AReportOfFourteenBytesGivesNothingAndTheNextIsRead) {
  // Another driver read the end mark at byte 13 as homed = 7 and buttons = 13.
  const std::string whole = reportText({.counts = {1, 2, 3}});
  const std::string cut = whole.substr(0, 13) + ">";
  ASSERT_EQ(cut.size(), 14u);
  const Parsed parsed = parse(cut + whole);
  ASSERT_EQ(parsed.reports.size(), 1u);
  EXPECT_EQ(parsed.reports[0].counts, (std::array<std::int16_t, 3>{1, 2, 3}));
  EXPECT_EQ(parsed.parser.skipped_bytes(), 14u);
}

TEST(FalconProtocol, CutAtEveryByteTheNextReportIsReadWhole) {
  const std::string whole = reportText({.counts = {-5, 6, -7}, .buttons = 2, .homed = 7});
  for (std::size_t cut = 0; cut < whole.size(); ++cut) {
    for (const std::string& junk : {std::string(), std::string("<"), std::string("<<>A"), std::string(2, '\0')}) {
      const Parsed parsed = parse(whole.substr(0, cut) + junk + whole);
      ASSERT_EQ(parsed.reports.size(), 1u) << cut << " + " << junk;
      EXPECT_EQ(parsed.reports[0].counts, (std::array<std::int16_t, 3>{-5, 6, -7}));
      EXPECT_EQ(parsed.parser.skipped_bytes(), cut + junk.size());
    }
  }
}

TEST(FalconProtocol, NumbersOutOfRangeAreNoReport) {
  const std::string whole = reportText({.counts = {1, 2, 3}, .homed = 7});
  for (std::size_t at = 0; at < whole.size(); ++at)
    for (int value = 0; value < 256; ++value) {
      std::string changed = whole;
      changed[at] = static_cast<char>(value);
      const bool number = at >= 1 && at <= 12 && value >= 'A' && value <= 'P';
      const bool flags = at == 13 && value >= 0x41 && value <= 0xc0;
      const bool unknown = at == 14 && value != '<' && value != '>';
      const bool good = changed == whole || number || flags || unknown;
      ASSERT_EQ(parse(changed).reports.size(), good ? 1u : 0u) << at << ' ' << value;
    }
}

bool wellFormed(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 16 || bytes[0] != '<' || bytes[15] != '>') return false;
  for (std::size_t i = 1; i <= 12; ++i)
    if (bytes[i] < 'A' || bytes[i] > 'P') return false;
  return bytes[13] >= 0x41 && bytes[13] <= 0xc0 && bytes[14] != '<' && bytes[14] != '>';
}

TEST(FalconProtocol, AMillionFuzzedStreamsGiveTheirWellFormedReportsAndNoOther) {
  std::mt19937_64 random(1);
  const std::uint64_t streams = test::kSanitized ? 50'000 : 1'000'000;
  std::uint64_t accepted = 0;
  Bytes stream;
  for (std::uint64_t i = 0; i < streams; ++i) {
    stream.clear();
    while (stream.size() < 56) {
      const std::uint64_t draw = random();
      if (draw % 4 == 0) {  // random bytes, often a mark
        const std::uint64_t kind = draw >> 8 & 7;
        stream.push_back(kind == 0 ? '<' : kind == 1 ? '>' : static_cast<std::uint8_t>(draw >> 16));
        continue;
      }
      std::array<std::uint8_t, 16> report;
      report.front() = '<';
      for (std::size_t k = 1; k < 15; ++k) report[k] = static_cast<std::uint8_t>('A' + (random() >> 40 & 15));
      report.back() = '>';
      std::size_t length = 16;
      if (draw >> 8 & 1) report[draw >> 12 & 15] = static_cast<std::uint8_t>(draw >> 24);
      if ((draw >> 9 & 3) == 0) length = draw >> 32 & 15;
      stream.insert(stream.end(), report.begin(), report.begin() + static_cast<std::ptrdiff_t>(length));
    }
    FalconReportParser parser;
    std::size_t free_from = 0;  // first byte that no report has used
    for (std::size_t end = 1; end <= stream.size(); ++end) {
      const bool complete = parser.push(stream[end - 1]);
      const bool expected = end >= free_from + 16 && wellFormed(std::span(stream).subspan(end - 16, 16));
      ASSERT_EQ(complete, expected) << "stream " << i << " at " << end;
      if (!complete) continue;
      ++accepted;
      free_from = end;
      const auto nibble = [&](std::size_t k) { return stream[end - 16 + k] - 'A'; };
      const int count = nibble(1) | nibble(2) << 4 | nibble(3) << 8 | nibble(4) << 12;
      ASSERT_EQ(parser.report().counts[0], static_cast<std::int16_t>(count));
    }
  }
  EXPECT_GT(accepted, streams / 2);
}

TEST(FalconProtocol, StatusBytesAreTakenFromEveryPacketOfATransfer) {
  const auto payloads = [](const Bytes& transfer) {
    std::vector<std::size_t> sizes;
    std::string joined;
    forEachFtdiPayload(transfer, [&](std::span<const std::uint8_t> payload) {
      sizes.push_back(payload.size());
      joined += asCharacters(payload);
    });
    return std::pair(sizes, joined);
  };
  EXPECT_TRUE(payloads({}).first.empty());
  EXPECT_TRUE(payloads({1}).first.empty());
  EXPECT_EQ(payloads({1, 0x60}).second, "");
  EXPECT_EQ(payloads({1, 0x60, 'a'}).second, "a");
  Bytes long_transfer;
  std::string expected;
  for (int packet = 0; packet < 3; ++packet) {
    long_transfer.insert(long_transfer.end(), {1, 0x60});
    const int length = packet < 2 ? 62 : 5;
    for (int i = 0; i < length; ++i) {
      long_transfer.push_back(static_cast<std::uint8_t>('a' + packet));
      expected += static_cast<char>('a' + packet);
    }
  }
  EXPECT_EQ(payloads(long_transfer).first, (std::vector<std::size_t>{62, 62, 5}));
  EXPECT_EQ(payloads(long_transfer).second, expected);
  long_transfer.resize(65);  // one status byte of a second packet
  EXPECT_EQ(payloads(long_transfer).first, (std::vector<std::size_t>{62}));
}

TEST(FalconProtocol, PackingAndParsingCallNothingThatATickMustNotCall) {
  const std::string text = reportText({.counts = {1, 2, 3}});
  FalconReportParser parser;
  int reports = 0;
  test::NoAllocGuard guard;
  for (int i = 0; i < 100; ++i) {
    const FalconPacket packet = packFalconCommand({.motors = {static_cast<std::int16_t>(i), 0, 0}});
    for (const std::uint8_t byte : packet) reports += parser.push(byte);
    for (const char c : text) reports += parser.push(static_cast<std::uint8_t>(c));
  }
  const test::ForbiddenCalls calls = guard.calls();
  EXPECT_EQ(calls.total(), 0u) << calls.first;
  EXPECT_EQ(reports, 200);  // a command also has the form of a report
}

// The device's side of the connection, byte by byte, in virtual time.
class BootLoader {
 public:
  explicit BootLoader(const Bytes& image) : image_(image) {}
  std::string greeting_answer = std::string("\x0a\x44\x2c\x0d", 4);
  int deaf_greetings = 0;  // number of greetings that it ignores
  bool deaf = false;
  std::optional<std::size_t> wrong_echo;  // byte of the image whose echo is wrong, in the first attempt
  std::optional<std::size_t> lost_echo;   // byte without echo, in the first attempt
  std::optional<std::size_t> double_echo;
  bool knows_speed = true;

  void request(const FtdiRequest& request) { requests.push_back(request); }
  void write(std::span<const std::uint8_t> bytes) {
    const std::string text = asCharacters(bytes);
    if (deaf) return;
    if (text == "\x0a\x43\x0d") {
      if (deaf_greetings-- <= 0) answer += greeting_answer;
      return;
    }
    if (text == "A" && !loading_) {
      loading_ = true;
      if (knows_speed) answer += "A";
      return;
    }
    EXPECT_LE(bytes.size(), 62u);
    for (const std::uint8_t byte : bytes) {
      const std::size_t at = loaded.size();
      loaded.push_back(byte);
      if (attempts == 1 && lost_echo == at) continue;
      answer += static_cast<char>(attempts == 1 && wrong_echo == at ? byte ^ 0x10 : byte);
      if (attempts == 1 && double_echo == at) answer += static_cast<char>(byte);
    }
  }
  void reopen() {
    ++attempts;
    loading_ = false;
    loaded.clear();
    answer.clear();
  }

  std::string answer;  // bytes not read yet
  Bytes loaded;
  std::vector<FtdiRequest> requests;
  int attempts = 1;

 private:
  const Bytes& image_;
  bool loading_ = false;
};

struct LoadResult {
  FalconLoader::Action action{};
  std::string why;
  double time_s = 0;
  int attempts = 0;
};

LoadResult load(const Bytes& image, BootLoader& peer, std::size_t piece = 1000) {
  FalconLoader loader(image);
  double time_s = 0;
  for (int steps = 0; steps < 1'000'000; ++steps) {
    const FalconLoader::Step& step = loader.next(time_s);
    switch (step.action) {
      case FalconLoader::Action::request:
        peer.request(step.request);
        time_s += 1e-4;
        break;
      case FalconLoader::Action::write:
        peer.write(step.bytes);
        time_s += 1e-4;
        break;
      case FalconLoader::Action::read: {
        if (peer.answer.empty()) {
          EXPECT_GT(step.until_s, time_s);
          time_s = std::max(time_s + 0.001, step.until_s);
          break;
        }
        const std::string part = peer.answer.substr(0, piece);
        peer.answer.erase(0, part.size());
        loader.received(Bytes(part.begin(), part.end()));
        time_s += piece >= 62 ? 0.016 : 0.001;
        break;
      }
      case FalconLoader::Action::reopen:
        peer.reopen();
        time_s += 0.1;
        break;
      case FalconLoader::Action::loaded:
      case FalconLoader::Action::failed:
        return {step.action, step.why, time_s, loader.attempt()};
    }
  }
  ADD_FAILURE() << "it does not end";
  return {};
}

Bytes someImage(std::size_t bytes = 7914) {
  Bytes image(bytes);
  std::mt19937 random(7);
  for (std::uint8_t& byte : image) byte = static_cast<std::uint8_t>(random());
  return image;
}

TEST(FalconProtocol, FirmwareIsLoadedWithEveryByteInOrder) {
  const Bytes image = someImage();
  for (const std::size_t piece : {1000u, 62u, 7u, 1u}) {
    BootLoader peer(image);
    const LoadResult result = load(image, peer, piece);
    EXPECT_EQ(result.action, FalconLoader::Action::loaded) << result.why;
    EXPECT_EQ(result.attempts, 1);
    EXPECT_EQ(peer.loaded, image);
    if (piece >= 62) {
      EXPECT_NEAR(result.time_s, 2.1, 0.2);  // 16 ms a block
    }
    // The baud rate of each phase: greeting, loading, running.
    Bytes speeds;
    for (const FtdiRequest& request : peer.requests)
      if (request.request == 3) speeds.push_back(static_cast<std::uint8_t>(request.value & 0xff));
    EXPECT_EQ(speeds, (Bytes{0x38, 0x15, 0x02}));
    EXPECT_EQ(peer.requests.back(), ftdi::kPurgeOut);
  }
}

TEST(FalconProtocol, AGreetingThatComesLateOrWithAZeroIsUnderstood) {
  const Bytes image = someImage();
  BootLoader peer(image);
  peer.greeting_answer = std::string("\x00\x0a\x44\x2c\x0d", 5);
  peer.deaf_greetings = FalconLoader::kGreetings - 1;
  const LoadResult result = load(image, peer);
  EXPECT_EQ(result.action, FalconLoader::Action::loaded) << result.why;
  EXPECT_EQ(result.attempts, 1);
  EXPECT_EQ(peer.loaded, image);
}

TEST(FalconProtocol, AWrongMissingOrDoubleEchoBeginsAgainWithTheDeviceOpenedAnew) {
  const Bytes image = someImage(500);
  for (std::size_t at = 0; at < image.size(); at += 13) {
    for (int kind = 0; kind < 3; ++kind) {
      BootLoader peer(image);
      (kind == 0 ? peer.wrong_echo : kind == 1 ? peer.lost_echo : peer.double_echo) = at;
      const LoadResult result = load(image, peer);
      ASSERT_EQ(result.action, FalconLoader::Action::loaded) << result.why;
      // The echo of the last byte may come twice: everything is loaded by then.
      EXPECT_EQ(result.attempts, kind == 2 && at + 1 == image.size() ? 1 : 2) << at << ' ' << kind;
      EXPECT_EQ(peer.loaded, image);
    }
  }
}

TEST(FalconProtocol, ADeviceThatStaysSilentIsGivenUpWithTheReason) {
  const Bytes image = someImage(500);
  BootLoader silent(image);
  silent.deaf = true;
  LoadResult result = load(image, silent);
  EXPECT_EQ(result.action, FalconLoader::Action::failed);
  EXPECT_EQ(result.attempts, FalconLoader::kAttempts);
  EXPECT_NE(result.why.find("greeting"), std::string::npos) << result.why;
  EXPECT_LT(result.time_s, FalconLoader::kAttempts * FalconLoader::kAttemptTime_s);

  BootLoader slow(image);
  slow.knows_speed = false;
  result = load(image, slow);
  EXPECT_EQ(result.action, FalconLoader::Action::failed);
  EXPECT_NE(result.why.find("speed"), std::string::npos) << result.why;
}

TEST(FalconProtocol, ALossEndsTheAttemptAndTheLastOneTheLoading) {
  const Bytes image = someImage(500);
  FalconLoader loader(image, 2);
  EXPECT_EQ(loader.next(0).action, FalconLoader::Action::request);
  loader.lost("the cable is loose");
  EXPECT_EQ(loader.next(0).action, FalconLoader::Action::reopen);
  EXPECT_EQ(loader.attempt(), 2);
  loader.lost("it cannot be opened");
  const FalconLoader::Step& step = loader.next(0);
  EXPECT_EQ(step.action, FalconLoader::Action::failed);
  EXPECT_EQ(step.why, "it cannot be opened");
  loader.lost("again");
  EXPECT_EQ(loader.next(0).why, "it cannot be opened");
}

TEST(FalconProtocol, FuzzedBootLoadersEndItInBoundedTimeAndLoadedOnlyAfterAWholeEcho) {
  std::mt19937_64 random(3);
  const Bytes image = someImage(300);
  int loaded = 0, failed = 0;
  for (int run = 0; run < 2000; ++run) {
    FalconLoader loader(image, 3);
    double time_s = 0;
    Bytes pending, echoed;
    bool over = false;
    const auto fault_every = std::uint64_t{1} << (random() % 16);
    for (int steps = 0; !over; ++steps) {
      ASSERT_LT(steps, 100'000);
      const FalconLoader::Step& step = loader.next(time_s);
      time_s += 1e-3;
      switch (step.action) {
        case FalconLoader::Action::request:
          if (random() % (16 * fault_every) == 0) loader.lost("request");
          break;
        case FalconLoader::Action::write:
          pending.assign(step.bytes.begin(), step.bytes.end());
          if (asCharacters(pending) == "\x0a\x43\x0d") pending = {0x0a, 0x44, 0x2c, 0x0d};
          for (std::uint8_t& byte : pending)
            if (random() % (8 * fault_every) == 0) byte = static_cast<std::uint8_t>(random());
          break;
        case FalconLoader::Action::read: {
          const std::size_t piece = std::min<std::size_t>(pending.size(), random() % 80);
          const Bytes part(pending.begin(), pending.begin() + static_cast<std::ptrdiff_t>(piece));
          pending.erase(pending.begin(), pending.begin() + static_cast<std::ptrdiff_t>(piece));
          loader.received(part);
          echoed.insert(echoed.end(), part.begin(), part.end());
          break;
        }
        case FalconLoader::Action::reopen:
          echoed.clear();
          pending.clear();
          break;
        case FalconLoader::Action::loaded:
          ++loaded;
          ASSERT_GE(echoed.size(), image.size());
          ASSERT_TRUE(std::equal(image.begin(), image.end(), echoed.end() - static_cast<std::ptrdiff_t>(image.size())));
          over = true;
          break;
        case FalconLoader::Action::failed:
          ++failed;
          ASSERT_NE(step.why, "");
          over = true;
          break;
      }
    }
    ASSERT_LT(time_s, 3 * FalconLoader::kAttemptTime_s + 1);
  }
  EXPECT_GT(loaded, 200);
  EXPECT_GT(failed, 200);
}

}  // namespace
}  // namespace filiform
