#include "host/drive_link/drive/recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <thread>

#include "host/drive_link/drive/silence.hpp"
#include "host/engine/planning/excitation.hpp"
#include "shared/control/excitation.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/protocol/excitation_requests.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::drive {
namespace {

using protocol::Channel;
using protocol::Kind;
using Clock = std::chrono::steady_clock;

// A host that is silent for 0.1 s counts as lost; it shows itself well before, by either clock.
constexpr Milliseconds kHeartbeat{20};
constexpr double kHeartbeatTick_s = 0.02;
// Set points of position go out more often.
constexpr Milliseconds kSetPoint{5};
constexpr double kSetPoint_s = 0.005;
constexpr Milliseconds kWait{5};  // for a message
constexpr Milliseconds kSilence{2000};
constexpr double kStart_s = 2.0;  // until a run of mode position has begun
constexpr double kOver = 1.1;     // of a limit: noise is no reason to stop
constexpr std::size_t kLongestGapList = 20;

const std::vector<Channel> kChannels{Channel::motor_fraction, Channel::output_fraction, Channel::current,
                                     Channel::torque,         Channel::temperature,     Channel::set_velocity};
std::vector<Channel> channels_of(const planning::Run& run) {
  std::vector<Channel> channels = kChannels;
  if (run.mode != planning::Mode::velocity) channels.back() = Channel::command_current;
  if (run.mode == planning::Mode::position) channels.back() = Channel::set_fraction;
  return channels;
}

double turns_of(std::int64_t angle) {
  return std::ldexp(static_cast<double>(angle), -fixed::kAngleBits);
}

// A position whose whole turns are counted here: the next one is the nearest to where the motion would lead.
class Unwrapped {
 public:
  double next(double fraction, double samples) {
    if (!known_) {
      known_ = true;
      return turns_ = fraction;
    }
    const double expected = turns_ + rate_ * samples;
    const double off = fraction - expected;
    const double now = expected + off - std::nearbyint(off);
    rate_ = (now - turns_) / samples;
    return turns_ = now;
  }
  double now() const { return turns_; }
  // It begins here, whole turns and all.
  void begin(double turns) { known_ = true, turns_ = turns; }
  bool known() const { return known_; }

 private:
  bool known_ = false;
  double turns_ = 0.0;
  double rate_ = 0.0;  // per sample
};

}  // namespace

// Frames into columns, and the check against the plan's limits.
class Recorder::Columns {
 public:
  Columns(const Scales& scales, const planning::Plan& plan, double tick_s, std::uint16_t every, Recording& out)
      : scales_(scales), plan_(plan), tick_s_(tick_s), every_(every), out_(out), channels_(channels_of(out.run)) {}

  void take(const protocol::FrameHead& head, std::uint32_t index, std::span<const std::uint32_t> words) {
    if (words.size() != channels_.size()) return;
    const std::uint32_t sequence = head.sequence + index;
    const std::uint32_t tick = head.tick + index * every_;
    if (out_.time_s.empty()) {
      first_tick_ = tick;
      next_ = sequence;
      // Frames before the first that came were lost as well.
      note_gap(sequence, 0.0);
    }
    const double time_s = static_cast<double>(tick - first_tick_) * tick_s_;
    const std::uint32_t missing = sequence - next_;
    if (missing > 0) note_gap(missing, time_s - missing * every_ * tick_s_);
    next_ = sequence + 1;
    last_tick_ = tick;
    const auto value = [&](std::size_t i) { return scales_.value(channels_[i], words[i]); };
    const double samples = 1.0 + missing;
    out_.time_s.push_back(time_s);
    out_.motor_position_rad.push_back(scales_.turn() * motor_.next(value(0), samples));
    out_.output_position_rad.push_back(scales_.turn() * output_.next(value(1), samples));
    out_.current_a.push_back(value(2));
    out_.torque_nm.push_back(value(3));
    out_.temperature_c.push_back(value(4));
    out_.command.push_back(channels_[5] == Channel::set_fraction ? set_point(words[5], samples) : value(5));
    watch();
  }
  // Of mode position, from where it began.
  // Positions of motor and output when the run begins, turns.
  void start_at(double motor, double output) {
    start_turns_ = motor;
    motor_.begin(motor);
    output_.begin(output);
  }
  bool is_set() const { return set_.known(); }
  double set_point_rad() const { return set_.known() ? scales_.turn() * (set_.now() - set_begin_) : 0.0; }
  std::uint32_t last_tick() const { return last_tick_; }
  const std::string& exceeded() const { return exceeded_; }

