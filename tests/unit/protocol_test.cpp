#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "shared/protocol/commissioning_payloads.hpp"
#include "shared/protocol/map_payloads.hpp"
#include "shared/protocol/payloads.hpp"
#include "shared/protocol/serial_frame.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::protocol::protocol_test {
namespace {

template <class E>
E below(std::mt19937& random, std::uint32_t end) {
  return static_cast<E>(random() % end);
}
template <class T>
void fill(std::mt19937& random, T& bytes) {
  for (auto& b : bytes) b = static_cast<std::uint8_t>(random());
}

void randomise(std::mt19937&, Empty&) {}
void randomise(std::mt19937& r, Hello& x) {
  x = {below<std::uint8_t>(r, 256), below<std::uint8_t>(r, 256)};
}
void randomise(std::mt19937& r, Identity& x) {
  x.major = below<std::uint8_t>(r, 256), x.minor = below<std::uint8_t>(r, 256);
  fill(r, x.firmware), fill(r, x.board), fill(r, x.serial);
  x.tick_hz = r(), x.block_bytes = r(), x.effects = static_cast<std::uint16_t>(r());
  x.channels = below<std::uint8_t>(r, 256), x.most_channels = below<std::uint8_t>(r, 256);
  x.most_lines = below<std::uint8_t>(r, 256), x.has_output_encoder = below<std::uint8_t>(r, 2);
  x.firmware_key = below<FirmwareKey>(r, kFirmwareKeys), x.pairing = below<PairingState>(r, kPairingStates);
}
void randomise(std::mt19937& r, Effects& x) {
  fill(r, x.bits);
}
void randomise(std::mt19937& r, Hardware& x) {
  const auto kind = [&] { return below<control::SensorKind>(r, control::kSensorKinds); };
  const auto number = [&] { return static_cast<std::uint32_t>(r()); };
  x.board = {number(), number(), number(), number(), number(), static_cast<std::int32_t>(r()), kind(), kind(), kind()};
}
void randomise(std::mt19937& r, Reference& x) {
  const auto number = [&] { return static_cast<std::uint32_t>(r()); };
  x = {(r() & 1) != 0, (r() & 1) != 0, {{number(), number(), number()}, {number(), number(), number()}}};
}
void randomise(std::mt19937& r, Home& x) {
  x.position = static_cast<std::int64_t>(std::uint64_t{r()} << 32 | r());
}
void randomise(std::mt19937& r, Status& x) {
  x = {static_cast<std::uint32_t>(r()),
       below<Mode>(r, kModes),
       (r() & 1) != 0,
       below<StoreState>(r, kStoreStates),
       below<std::uint8_t>(r, kFaults),
       static_cast<std::uint32_t>(r()),
       static_cast<std::int32_t>(r()),
       static_cast<std::int32_t>(r()),
       static_cast<std::uint32_t>(r()),
       static_cast<std::uint16_t>(r()),
       static_cast<std::uint32_t>(r()),
       {static_cast<std::uint32_t>(r()), static_cast<std::uint32_t>(r())},
       {static_cast<std::uint32_t>(r()), static_cast<std::uint32_t>(r())}};
}
void randomise(std::mt19937& r, BlockBegin& x) {
  x = {static_cast<std::uint32_t>(r()), static_cast<std::uint32_t>(r())};
}
void randomise(std::mt19937& r, Chunk& x) {
  x.offset = static_cast<std::uint32_t>(r());
  x.count = static_cast<std::uint8_t>(kMostChunk);
  fill(r, x.bytes);
}
void randomise(std::mt19937& r, BlockRead& x) {
  x = {below<Which>(r, 2), static_cast<std::uint32_t>(r())};
}
void randomise(std::mt19937& r, BlockRestore& x) {
  x.sequence = static_cast<std::uint16_t>(r());
}
void randomise(std::mt19937& r, Reason& x) {
  x.reason = static_cast<std::uint32_t>(r());
}
void randomise(std::mt19937& r, Command& x) {
  x = {below<CommandKind>(r, kCommandKinds),
       below<Mode>(r, kModes),
       (r() & 1) != 0,
       (r() & 1) != 0,
       static_cast<std::int64_t>((std::uint64_t{r()} << 32) | r()),
       static_cast<std::int32_t>(r()),
       static_cast<std::int32_t>(r()),
       static_cast<std::int32_t>(r())};
}
void randomise(std::mt19937& r, CommandAnswer& x) {
  x = {below<Refusal>(r, kRefusals), below<Mode>(r, kModes)};
}
void randomise(std::mt19937& r, Excitation& x) {
  x.shape = below<control::Shape>(r, Excitation::kShapes);
  x.is_torque = (r() & 1) != 0;
  x.line_count = below<std::uint8_t>(r, control::kMostLines + 1);
  x.ticks = r(), x.fade_ticks = r();
  x.step = (std::uint64_t{r()} << 32) | r();
  x.step_change = (std::uint64_t{r()} << 32) | r();
  x.positive = static_cast<std::int32_t>(r()), x.negative = static_cast<std::int32_t>(r());
  x.offset = static_cast<std::int32_t>(r()), x.limit = static_cast<std::int32_t>(r());
  x.rate = static_cast<std::int64_t>((std::uint64_t{r()} << 32) | r());
}
void randomise(std::mt19937& r, ExcitationGuard& x) {
  x = {static_cast<std::int32_t>(r()), static_cast<std::int32_t>(r()), static_cast<std::int32_t>(r()),
       static_cast<std::int32_t>(r()), static_cast<std::int32_t>(r())};
}
void randomise(std::mt19937& r, ExcitationLines& x) {
  x.first = below<std::uint8_t>(r, control::kMostLines);
  x.count = kLinesAMessage;
  for (auto& line : x.lines)
    line = {static_cast<std::uint16_t>(r()), static_cast<std::int16_t>(r()), static_cast<std::int32_t>(r()),
            static_cast<std::uint32_t>(r())};
}
void randomise(std::mt19937& r, Subscription& x) {
  x.every = static_cast<std::uint16_t>(r());
  x.count = kMostChannels;
  for (auto& c : x.channels) c = below<Channel>(r, kChannels);
}
void randomise(std::mt19937& r, Pairing& x) {
  x.state = below<PairingState>(r, kPairingStates), x.wait_ms = static_cast<std::uint32_t>(r());
  fill(r, x.key);
}
void randomise(std::mt19937& r, PairingChallenge& x) {
  fill(r, x.nonce);
}
void randomise(std::mt19937& r, PairingPart& x) {
  x.part = below<std::uint8_t>(r, PairingPart::kParts);
  fill(r, x.bytes);
}
void randomise(std::mt19937& r, PairingAnswer& x) {
  x.action = below<PairingAction>(r, kPairingActions);
}
void randomise(std::mt19937& r, CommissioningStage& x) {
  for (std::uint32_t* word :
       {&x.current_full_scale_ma, &x.bus_full_scale_mv, &x.pwm_hz, &x.timer_counts, &x.encoder_counts, &x.offset_angle})
    *word = static_cast<std::uint32_t>(r());
  x.shortest_pulse = static_cast<std::int32_t>(r()), x.most_current = static_cast<std::int32_t>(r());
  x.bus = static_cast<std::uint16_t>(r()), x.least_bus = static_cast<std::uint16_t>(r());
  x.most_bus = static_cast<std::uint16_t>(r()), x.pole_pairs = static_cast<std::uint8_t>(r());
  x.two_sensors = (r() & 1) != 0, x.reversed = (r() & 1) != 0;
}
void randomise(std::mt19937& r, CommissioningBegin& x) {
  for (std::int32_t* word :
       {&x.least_bus, &x.current, &x.most_current, &x.most_voltage, &x.voltage_ramp, &x.slow_step, &x.fast_step,
        &x.most_shaft_step, &x.step_ramp, &x.most_travel, &x.most_periods, &x.stated_pole_pairs})
    *word = static_cast<std::int32_t>(r());
}
void randomise(std::mt19937& r, CommissioningProgress& x) {
  x.state = below<CommissioningState>(r, kCommissioningStates);
  x.step = below<control::commissioning::Step>(r, control::commissioning::kStepCount);
  x.fault = below<control::commissioning::Fault>(r, control::commissioning::kFaultCount);
  x.phase = below<std::uint8_t>(r, 4), x.periods = static_cast<std::uint32_t>(r());
  x.most_periods = static_cast<std::uint32_t>(r());
}
void randomise(std::mt19937& r, CommissioningResult& x) {
  for (std::int32_t& word : x.gain) word = static_cast<std::int32_t>(r());
  for (std::int32_t& word : x.offset) word = static_cast<std::int32_t>(r());
  for (std::int32_t* word : {&x.resistance, &x.inductance_d, &x.inductance_q, &x.flux, &x.lost_voltage, &x.lag})
    *word = static_cast<std::int32_t>(r());
  x.pole_pairs = static_cast<std::uint8_t>(r()), x.reversed = (r() & 1) != 0;
  x.offset_angle = static_cast<std::uint32_t>(r());
}
void randomise(std::mt19937& r, FrameHead& x) {
  x = {static_cast<std::uint32_t>(r()), static_cast<std::uint32_t>(r())};
}

void randomise(std::mt19937& r, MapInfo& x) {
  x.counts = (r() & 1) != 0, x.angle_bins = below<std::uint8_t>(r, 256), x.version = r();
  x.scale = static_cast<std::int64_t>((std::uint64_t{r()} << 32) | r());
  x.edge_count = static_cast<std::uint8_t>(x.edges.size());
  for (auto& edge : x.edges) edge = static_cast<std::int32_t>(r());
}
void randomise(std::mt19937& r, MapFirst& x) {
  x.first = static_cast<std::uint16_t>(r());
}
void randomise(std::mt19937& r, MapBins& x) {
  x.first = static_cast<std::uint16_t>(r());
  x.count = kMapBinsAMessage;
  for (auto& bin : x.bins)
    bin = {static_cast<std::uint16_t>(r()), static_cast<std::int32_t>(r()), static_cast<std::uint32_t>(r())};
}
void randomise(std::mt19937& r, MapCommand& x) {
  x.action = below<MapAction>(r, kMapActions);
}

template <class T>
class Payload : public ::testing::Test {};
using AllPayloads =
    ::testing::Types<Empty, Hello, Identity, Effects, Hardware, Reference, Home, Status, BlockBegin, Chunk, BlockRead,
                     BlockRestore, Reason, Command, CommandAnswer, Excitation, ExcitationGuard, ExcitationLines,
                     Subscription, Pairing, PairingChallenge, PairingPart, PairingAnswer, FrameHead, MapInfo, MapFirst,
                     MapBins, MapCommand, CommissioningStage, CommissioningBegin, CommissioningProgress,
                     CommissioningResult>;
TYPED_TEST_SUITE(Payload, AllPayloads);

TYPED_TEST(Payload, ComesBackAsItWasSentAndEveryOtherLengthIsRefused) {
  std::mt19937 random(7);
  for (int i = 0; i < 200; ++i) {
    TypeParam sent{};
    randomise(random, sent);
    const Message m = request(Kind::status, 9, sent);
    if (!std::is_same_v<TypeParam, Empty>) {
      ASSERT_GT(m.length, 0) << "it has to fit a message";
    }
    Message arrived;
    ASSERT_TRUE(decode(encode(m), arrived));
    EXPECT_EQ(arrived.number, 9);
    TypeParam taken{};
    ASSERT_EQ(take_payload(arrived.content(), taken), Code::done);
    EXPECT_EQ(taken, sent);
    for (std::size_t size = 0; size < m.length; ++size) {
      if (std::is_same_v<TypeParam, Chunk> && size >= 4) break;  // a chunk may be short
      TypeParam part{};
      EXPECT_EQ(take_payload(m.content().first(size), part), Code::wrong_length) << size;
    }
    if (m.length < kMostPayload) {
      std::vector<std::uint8_t> longer(m.content().begin(), m.content().end());
      longer.push_back(0);
      TypeParam more{};
      const bool any_length = std::is_same_v<TypeParam, Chunk>;
      EXPECT_EQ(take_payload(longer, more), any_length ? Code::done : Code::wrong_length);
    }
  }
}

TYPED_TEST(Payload, OfRandomBytesNeverHoldsANumberOutsideItsField) {
  std::mt19937 random(8);
  for (int i = 0; i < 20'000; ++i) {
    std::array<std::uint8_t, kMostPayload> bytes{};
    const std::size_t size = random() % (kMostPayload + 1);
    for (std::size_t k = 0; k < size; ++k)
      bytes[k] = static_cast<std::uint8_t>(random() % 4 == 0 ? random() : random() % 3);
    TypeParam taken{};
    if (take_payload(std::span(bytes).first(size), taken) != Code::done) continue;
    // What was taken as good goes out as it came in.
    const Message again = request(Kind::status, 0, taken);
    ASSERT_EQ(again.length, size);
    ASSERT_TRUE(std::equal(again.content().begin(), again.content().end(), bytes.begin()));
  }
}

std::string hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t b : bytes) {
    constexpr char kDigits[] = "0123456789abcdef";
    text += kDigits[b >> 4];
    text += kDigits[b & 15];
  }
  return text;
}
std::string wire(const Message& m) {
  const Report report = encode(m);
  return hex(std::span(report).first(m.size()));
}

