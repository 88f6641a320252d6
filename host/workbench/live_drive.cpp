#include "host/workbench/live_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/drive/block_changes.hpp"
#include "host/drive/model_block.hpp"
#include "host/output/json.hpp"
#include "shared/protocol/texts.hpp"

namespace flexspline::workbench {
namespace {

using nlohmann::json;
using protocol::Channel;
using Clock = std::chrono::steady_clock;

constexpr double kRateHz = 25.0;
constexpr std::size_t kKept = 1500;  // a minute
// Nobody looks any more.
constexpr auto kIdle = std::chrono::seconds(10);
constexpr auto kSilence = std::chrono::seconds(5);

const std::vector<Channel> kChannels{Channel::velocity,           Channel::current,        Channel::torque,
                                     Channel::feedforward_torque, Channel::command_torque, Channel::disturbance};

json view_json(const drive::BlockView& view) {
  if (view.bytes == 0) return nullptr;
  return {{"model", view.model}, {"bytes", view.bytes}, {"sha256", view.sha256}};
}

json changes_json(const std::vector<drive::BlockChange>& changes) {
  json list = json::array();
  for (const drive::BlockChange& c : changes)
    list.push_back({{"effect", c.effect},
                    {"change", c.what},
                    {"parameter", c.parameter},
                    {"before", output::json_number(c.before)},
                    {"after", output::json_number(c.after)},
                    {"unit", c.unit}});
  return list;
}

// Lets requests pass before the listener, which takes the lock again and again.
class Turn {
 public:
  Turn(std::mutex& mutex, std::atomic<int>& waiting) : waiting_(waiting) {
    ++waiting_;
    lock_ = std::unique_lock(mutex);
    --waiting_;
  }

 private:
  std::atomic<int>& waiting_;
  std::unique_lock<std::mutex> lock_;
};

}  // namespace

LiveDrive::LiveDrive(std::string drive) : given_(std::move(drive)) {
  listener_ = std::thread([this] { listen(); });
}

LiveDrive::~LiveDrive() {
  ends_ = true;
  listener_.join();
}

void LiveDrive::require() const {
  if (!session_) throw drive::DriveError("no drive is connected; connect one first");
}

void LiveDrive::read_block() {
  active_ = session_->read_block(protocol::Which::active);
  scales_ = drive::scales_of(active_);
}

void LiveDrive::lose(const std::string& why) {
  session_.reset();
  scales_.reset();
  active_.clear();
  subscribed_ = false;
  problem_ = why;
}

void LiveDrive::connect(const std::string& drive) {
  const auto reach = in_reach();
  if (std::none_of(reach.begin(), reach.end(), [&](const json& d) { return d["drive"] == drive; }))
    throw drive::DriveError(fmt::format("\"{}\" is not in reach; start the workbench with --drive {}", drive, drive));
  const Turn turn(mutex_, waiting_);
  lose("");
  try {
    session_ = std::make_unique<drive::Session>(transport::open_link(drive));
    read_block();
  } catch (const std::exception& error) {
    lose(error.what());
    throw;
  }
}

void LiveDrive::disconnect() {
  const Turn turn(mutex_, waiting_);
  lose("");
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
  const Turn turn(mutex_, waiting_);
  json answer{{"given", given_}, {"connected", session_ != nullptr}, {"problem", problem_}, {"block", nullptr}};
  if (session_) {
    answer["name"] = session_->name();
    answer["serial"] = session_->serial();
    answer["board"] = session_->board();
    answer["block"] = view_json(drive::view_of(active_));
  }
  return answer;
}

json LiveDrive::flash(const model::Model& model, const std::function<void(std::string_view)>& say) {
  const Turn turn(mutex_, waiting_);
  require();
  say("proving the block and comparing it with double");
  read_block();
  const drive::ModelBlock made = drive::model_block(*session_, active_, model);
  const auto changes = drive::changes(active_, made.bytes);
  const drive::BlockView before = drive::view_of(active_), after = drive::view_of(made.bytes);
  const bool is_new = made.bytes != active_;
  if (is_new)
    session_->write_block(
        made.bytes, [&](std::size_t sent) { say(fmt::format("flashing: {} of {} bytes", sent, made.bytes.size())); });
  read_block();
  subscribed_ = false;
  return {{"before", view_json(before)}, {"after", view_json(after)}, {"changes", changes_json(changes)},
          {"warnings", made.warnings},   {"flashed", is_new},         {"drive", session_->serial()}};
}

json LiveDrive::restore() {
  const Turn turn(mutex_, waiting_);
  require();
  const drive::BlockView before = drive::view_of(active_);
  session_->restore();
  read_block();
  subscribed_ = false;
  return {{"before", view_json(before)}, {"after", view_json(drive::view_of(active_))}};
}

json LiveDrive::live(std::uint64_t since) {
  const Turn turn(mutex_, waiting_);
  asked_ = Clock::now();
  json channels = json::array(), samples = json::array();
  for (const Channel c : kChannels)
    channels.push_back({{"name", protocol::text_of(c).name}, {"unit", protocol::text_of(c).unit}});
  const std::uint64_t oldest = count_ - samples_.size();
  for (std::uint64_t k = std::max(since, oldest); k < count_; ++k) {
    const Sample& s = samples_[static_cast<std::size_t>(k - oldest)];
    json one = json::array({s.time_s});
    for (const double v : s.values) one.push_back(output::json_number(v));
    samples.push_back(std::move(one));
  }
  return {{"connected", session_ != nullptr},
          {"has_block", scales_.has_value()},
          {"problem", problem_},
          {"channels", std::move(channels)},
          {"rate_hz", kRateHz},
          {"next", count_},
          {"mode", mode_},
          {"samples", std::move(samples)}};
}

void LiveDrive::listen() {
  while (!ends_) {
    std::unique_lock lock(mutex_, std::defer_lock);
    if (waiting_ == 0) lock.lock();
    const bool wanted = lock.owns_lock() && session_ && scales_ && Clock::now() - asked_ < kIdle;
    try {
      if (wanted && !subscribed_) {
        std::vector<Channel> asked{Channel::state};
        for (const Channel c : kChannels) asked.push_back(c);
        const double every = std::clamp(std::round(session_->identity().tick_hz / kRateHz), 1.0, 65535.0);
        session_->subscribe(asked, static_cast<std::uint16_t>(every));
        subscribed_ = true;
        samples_.clear();
        first_tick_ = 0;
        heard_ = Clock::now();
      } else if (lock.owns_lock() && session_ && subscribed_ && !wanted) {
        session_->subscribe({}, 1);
        subscribed_ = false;
      }
      if (wanted) {
        const auto message = session_->next(drive::Milliseconds(20));
        if (message) heard_ = Clock::now();
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
                if (samples_.size() > kKept) samples_.pop_front();
              });
        if (Clock::now() - heard_ > kSilence)
          session_->fail("the drive went silent; check cable and power, then connect it again");
      }
    } catch (const std::exception& error) {
      lose(error.what());
    }
    const bool busy = wanted;
    if (lock.owns_lock()) lock.unlock();
    std::this_thread::sleep_for(busy ? std::chrono::milliseconds(2) : std::chrono::milliseconds(30));
  }
}

}  // namespace flexspline::workbench