 private:
  // A drive that is not armed has no set point and sends zero; the first one is the shaft's position.
  double set_point(std::uint32_t word, double samples) {
    if (!set_.known()) {
      constexpr double kSame = 0.02;  // turns
      const double begin = scales_.value(Channel::set_fraction, word);
      const double from_start = begin - start_turns_;
      if (std::abs(from_start - std::nearbyint(from_start)) > kSame) return out_.motor_position_rad.back();
      const double off = begin - motor_.now();
      set_begin_ = motor_.now() + off - std::nearbyint(off);
      set_.begin(set_begin_);
      return scales_.turn() * set_begin_;
    }
    return scales_.turn() * set_.next(scales_.value(Channel::set_fraction, word), samples);
  }
  void note_gap(std::uint32_t frames, double from_s) {
    if (frames == 0) return;
    out_.lost += frames;
    ++out_.gap_count;
    if (out_.gaps.size() < kLongestGapList) out_.gaps.push_back({from_s, frames});
  }
  void watch() {
    const planning::Limits& limits = plan_.limits;
    const bool is_linear = scales_.is_linear();
    const std::size_t n = out_.time_s.size();
    constexpr std::size_t kOver10 = 10;
    if (n <= kOver10 || !exceeded_.empty()) return;
    const auto too_much = [&](const char* what, double seen, double limit, const char* unit) {
      if (limit > 0.0 && seen > kOver * limit)
        exceeded_ = fmt::format("{} of {:.4g} {} is above the plan's limit of {:g} {}", what, seen, unit, limit, unit);
    };
    const auto& q = out_.motor_position_rad;
    too_much("a velocity",
             std::abs(q[n - 1] - q[n - 1 - kOver10]) / (out_.time_s[n - 1] - out_.time_s[n - 1 - kOver10]),
             limits.velocity_rad_s, is_linear ? "m/s" : "rad/s");
    double current = 0.0;
    for (std::size_t i = n - kOver10; i < n; ++i) current += out_.current_a[i] / kOver10;
    too_much("a current", std::abs(current), limits.current_a, "A");
    low_ = std::min(low_, out_.output_position_rad.back());
    high_ = std::max(high_, out_.output_position_rad.back());
    too_much("a travel of the output", high_ - low_, limits.travel_rad, is_linear ? "m" : "rad");
  }

  const Scales& scales_;
  const planning::Plan& plan_;
  double tick_s_;
  std::uint16_t every_;
  Recording& out_;
  std::vector<Channel> channels_;
  Unwrapped motor_, output_, set_;
  double set_begin_ = 0.0, start_turns_ = 0.0;
  std::uint32_t first_tick_ = 0, last_tick_ = 0, next_ = 0;
  double low_ = 1e300, high_ = -1e300;
  std::string exceeded_;
};

Recorder::Recorder(Session& session, const Scales& scales, const planning::Plan& plan, bool compensates)
    : session_(session), scales_(scales), plan_(plan), compensates_(compensates) {
  const double ticks = plan.sample_s * session.identity().tick_hz;
  if (!(ticks >= 1.0 && ticks <= 65535.0) || std::abs(ticks - std::round(ticks)) > 1e-6 * ticks)
    session.fail(
        fmt::format("a sample every {:g} s is no whole number of its ticks ({} a second); change sample_s of "
                    "the plan",
                    plan.sample_s, session.identity().tick_hz));
  every_ = static_cast<std::uint16_t>(std::lround(ticks));
  for (const planning::Run& run : plan.runs) {
    if (run.mode == planning::Mode::position) {
      const PositionMotion checked(run, plan.limits, scales);
      continue;
    }
    if (run.mode == planning::Mode::off) continue;
    const auto setup = planning::excitation_of(run, 1.0 / session.identity().tick_hz);
    const bool is_current = run.mode == planning::Mode::current;
    const double limit = is_current ? plan.limits.current_a : plan.limits.velocity_rad_s;
    if (limit > 0.0 && setup.limit > 1.001 * limit)
      throw planning::PlanError(
          fmt::format("run \"{}\": its set point goes up to {:g}, beyond the plan's limit of {:g}; "
                      "lower its amplitude or offset",
                      run.name, setup.limit, limit));
  }
}