// The bytes on the wire. They change with kMajor only.
TEST(Protocol, BytesOnTheWireAreTheRecordedOnes) {
  EXPECT_EQ(kMajor, 1);
  EXPECT_EQ(wire(request(Kind::identify, 7, Hello{1, 0})), "010702000100");
  Identity id;
  id.firmware = {3, 4};
  id.board = {'b'};
  id.serial = {'A', '1'};
  id.tick_hz = 20'000, id.block_bytes = 16'128, id.effects = 43, id.channels = 21, id.most_channels = 12;
  id.most_lines = 32, id.has_output_encoder = 1, id.firmware_key = FirmwareKey::development;
  id.pairing = PairingState::locked;
  EXPECT_EQ(wire(answer_to(request(Kind::identify, 7, Hello{}), Code::done, id)),
            "810734000106030462000000000000000000000000000000"
            "41310000000000000000000000000000204e0000003f00002b00150c20010203");
  Status s{0x01020304, Mode::fault, true, StoreState::fell_back, 13, 5, -2, 3, 4, 6, 8, {0x100, 0xA1B2C3D4}, {9, 10}};
  EXPECT_EQ(wire(answer_to(request(Kind::status, 1, Empty{}), Code::done, s)),
            "82012e0004030201070102"
            "0d05000000feffffff0300000004000000060008000000"
            "00010000d4c3b2a1090000000a000000");
  using control::SensorKind;
  EXPECT_EQ(wire(answer_to(request(Kind::hardware, 1, Empty{}), Code::done,
                           Hardware{{8000, 5000, 4000, 120'000, 200'000, -50'000, SensorKind::absolute,
                                     SensorKind::none, SensorKind::analog}})),
            "84011b00401f000088130000a00f0000c0d40100400d0300b03cffff040105");
  EXPECT_EQ(wire(request(Kind::block_begin, 2, BlockBegin{0x1234, 0xDEADBEEF})), "1002080034120000efbeadde");
  EXPECT_EQ(wire(request(Kind::block_chunk, 3, Chunk{56, {1, 2, 3}, 3})), "1103070038000000010203");
  EXPECT_EQ(wire(request(Kind::block_commit, 4, Empty{})), "12040000");
  EXPECT_EQ(wire(request(Kind::block_restore, 4, BlockRestore{0x0102})), "130402000201");
  EXPECT_EQ(wire(request(Kind::block_read, 5, BlockRead{Which::previous, 0x38})), "140505000138000000");
  EXPECT_EQ(wire(answer_to(request(Kind::block_commit, 4, Empty{}), Code::invalid, Reason{11})), "920404250b000000");
  EXPECT_EQ(wire(request(Kind::command, 6, Command{CommandKind::arm, Mode::position, true, true, -2, 1, 2, 3})),
            "20061800"
            "01040101"
            "feffffffffffffff"
            "010000000200000003000000");
  EXPECT_EQ(
      wire(answer_to(request(Kind::command, 6, Empty{}), Code::refused, CommandAnswer{Refusal::moving, Mode::idle})),
      "a00602070501");
  Excitation e;
  e.shape = control::Shape::triangle, e.is_torque = false, e.line_count = 2, e.ticks = 20'000, e.fade_ticks = 5'000;
  e.step = 1, e.step_change = 2, e.positive = 3, e.negative = 4, e.offset = 5, e.limit = 6, e.rate = 7;
  EXPECT_EQ(wire(request(Kind::excitation, 8, e)),
            "21083300"
            "040002"
            "204e0000"
            "88130000"
            "0100000000000000"
            "0200000000000000"
            "03000000"
            "04000000"
            "05000000"
            "06000000"
            "0700000000000000");
  EXPECT_EQ(wire(request(Kind::excitation_guard, 8, ExcitationGuard{1, 2, 3, 4, -5})),
            "220814000100000002000000030000000400000"
            "0fbffffff");
  EXPECT_EQ(wire(request(Kind::excitation_lines, 8, ExcitationLines{4, {{{3, -1, 5, 6}}}, 1})),
            "23080e00"
            "0401"
            "0300ffff0500000006000000");
  EXPECT_EQ(wire(request(Kind::telemetry, 9, Subscription{20, {Channel::velocity, Channel::current}, 2})),
            "3009050014000"
            "2060a");
}

