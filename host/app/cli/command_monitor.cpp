#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <deque>
#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/command_monitor.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/common/text/nearest.hpp"
#include "host/drive_link/drive/scales.hpp"
#include "host/drive_link/drive/silence.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::cli {
namespace {

using nlohmann::json;
using protocol::Channel;
using Clock = std::chrono::steady_clock;

const std::vector<Channel> kMain{
    Channel::velocity,       Channel::output_velocity, Channel::current,        Channel::torque,
    Channel::torsion,        Channel::temperature,     Channel::disturbance,    Channel::feedforward_torque,
    Channel::command_torque, Channel::motor_fraction,  Channel::output_fraction};
constexpr std::size_t kHistory = 60;

std::vector<Channel> channels_of(const std::vector<std::string>& names) {
  if (names.empty()) return kMain;
  std::vector<Channel> channels;
  for (const std::string& name : names) {
    std::vector<std::string_view> known;
    std::size_t found = protocol::kChannels;
    for (std::size_t i = 0; i < protocol::kChannels; ++i) {
      known.push_back(protocol::kChannelTexts[i].name);
      if (known.back() == name) found = i;
    }
    if (found == protocol::kChannels) {
      const std::string near = text::nearest(name, known);
      throw UsageError(fmt::format(
          "there is no channel \"{}\"; {}", name,
          near.empty() ? fmt::format("there are {}", fmt::join(known, ", ")) : fmt::format("did you mean {}?", near)));
    }
    channels.push_back(static_cast<Channel>(found));
  }
  if (channels.size() >= protocol::kMostChannels)
    throw UsageError(fmt::format("at most {} channels in addition to the state, not {}", protocol::kMostChannels - 1,
                                 channels.size()));
  return channels;
}

// A signal's last seconds in one line of characters.
std::string sparkline(const std::deque<double>& values) {
  constexpr std::string_view kBars[] = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  if (values.empty()) return {};
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  const double range = *high - *low;
  std::string text;
  for (const double value : values) {
    const double part = range > 0.0 ? (value - *low) / range : 0.0;
    text += kBars[static_cast<std::size_t>(std::min(7.0, std::floor(part * 8.0)))];
  }
  return text;
}

// How much of the torque that the drive commands is the model's own (compensation).
std::string share_of(double feedforward, double command) {
  if (command == 0.0) return "-";
  return fmt::format("{:.0f} %", 100.0 * feedforward / command);
}

struct Sample {
  double time_s = 0.0;
  std::uint32_t state = 0;
  std::vector<double> values;
  std::string mode() const { return std::string(protocol::name_of(static_cast<protocol::Mode>(state & 0xFF))); }
  protocol::FaultText fault() const { return protocol::fault_text(static_cast<std::uint8_t>(state >> 8)); }
  bool is_fault() const {
    const auto mode = static_cast<protocol::Mode>(state & 0xFF);
    return mode == protocol::Mode::fault || mode == protocol::Mode::stop;
  }
};

class Screen {
 public:
  Screen(std::vector<Channel> channels, const drive::Scales& scales, Console& console)
      : channels_(std::move(channels)), scales_(scales), console_(console), history_(channels_.size()) {}

  // `reason`: of its fault; empty: not known yet.
  void show(const Sample& s, const std::string& reason) {
    std::string text;
    if (lines_ > 0) text += fmt::format("\x1b[{}A", lines_);
    lines_ = 0;
    const auto line = [&](const std::string& content) {
      text += "\x1b[2K" + content + "\n";
      ++lines_;
    };
    const std::string known = reason.empty() ? std::string(s.fault().reason) : reason;
    line(fmt::format("{:9.2f} s  {}  {}", s.time_s, console_.bold(s.mode()), s.is_fault() ? console_.bad(known) : ""));
    std::optional<double> feedforward, command;
    for (std::size_t i = 0; i < channels_.size(); ++i) {
      history_[i].push_back(s.values[i]);
      if (history_[i].size() > kHistory) history_[i].pop_front();
      line(fmt::format("{:<20}{:>12} {:<8} {}", protocol::text_of(channels_[i]).name, output::number(s.values[i], 5),
                       scales_.unit(channels_[i]), console_.dim(sparkline(history_[i]))));
      if (channels_[i] == Channel::feedforward_torque) feedforward = s.values[i];
      if (channels_[i] == Channel::command_torque) command = s.values[i];
    }
    if (feedforward && command)
      line(fmt::format("{:<20}{:>12}", "compensation's share", share_of(*feedforward, *command)));
    fmt::print("{}", text);
    std::fflush(stdout);
  }