void Recorder::send_excitation(const planning::Run& run) {
  const effects::DriveConstants<double>& d = scales_.constants;
  auto setup = planning::excitation_of(run, 1.0 / session_.identity().tick_hz);
  const bool is_torque = run.mode == planning::Mode::current;
  if (is_torque) {
    const double km = d.torque_constant;
    setup.amplitude *= km, setup.offset *= km, setup.limit *= km, setup.slope_limit *= km;
    if (plan_.limits.velocity_rad_s > 0.0) {
      const double bound = std::ldexp(scales_.header.limits.overspeed.raw, -fixed::kValueBits) * d.velocity_base;
      setup.velocity_limit = std::min(plan_.limits.velocity_rad_s, 0.9 * bound);
      setup.overspeed = std::min(1.15 * setup.velocity_limit, bound);
    }
  }
  // Nothing moves: the least number that a limit can be.
  const double base = is_torque ? d.torque_base : d.velocity_base;
  setup.limit = std::max(setup.limit, 1e-6 * base);
  setup.slope_limit = std::max(setup.slope_limit, setup.limit);
  fixed::OverflowLog::clear();
  const auto c = control::Excitation::derive<fixed::Fixed>(setup, base, d);
  if (fixed::OverflowLog::count() != 0)
    session_.fail(fmt::format("run \"{}\" does not fit the drive: {}", run.name, fixed::OverflowLog::first()));
  protocol::send_excitation(c, is_torque, [this](Kind kind, const auto& payload) {
    session_.ask(kind, payload);
    return true;
  });
}

void Recorder::clear_fault() {
  if (session_.status().mode == protocol::Mode::fault) session_.command({.kind = protocol::CommandKind::clear_fault});
}

protocol::Reference Recorder::reference() {
  return session_.identity().minor < protocol::kMinorOfHardware ? protocol::Reference{} : session_.reference();
}

// Positions of motor and output, whole turns included; the drive sends them in telemetry alone.
Recorder::ShaftPositions Recorder::read_shaft_positions() {
  session_.subscribe({Channel::motor_turns, Channel::motor_fraction, Channel::output_turns, Channel::output_fraction},
                     20);
  std::optional<ShaftPositions> shaft;
  const auto end = Clock::now() + kSilence;
  while (!shaft && Clock::now() < end) {
    const auto m = session_.next(Milliseconds(20));
    if (!m || !m->is_unasked()) continue;
    protocol::for_each_frame(*m, [&](const auto&, auto, std::span<const std::uint32_t> words) {
      const auto angle = [&](std::size_t i) {
        return std::int64_t{static_cast<std::int32_t>(words[i])} * (std::int64_t{1} << 32) + std::int64_t{words[i + 1]};
      };
      if (words.size() == 4) shaft = {angle(0), angle(2)};
    });
  }
  if (!shaft) session_.fail("it does not report the position of its shaft; check cable and power, then try again");
  return *shaft;
}

protocol::Mode Recorder::start(const planning::Run& run, std::optional<PositionMotion>& position) {
  if (run.mode == planning::Mode::position) {
    session_.command(position->arm(compensates_));
    return protocol::Mode::position;
  }
  session_.command({.kind = protocol::CommandKind::arm, .mode = protocol::Mode::excitation});
  return protocol::Mode::excitation;
}

// The exchange with the drive during a run: set points or signs of life out, telemetry in.
class Recorder::Exchange {
 public:
  Exchange(Session& session, const planning::Run& run, std::optional<PositionMotion>& position, Columns& columns,
           Recording& out, const Watch& watch)
      : session_(session), run_(run), position_(position), columns_(columns), out_(out), watch_(watch) {
    const double tick_s = 1.0 / session.identity().tick_hz;
    report_ticks_ = static_cast<std::uint32_t>((position ? kSetPoint_s : kHeartbeatTick_s) / tick_s);
  }

  // Until the run is over, a limit is exceeded, the user stops it or the drive leaves its mode.
  void follow(protocol::Mode mode) {
    mode_ = mode;
    reported_at_ = Clock::now();
    Silence silence(kSilence, reported_at_);
    while (true) {
      const auto m = session_.next(kWait);
      now_ = Clock::now();
      silence.waited(kWait, m.has_value(), now_);
      if (m && m->is_unasked())
        take_frames(*m);
      else if (m && has_left_mode(*m))
        return;
      if (is_over()) return;
      if (silence.is_too_long()) session_.fail("the drive went silent; check cable and power");
      if (is_due()) report();
    }
  }

  // What is on its way yet.
  void drain(std::uint32_t last_tick) {
    while (const auto m = session_.next(Milliseconds(15))) {
      if (!m->is_unasked()) continue;
      take_frames(*m);
      if (columns_.last_tick() >= last_tick || static_cast<std::int32_t>(columns_.last_tick() - last_tick) >= 0) break;
    }
  }

 private:
  double time_s() const { return out_.time_s.empty() ? 0.0 : out_.time_s.back(); }
  bool moves() const { return run_.mode != planning::Mode::off; }