TEST(Protocol, MessagesThatAreCutOffOrStateAWrongLengthAreRefused) {
  const Report report = encode(request(Kind::block_begin, 1, BlockBegin{1, 2}));
  Message m;
  EXPECT_TRUE(decode(std::span(report).first(12), m));
  for (std::size_t size = 0; size < 12; ++size) EXPECT_FALSE(decode(std::span(report).first(size), m)) << size;
  Report wrong = report;
  wrong[2] = kMostPayload + 1;
  EXPECT_FALSE(decode(wrong, m));
}

TEST(Protocol, IdentifyIsUnderstoodWhateverALaterVersionPutsBehindIt) {
  const std::vector<std::uint8_t> later = {2, 5, 77, 78};
  Hello hello;
  EXPECT_EQ(take_front(later, hello), Code::done);
  EXPECT_EQ(hello, (Hello{2, 5}));
  EXPECT_EQ(take_front(std::span(later).first(1), hello), Code::wrong_length);
}

TEST(Protocol, EveryCodeRefusalFaultAndChannelHasATextOfItsOwn) {
  std::set<std::string_view> texts;
  for (int i = 0; i <= static_cast<int>(Code::worn); ++i)
    if (i <= static_cast<int>(Code::not_available) || i >= static_cast<int>(Code::too_long)) {
      const auto text = text_of(static_cast<Code>(i));
      EXPECT_FALSE(text.starts_with("a code that")) << i;
      EXPECT_TRUE(texts.insert(text).second) << text;
    }
  for (std::uint32_t i = 0; i < kRefusals; ++i) {
    EXPECT_FALSE(text_of(static_cast<Refusal>(i)).starts_with("a refusal that")) << i;
  }
  std::set<std::string_view> names;
  for (const ChannelText& text : kChannelTexts) EXPECT_TRUE(names.insert(text.name).second) << text.name;
  for (const FaultText& text : kFaultTexts) EXPECT_TRUE(names.insert(text.name).second) << text.name;
  EXPECT_TRUE(text_of(static_cast<Code>(200)).starts_with("a code that this tool does not know"));
}

