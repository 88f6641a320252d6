#include "host/app/workbench/live_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <nlohmann/json.hpp>

#include "host/drive_link/drive/model_block.hpp"
#include "host/drive_link/drive/residual_map_json.hpp"
#include "host/output/answers/json.hpp"
#include "shared/fixed/turn.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::workbench {
namespace {

using nlohmann::json;
using protocol::Channel;
using Clock = std::chrono::steady_clock;

constexpr double kRateHz = 25.0;
constexpr std::size_t kStoredSamples = 1500;  // a minute
// No page reads it any more.
constexpr auto kIdle = std::chrono::seconds(10);
constexpr auto kSilence = std::chrono::seconds(5);

const std::vector<Channel> kChannels{Channel::velocity,           Channel::current,        Channel::torque,
                                     Channel::feedforward_torque, Channel::command_torque, Channel::disturbance};

// A drive or a model may have changed while its user read the preview.
void require_shown(const std::optional<PreviewedBlocks>& shown, const drive::Bytes& before, const drive::Bytes& after) {
  if (shown && (drive::view_of(before).sha256 != shown->before || drive::view_of(after).sha256 != shown->after))
    throw drive::DriveError("the block on the drive or the model is not the one of the preview; preview it again");
}

// Fast and slower sines and a slow triangle, so that all velocity bins of the map are filled for long enough.
planning::Plan motion_of(const drive::Scales& scales) {
  const double limit =
      std::ldexp(scales.header.limits.velocity.raw, -fixed::kValueBits) * scales.constants.velocity_base;
  planning::Plan plan;
  const auto add = [&](std::string name, planning::Waveform waveform, double amplitude, double hz, double duration_s) {
    planning::Run run;
    run.name = std::move(name);
    run.mode = planning::Mode::position;
    run.waveform = waveform;
    run.frequency_hz = hz;
    run.amplitude = amplitude;
    run.duration_s = duration_s;
    plan.runs.push_back(std::move(run));
  };
  add("fast", planning::Waveform::sine, 0.4 * limit / (kTurn * 0.5), 0.5, 4.0);
  add("slower", planning::Waveform::sine, 0.1 * limit / (kTurn * 0.5), 0.5, 4.0);
  add("creeping", planning::Waveform::triangle, 0.015 * limit / (4.0 * 0.25), 0.25, 8.0);
  return plan;
}

// Gives requests priority over the listener, which takes the lock repeatedly.
class PriorityLock {
 public:
  PriorityLock(std::mutex& mutex, std::atomic<int>& waiting) : waiting_(waiting) {
    ++waiting_;
    lock_ = std::unique_lock(mutex);
    --waiting_;
  }

 private:
  std::atomic<int>& waiting_;
  std::unique_lock<std::mutex> lock_;
};

}  // namespace

LiveDrive::LiveDrive(std::string drive, ConnectionOptions reaching)
    : given_(std::move(drive)), connection_(std::move(reaching)) {
  listener_ = std::thread([this] { listen(); });
}

LiveDrive::~LiveDrive() {
  ends_ = true;
  listener_.join();
}

void LiveDrive::require() const {
  if (away_) throw drive::DriveError("the drive is moving; wait until it is at rest, or cancel that");
  if (!session_) throw drive::DriveError("no drive is connected; connect one first");
}

void LiveDrive::read_block() {
  active_ = session_->read_block(protocol::Which::active);
  scales_ = drive::scales_of(active_);
}

void LiveDrive::forget(const std::string& why) {
  session_.reset();
  scales_.reset();
  active_.clear();
  reconnection_.reset();
  subscribed_ = came_back_ = false;
  problem_ = why;
}

// The drive is gone without a request of the user.
void LiveDrive::lose(const std::string& why) {
  if (!session_) return;
  // A link that is lost again soon is tried less often.
  pause_ = Clock::now() - back_ < connection_.most ? std::min(2 * pause_, connection_.most) : connection_.first;
  Reconnection reconnection{drive_, session_->serial(), 0, "", Clock::now() + pause_};
  forget(why);
  reconnection_ = std::move(reconnection);
}

// Runs a request to the drive; a lost link is noticed here, also while no page reads its signals.
template <class Act>
auto LiveDrive::noticing_losses(const Act& act) {
  try {
    return act();
  } catch (const transport::LinkError& gone) {
    lose(gone.what());
    throw;
  }
}