  void take_frames(const protocol::Message& m) {
    protocol::for_each_frame(m, [&](const auto& head, std::uint32_t i, auto words) { columns_.take(head, i, words); });
  }

  // By the answer to the last command.
  bool has_left_mode(const protocol::Message& m) {
    if (!waits_ || m.number != command_number_) return false;
    waits_ = false;
    protocol::CommandAnswer answer;
    if (!moves() || protocol::take_payload(m.content(), answer) != protocol::Code::done || answer.mode == mode_)
      return false;
    out_.complete = !position_ && answer.mode == protocol::Mode::idle;
    return true;
  }

  bool is_over() {
    const double time = time_s();
    if (position_ && !began_s_ && columns_.is_set()) began_s_ = time;
    if (position_ && !began_s_ && time > kStart_s) session_.fail("it does not take up its position; try again");
    if ((began_s_ && time - *began_s_ >= run_.duration_s) || (!moves() && time >= run_.duration_s)) {
      out_.complete = true;
      return true;
    }
    if (!columns_.exceeded().empty()) out_.ended = columns_.exceeded();
    if (watch_.stops && watch_.stops()) out_.ended = "interrupted";
    return !out_.ended.empty();
  }

  bool is_due() const {
    const bool is_late = now_ - reported_at_ > Milliseconds(500);
    return (!waits_ || is_late) && (now_ - reported_at_ >= (position_ ? kSetPoint : kHeartbeat) ||
                                    columns_.last_tick() - reported_tick_ >= report_ticks_);
  }

  void report() {
    waits_ = true;
    const protocol::Command command =
        began_s_ ? position_->at(time_s() - *began_s_, columns_.set_point_rad()) : protocol::Command{};
    command_number_ = session_.post(protocol::request(Kind::command, 0, command));
    reported_at_ = now_;
    reported_tick_ = columns_.last_tick();
    if (watch_.progress) watch_.progress(time_s());
    if (watch_.seen) watch_.seen(out_);
  }

  Session& session_;
  const planning::Run& run_;
  std::optional<PositionMotion>& position_;
  Columns& columns_;
  Recording& out_;
  const Watch& watch_;
  protocol::Mode mode_ = protocol::Mode::idle;
  Clock::time_point now_, reported_at_;
  std::uint32_t report_ticks_ = 0, reported_tick_ = 0;
  std::optional<double> began_s_;  // of position
  bool waits_ = false;
  std::uint8_t command_number_ = 0;
};

// It starts, or comes to rest from what was before.
void Recorder::require_idle() {
  protocol::Status before = session_.status();
  for (int i = 0; i < 150 && (before.mode == protocol::Mode::boot || before.mode == protocol::Mode::stop); ++i) {
    std::this_thread::sleep_for(Milliseconds(10));
    before = session_.status();
  }
  if (before.mode == protocol::Mode::fault)
    session_.fail(fmt::format("it is in the fault state: {}; find its cause, then record with --clear-fault",
                              protocol::fault_text(before.fault, before.fault_limit).reason));
  if (before.mode != protocol::Mode::idle)
    session_.fail(fmt::format("it is in mode {}, not idle; another program may have it", name_of(before.mode)));
}

Recording Recorder::record(const planning::Run& run, const Watch& watch) {
  Recording out;
  out.run = run;
  require_idle();
  std::optional<PositionMotion> position;
  // Fractions of turns alone would put each run somewhere else, and the torsion between motor and output with it.
  const ShaftPositions shaft = read_shaft_positions();
  const bool moves = run.mode != planning::Mode::off;
  if (run.mode == planning::Mode::position) {
    position.emplace(run, plan_.limits, scales_);
    position->start_at(shaft.motor);
  } else if (moves) {
    send_excitation(run);
  }
  Columns columns(scales_, plan_, 1.0 / session_.identity().tick_hz, every_, out);
  columns.start_at(turns_of(shaft.motor), turns_of(shaft.output));
  Exchange exchange(session_, run, position, columns, out, watch);
  try {
    session_.subscribe(channels_of(run), every_);
    exchange.follow(moves ? start(run, position) : protocol::Mode::idle);
    session_.stop();
    const protocol::Status after = session_.status();
    out.dropped = after.dropped;
    exchange.drain(after.tick);
    session_.subscribe({}, 1);
    if (!out.complete && out.ended.empty()) {
      const protocol::FaultText fault = protocol::fault_text(after.fault, after.fault_limit);
      out.ended = fmt::format("fault {}: {}", fault.name, fault.reason);
    }
  } catch (const std::exception&) {
    session_.stop();
    throw;
  }
  return out;
}

}  // namespace flexspline::drive