Message some_message(std::mt19937& random) {
  Message m;
  m.kind = static_cast<std::uint8_t>(random());
  m.number = static_cast<std::uint8_t>(random());
  m.length = static_cast<std::uint8_t>(random() % (kMostPayload + 1));
  m.code = static_cast<std::uint8_t>(random());
  for (std::size_t i = 0; i < m.length; ++i) m.payload[i] = static_cast<std::uint8_t>(random() % 3 == 0 ? 0 : random());
  return m;
}

TEST(SerialFrame, BytesOnTheLineAreTheRecordedOnes) {
  EXPECT_EQ(hex(serial_frame(request(Kind::identify, 7, Hello{1, 0})).content()), std::string("04010702"
                                                                                              "0201"
                                                                                              "05dc57ac7b"
                                                                                              "00"));
}

TEST(SerialFrame, HoldsNoZeroButTheLastAndComesBack) {
  std::mt19937 random(3);
  SerialReader reader;
  for (int i = 0; i < 5'000; ++i) {
    const Message sent = some_message(random);
    const SerialFrame frame = serial_frame(sent);
    Message m;
    for (std::size_t k = 0; k + 1 < frame.size; ++k) {
      ASSERT_NE(frame.bytes[k], 0);
      ASSERT_FALSE(reader.take(frame.bytes[k], m));
    }
    ASSERT_TRUE(reader.take(frame.bytes[frame.size - 1], m));
    ASSERT_EQ(encode(m), encode(sent));
  }
  EXPECT_EQ(reader.damaged(), 0U);
}