void LiveDrive::try_again() {
  std::string drive;
  std::uint64_t wish = 0;
  {
    const std::lock_guard lock(mutex_);
    if (!reconnection_ || Clock::now() < reconnection_->next) return;
    drive = reconnection_->drive;
    wish = wishes_;
  }
  // The lock is free while it is opened, which may take seconds.
  std::unique_ptr<drive::Session> session;
  std::string why;
  try {
    session = std::make_unique<drive::Session>(connection_.open(drive));
  } catch (const std::exception& error) {
    why = error.what();
  }
  const PriorityLock turn(mutex_, waiting_);
  if (!reconnection_ || wish != wishes_) return;
  if (session && session->serial() != reconnection_->serial)
    return forget(fmt::format("{} was lost; at {} there is another drive now, {}: connect it if it is the right one",
                              reconnection_->serial, drive, session->serial()));
  if (session) {
    const Reconnection before = *reconnection_;
    const std::string lost = problem_;
    try {
      session_ = std::move(session);
      read_block();
      reconnection_.reset();
      problem_.clear();
      came_back_ = true;
      back_ = Clock::now();
      return;
    } catch (const std::exception& error) {
      forget(lost);
      reconnection_ = before;
      why = error.what();
    }
  }
  ++reconnection_->attempts;
  reconnection_->why = why;
  pause_ = std::min(2 * pause_, connection_.most);
  reconnection_->next = Clock::now() + pause_;
}

void LiveDrive::connect(const std::string& drive) {
  const auto reach = in_reach();
  if (std::none_of(reach.begin(), reach.end(), [&](const json& d) { return d["drive"] == drive; }))
    throw drive::DriveError(fmt::format("\"{}\" is not in reach; start the workbench with --drive {}", drive, drive));
  const PriorityLock turn(mutex_, waiting_);
  if (away_) require();
  ++wishes_;
  forget("");
  drive_ = drive;
  // A socket is a twin's (host/drive_link/transport/link.hpp).
  simulated_ = drive == "twin" || drive == transport::kThreePhaseTwin || drive.starts_with("tcp:");
  try {
    session_ = std::make_unique<drive::Session>(connection_.open(drive));
    read_block();
  } catch (const std::exception& error) {
    forget(error.what());
    throw;
  }
}

void LiveDrive::disconnect() {
  const PriorityLock turn(mutex_, waiting_);
  if (away_) require();
  ++wishes_;
  forget("");
}

json LiveDrive::in_reach() const {
  json list = json::array();
  const auto add = [&](const std::string& drive, const std::string& what, bool usable, const std::string& problem) {
    list.push_back({{"drive", drive}, {"what", what}, {"usable", usable}, {"problem", problem}});
  };
  if (!given_.empty()) add(given_, "as --drive names it", true, "");
  for (const transport::Found& found : transport::find_drives())
    if (found.drive != given_) add(found.drive, found.what, found.usable, found.problem);
  if (given_ != "twin") add("twin", "a simulated drive with the firmware", true, "");
  return list;
}

json LiveDrive::status() const {
  const PriorityLock turn(mutex_, waiting_);
  return away_ ? *away_ : drive_status();
}

json LiveDrive::drive_status() const {
  json answer{{"given", given_}, {"connected", session_ != nullptr}, {"problem", problem_},     {"block", nullptr},
              {"moving", false}, {"simulated", simulated_},          {"came_back", came_back_}, {"again", nullptr}};
  if (reconnection_)
    answer["again"] = {
        {"drive", reconnection_->drive}, {"attempts", reconnection_->attempts}, {"why", reconnection_->why}};
  if (session_) {
    answer["name"] = session_->name();
    answer["serial"] = session_->serial();
    answer["board"] = session_->board();
    answer["block"] = view_json(drive::view_of(active_));
  }
  return answer;
}

json LiveDrive::preview_flash(const model::Model& model, const std::function<void(std::string_view)>& progress,
                              ComparedBlocks* compared) {
  const PriorityLock turn(mutex_, waiting_);
  require();
  return noticing_losses([&]() -> json {
    progress("proving the block and comparing it with double");
    read_block();
    const drive::ModelBlock made = drive::model_block(*session_, active_, model);
    json preview = comparison_json(active_, made.bytes);
    preview["warnings"] = made.warnings;
    preview["restores"] = false;
    if (compared != nullptr) *compared = {active_, made.bytes};
    return preview;
  });
}

json LiveDrive::preview_restore() {
  const PriorityLock turn(mutex_, waiting_);
  require();
  return noticing_losses([&]() -> json {
    read_block();
    const drive::Bytes previous = session_->read_block(protocol::Which::previous);
    if (previous.empty()) session_->fail("it has no block before the active one");
    json preview = comparison_json(active_, previous);
    preview["warnings"] = json::array();
    preview["restores"] = true;
    return preview;
  });
}