 private:
  std::vector<Channel> channels_;
  const drive::Scales& scales_;
  Console& console_;
  std::vector<std::deque<double>> history_;
  int lines_ = 0;
};

// Frames of the drive, shown as they come.
class Monitor {
 public:
  Monitor(drive::Session& session, const MonitorOptions& options, Console& console)
      : session_(session),
        options_(options),
        console_(console),
        channels_(channels_of(options.channels)),
        scales_(drive::scales_of(session)),
        tick_hz_(session.identity().tick_hz),
        every_(static_cast<std::uint16_t>(std::clamp(std::round(tick_hz_ / options.rate_hz), 1.0, 65535.0))),
        is_terminal_(isatty(STDOUT_FILENO) != 0 && options.json != "-"),
        screen_(channels_, scales_, console) {}

  void run() {
    if (!is_terminal_) print_head();
    const Interruptible interruptible;
    std::vector<Channel> subscribed{Channel::state};
    for (const Channel c : channels_) subscribed.push_back(c);
    session_.subscribe(subscribed, every_);
    const auto begin = Clock::now();
    constexpr transport::Milliseconds kWait{20}, kSilence{3000};
    drive::Silence silence(kSilence, begin);
    while (!Interruptible::interrupted()) {
      const auto now = Clock::now();
      if (options_.seconds > 0.0 && std::chrono::duration<double>(now - begin).count() >= options_.seconds) break;
      const auto m = session_.next(kWait);
      silence.waited(kWait, m.has_value(), drive::Silence::Clock::now());
      if (m && m->is_unasked())
        protocol::for_each_frame(*m, [this](const auto& head, auto i, auto words) { take(head, i, words); });
      if (asks_reason_) ask_reason();
      if (silence.is_too_long()) session_.fail("the drive went silent; check cable and power, then try again");
    }
    session_.subscribe({}, 1);
    if (lost_ > 0) console_.warn(fmt::format("{} frames were lost", lost_));
  }

  json answer() const {
    json names = json::array();
    for (const Channel c : channels_) names.push_back({{"name", protocol::text_of(c).name}, {"unit", scales_.unit(c)}});
    return {{"format", "flexspline-monitor/1"},
            {"drive", {{"serial", session_.serial()}, {"board", session_.board()}}},
            {"channels", names},
            {"frames_lost", lost_},
            {"fault_reason", reason_.empty() ? json() : json(reason_)},
            {"samples", samples_}};
  }

 private:
  void print_head() {
    std::string head = "time_s,mode,fault";
    for (const Channel c : channels_)
      head += fmt::format(",{}{}", protocol::text_of(c).name,
                          scales_.unit(c).empty() ? "" : fmt::format(" [{}]", scales_.unit(c)));
    console_.line(head);
  }

  // Frames name the fault; why an amplifier switched itself off is in the drive's status.
  void ask_reason() {
    asks_reason_ = false;
    const protocol::Status status = session_.status();
    if (status.fault == 0) return;
    reason_ = protocol::fault_text(status.fault, status.fault_limit).reason;
    if (!is_terminal_) console_.warn(reason_);
  }
  void note_fault(const Sample& s) {
    if (s.is_fault() && !was_fault_) {
      asks_reason_ = true;
      reason_.clear();
    }
    was_fault_ = s.is_fault();
  }