// Bytes lost, doubled, changed and put in: what comes out was sent, and the first frame after the trouble comes whole.
TEST(SerialFrame, OnALineThatGarblesOnlyWhatWasSentComesOutAndTheNextGoodFrameIsTaken) {
  std::mt19937 random(4);
  SerialReader reader;
  int garbled_taken = 0;
  for (int i = 0; i < 20'000; ++i) {
    const Message sent = some_message(random);
    const SerialFrame frame = serial_frame(sent);
    std::vector<std::uint8_t> line(frame.content().begin(), frame.content().end());
    const auto at = static_cast<std::ptrdiff_t>(random() % line.size());
    switch (random() % 4) {
      case 0:
        line.erase(line.begin() + at);
        break;
      case 1:
        line.insert(line.begin() + at, static_cast<std::uint8_t>(random()));
        break;
      case 2:
        line[static_cast<std::size_t>(at)] ^= static_cast<std::uint8_t>(1 + random() % 255);
        break;
      default:
        line.resize(static_cast<std::size_t>(at));
    }
    Message m;
    for (const std::uint8_t byte : line) {
      if (reader.take(byte, m) && encode(m) != encode(sent)) ++garbled_taken;
    }
    reader.take(0, m);  // the next sender begins so
    const SerialFrame next = serial_frame(sent);
    bool came = false;
    for (const std::uint8_t byte : next.content()) came = reader.take(byte, m) || came;
    ASSERT_TRUE(came);
    ASSERT_EQ(encode(m), encode(sent));
  }
  EXPECT_EQ(garbled_taken, 0);
  EXPECT_GT(reader.damaged(), 10'000U);
}

TEST(SerialFrame, RandomBytesAreNoMessage) {
  std::mt19937 random(5);
  SerialReader reader;
  Message m;
  int taken = 0;
  for (int i = 0; i < 2'000'000; ++i)
    taken += reader.take(static_cast<std::uint8_t>(random() % 5 == 0 ? 0 : random()), m);
  EXPECT_EQ(taken, 0);
}

TEST(TelemetryFrames, ComeOutOneByOneAndAWrongCountIsRefused) {
  Message m{kFirstUnasked, 3, 0, 2, {}};
  model::Writer w(m.payload);
  w.put(std::uint32_t{100}), w.put(std::uint32_t{5000});
  for (std::uint32_t i = 0; i < 6; ++i) w.put(10 + i);
  m.length = static_cast<std::uint8_t>(w.size());
  std::vector<std::uint32_t> seen;
  EXPECT_TRUE(for_each_frame(m, [&](const FrameHead& head, std::uint32_t i, std::span<const std::uint32_t> words) {
    EXPECT_EQ(head, (FrameHead{100, 5000}));
    EXPECT_EQ(words[0], 10 + 3 * i);
    seen.insert(seen.end(), words.begin(), words.end());
  }));
  EXPECT_EQ(seen, (std::vector<std::uint32_t>{10, 11, 12, 13, 14, 15}));
  const auto refused = [&](auto change) {
    Message other = m;
    change(other);
    return !for_each_frame(other, [](auto...) { FAIL(); });
  };
  EXPECT_TRUE(refused([](Message& x) { x.code = 1; }));
  EXPECT_TRUE(refused([](Message& x) { x.code = 0; }));
  EXPECT_TRUE(refused([](Message& x) { x.number = 13; }));
  EXPECT_TRUE(refused([](Message& x) { x.number = 0; }));
  EXPECT_TRUE(refused([](Message& x) { --x.length; }));
  EXPECT_TRUE(refused([](Message& x) { x.kind = 0x81; }));
}

}  // namespace
}  // namespace flexspline::protocol::protocol_test