json LiveDrive::flash(const model::Model& model, const std::function<void(std::string_view)>& progress,
                      const std::optional<PreviewedBlocks>& shown) {
  const PriorityLock turn(mutex_, waiting_);
  require();
  return noticing_losses([&]() -> json {
    progress("proving the block and comparing it with double");
    read_block();
    const drive::ModelBlock made = drive::model_block(*session_, active_, model);
    require_shown(shown, active_, made.bytes);
    json answer = comparison_json(active_, made.bytes);
    const bool is_new = made.bytes != active_;
    if (is_new) {
      const drive::Unlocked unlocked(*session_, connection_.signer);
      session_->write_block(made.bytes, [&](std::size_t sent) {
        progress(fmt::format("flashing: {} of {} bytes", sent, made.bytes.size()));
      });
    }
    read_block();
    subscribed_ = came_back_ = false;
    answer.update({{"warnings", made.warnings}, {"flashed", is_new}, {"drive", session_->serial()}});
    return answer;
  });
}

json LiveDrive::restore(const std::optional<PreviewedBlocks>& shown) {
  const PriorityLock turn(mutex_, waiting_);
  require();
  return noticing_losses([&]() -> json {
    const drive::BlockView before = drive::view_of(active_);
    if (shown) {
      read_block();
      require_shown(shown, active_, session_->read_block(protocol::Which::previous));
    }
    {
      const drive::Unlocked unlocked(*session_, connection_.signer);
      session_->restore();
    }
    read_block();
    subscribed_ = came_back_ = false;
    return {{"before", view_json(before)}, {"after", view_json(drive::view_of(active_))}};
  });
}

json LiveDrive::residual_map() {
  const PriorityLock turn(mutex_, waiting_);
  try {
    require();
    if (!scales_) throw drive::DriveError("the drive has no block, so nothing to compare its torque with; flash one");
    return noticing_losses([&]() -> json {
      const bool started = drive::start_residual_map(*session_, connection_.signer);
      const drive::ResidualMap map = drive::read_residual_map(*session_, *scales_);
      const double limit_nm = drive::usual_map_limit_nm(*scales_);
      json answer = drive::map_json(map, drive::test_map(map, limit_nm), limit_nm);
      answer["started"] = started;
      answer["model"] = drive::view_of(active_).model;
      return answer;
    });
  } catch (const std::runtime_error& error) {
    return {{"problem", error.what()}};
  }
}

void LiveDrive::reset_residual_map() {
  const PriorityLock turn(mutex_, waiting_);
  require();
  noticing_losses([&] { drive::reset_residual_map(*session_, connection_.signer); });
}

// A recording has fewer signals than the page shows; the others stay empty while it moves.
void LiveDrive::show(const drive::Recording& so_far, double after_s) {
  constexpr std::size_t kSpan = 10;  // samples over which position is differentiated
  const std::size_t n = so_far.time_s.size();
  if (n <= kSpan) return;
  const double now_s = so_far.time_s.back();
  const double velocity = (so_far.motor_position_rad[n - 1] - so_far.motor_position_rad[n - 1 - kSpan]) /
                          (now_s - so_far.time_s[n - 1 - kSpan]);
  const PriorityLock turn(mutex_, waiting_);
  if (!samples_.empty() && after_s + now_s < samples_.back().time_s + 1.0 / kRateHz) return;
  Sample s{after_s + now_s, {}};
  for (const Channel c : kChannels)
    s.values.push_back(c == Channel::velocity  ? velocity
                       : c == Channel::current ? so_far.current_a.back()
                       : c == Channel::torque  ? so_far.torque_nm.back()
                                               : std::numeric_limits<double>::quiet_NaN());
  samples_.push_back(std::move(s));
  ++count_;
  if (samples_.size() > kStoredSamples) samples_.pop_front();
}

void LiveDrive::move(const std::function<void(std::string_view)>& progress) {
  std::unique_ptr<drive::Session> session;
  drive::Scales scales;
  {
    const PriorityLock turn(mutex_, waiting_);
    require();
    if (!simulated_)
      throw drive::DriveError(
          "only a simulated drive is moved from here; move this one with flexspline record --compensate, where you see "
          "what is in its way");
    if (!scales_) throw drive::DriveError("the drive has no block, so it cannot move; flash one");
    drive::start_residual_map(*session_, connection_.signer);
    scales = *scales_;
    away_ = std::make_unique<json>(drive_status());
    (*away_)["moving"] = true;
    session = std::move(session_);
    subscribed_ = false;
    mode_ = protocol::name_of(protocol::Mode::position);
    samples_.clear();
  }
  std::exception_ptr failure;
  try {
    const planning::Plan plan = motion_of(scales);
    drive::Recorder recorder(*session, scales, plan, true);
    recorder.clear_fault();  // a simulated drive has no obstacles
    double after_s = 0.0;
    for (const planning::Run& run : plan.runs) {
      // It is at rest when this returns, except for errors of the link.
      const drive::Recording made = recorder.record(
          run,
          {.stops = [] { return false; },
           .progress =
               [&](double time_s) { progress(fmt::format("{}: {:.1f} of {:g} s", run.name, time_s, run.duration_s)); },
           .seen = [&](const drive::Recording& so_far) { show(so_far, after_s); }});
      after_s += made.time_s.empty() ? 0.0 : made.time_s.back();
      if (!made.complete) throw drive::DriveError(fmt::format("the motion ended early: {}", made.ended));
    }
  } catch (...) {
    failure = std::current_exception();
    session->stop();
  }
  {
    const PriorityLock turn(mutex_, waiting_);
    session_ = std::move(session);
    away_.reset();
    try {
      if (failure) std::rethrow_exception(failure);
    } catch (const transport::LinkError& gone) {
      lose(gone.what());
      throw;
    }
  }
}