  void take(const protocol::FrameHead& head, std::uint32_t i, std::span<const std::uint32_t> words) {
    if (words.size() != channels_.size() + 1) return;
    const std::uint32_t tick = head.tick + i * every_;
    if (!first_tick_) first_tick_ = tick;
    lost_ += head.sequence + i - next_;
    next_ = head.sequence + i + 1;
    Sample s{static_cast<double>(tick - *first_tick_) / tick_hz_, words[0], {}};
    for (std::size_t k = 0; k < channels_.size(); ++k) s.values.push_back(scales_.value(channels_[k], words[k + 1]));
    note_fault(s);
    if (is_terminal_)
      screen_.show(s, reason_);
    else
      print_line(s);
    if (!options_.json.empty())
      samples_.push_back(
          {{"time_s", s.time_s}, {"mode", s.mode()}, {"fault", s.fault().name}, {"values", std::move(s.values)}});
  }

  void print_line(const Sample& s) {
    std::string line = fmt::format("{:.4f},{},{}", s.time_s, s.mode(), s.fault().name);
    for (const double value : s.values) line += fmt::format(",{:.6g}", value);
    console_.line(line);
  }

  drive::Session& session_;
  const MonitorOptions& options_;
  Console& console_;
  const std::vector<Channel> channels_;
  const drive::Scales scales_;
  const double tick_hz_;
  const std::uint16_t every_;
  const bool is_terminal_;
  Screen screen_;
  std::optional<std::uint32_t> first_tick_;
  std::uint32_t next_ = 0, lost_ = 0;
  bool was_fault_ = false, asks_reason_ = false;
  std::string reason_;  // of the present or the last fault
  json samples_ = json::array();
};

int run(const MonitorOptions& options, Console& console) {
  if (options.residual_map) return run_residual_map(options, console);
  if (!options.pairing_key.empty())
    throw UsageError("--pairing-key is for --residual-map, which the drive may have to start; signals are not locked");
  channels_of(options.channels);  // a wrong name is reported before a drive is opened
  drive::Session session = open_drive(options.drive);
  Monitor monitor(session, options, console);
  console.line(named(session));
  monitor.run();
  output::save_json(options.json, monitor.answer());
  return kDone;
}

void declare(Parser& parser, MonitorOptions& options) {
  take_drive(parser, options.drive);
  parser.option("--seconds", options.seconds, "duration (default: until Ctrl-C; with --residual-map: 0)")
      .positive()
      .value("S");
  const Option rate =
      parser.option("--rate-hz", options.rate_hz, "lines per second").within(0.5, 100.0).shows_default().value("HZ");
  const Option channels =
      parser.option("--channels", options.channels, "which signals, at most 12 (default: the main ones)")
          .comma_separated()
          .value("NAME")
          .one_value_each_time();
  take_pairing_key(parser, options.pairing_key);
  const Option map = parser
                         .flag("--residual-map", options.residual_map,
                               "where the model fails: the map of the drive over velocity and motor angle")
                         .excludes(rate)
                         .excludes(channels);
  parser.flag("--reset", options.reset, "clears the residual map after showing it").needs(map);
  parser
      .option("--limit-nm", options.limit_nm,
              "smaller residuals are ignored (default: a hundredth of the motor's torque limit)")
      .positive()
      .value("NM")
      .needs(map);
}

}  // namespace

Command monitor_command() {
  return command<MonitorOptions>(
      {"monitor",
       "live signals of a drive",
       "Shows mode, faults and signals as they are; on a terminal with a curve of the last seconds behind each, else "
       "a line at a time. --json writes the samples at the end. The drive is never armed. --residual-map "
       "shows where over velocity and motor angle the model on the drive fails, and how significant that is: the "
       "drive fills the map while feedforward of its model is on (record --compensate); the first call starts its "
       "recording, and else nothing on the drive is changed.",
       {"flexspline monitor --drive twin --seconds 0.5", "flexspline monitor --drive twin --residual-map"}},
      declare, run);
}

}  // namespace flexspline::cli