json LiveDrive::live(std::uint64_t since) {
  const PriorityLock turn(mutex_, waiting_);
  asked_ = Clock::now();
  json channels = json::array(), samples = json::array();
  for (const Channel c : kChannels)
    channels.push_back(
        {{"name", protocol::text_of(c).name}, {"unit", scales_ ? scales_->unit(c) : protocol::text_of(c).unit}});
  const std::uint64_t oldest = count_ - samples_.size();
  for (std::uint64_t k = std::max(since, oldest); k < count_; ++k) {
    const Sample& s = samples_[static_cast<std::size_t>(k - oldest)];
    json one = json::array({s.time_s});
    for (const double v : s.values) one.push_back(output::json_number(v));
    samples.push_back(std::move(one));
  }
  return {{"connected", session_ != nullptr || away_ != nullptr},
          {"has_block", scales_.has_value()},
          {"problem", problem_},
          {"attempts", reconnection_ ? reconnection_->attempts : 0},
          {"channels", std::move(channels)},
          {"rate_hz", kRateHz},
          {"next", count_},
          {"mode", mode_},
          {"samples", std::move(samples)}};
}

void LiveDrive::listen() {
  while (!ends_) {
    try_again();
    std::unique_lock lock(mutex_, std::defer_lock);
    if (waiting_ == 0) lock.lock();
    const bool wanted = lock.owns_lock() && session_ && scales_ && Clock::now() - asked_ < kIdle;
    try {
      if (wanted && !subscribed_) {
        std::vector<Channel> channels{Channel::state};
        for (const Channel c : kChannels) channels.push_back(c);
        const double every = std::clamp(std::round(session_->identity().tick_hz / kRateHz), 1.0, 65535.0);
        session_->subscribe(channels, static_cast<std::uint16_t>(every));
        subscribed_ = true;
        samples_.clear();
        first_tick_ = 0;
        silence_.emplace(kSilence, Clock::now());
      } else if (lock.owns_lock() && session_ && subscribed_ && !wanted) {
        session_->subscribe({}, 1);
        subscribed_ = false;
      }
      if (wanted) {
        constexpr drive::Milliseconds kWait{20};
        const auto message = session_->next(kWait);
        silence_->waited(kWait, message.has_value(), Clock::now());
        const double every = std::clamp(std::round(session_->identity().tick_hz / kRateHz), 1.0, 65535.0);
        if (message && message->is_unasked())
          protocol::for_each_frame(
              *message, [&](const protocol::FrameHead& head, std::uint32_t i, std::span<const std::uint32_t> words) {
                if (words.size() != kChannels.size() + 1) return;
                const std::uint32_t tick = head.tick + i * static_cast<std::uint32_t>(every);
                if (samples_.empty() && first_tick_ == 0) first_tick_ = tick;
                mode_ = protocol::name_of(static_cast<protocol::Mode>(words[0] & 0xFF));
                Sample s{static_cast<double>(tick - first_tick_) / session_->identity().tick_hz, {}};
                for (std::size_t k = 0; k < kChannels.size(); ++k)
                  s.values.push_back(scales_->value(kChannels[k], words[k + 1]));
                samples_.push_back(std::move(s));
                ++count_;
                if (samples_.size() > kStoredSamples) samples_.pop_front();
              });
        if (silence_->is_too_long())
          session_->fail("the drive went silent; check cable and power, then connect it again");
      }
    } catch (const std::exception& error) {
      lose(error.what());
    }
    if (lock.owns_lock()) lock.unlock();
    std::this_thread::sleep_for(wanted ? std::chrono::milliseconds(2) : std::chrono::milliseconds(30));
  }
}

}  // namespace flexspline::workbench
