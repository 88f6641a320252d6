#include "host/input/data/message_columns.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace flexspline::data {

void MessageColumns::add(const std::string& topic, std::int64_t logged_ns, const MessageFields& fields) {
  const auto [at, is_new] = topics_.try_emplace(topic);
  if (is_new) order_.push_back(topic);
  Topic& t = at->second;
  t.logged_ns.push_back(logged_ns);
  // A header that its author did not fill has a time of zero.
  if (fields.stamp_ns && *fields.stamp_ns != 0) t.stamp_ns.push_back(*fields.stamp_ns);
  for (const auto& [name, value] : fields.numbers) {
    std::vector<double>& values = t.values[name];
    if (values.empty()) t.names.push_back(name);
    values.push_back(value);
  }
}

void MessageColumns::refuse(const std::string& topic, std::string why) {
  refused_.try_emplace(topic, std::move(why));
}

void MessageColumns::leave_out(const std::string& topic, std::string why) {
  LeftOut& left_out = left_out_[topic];
  left_out.why = std::move(why);
  ++left_out.messages;
}

FileContents MessageColumns::contents() const {
  FileContents contents;
  std::int64_t first_ns = std::numeric_limits<std::int64_t>::max();
  // The header's time is when it was measured, the log's when it arrived.
  const auto times_of = [](const Topic& t) -> const std::vector<std::int64_t>& {
    return t.stamp_ns.size() == t.logged_ns.size() ? t.stamp_ns : t.logged_ns;
  };
  for (const auto& [name, topic] : topics_)
    first_ns = std::min(first_ns, *std::min_element(times_of(topic).begin(), times_of(topic).end()));
  for (const std::string& name : order_) {
    const Topic& topic = topics_.at(name);
    const std::size_t count = topic.logged_ns.size();
    NamedArray time{name + "/time", {count}, {}};
    // The first is the least, and a damaged time may be as far off as there are numbers.
    for (const std::int64_t t : times_of(topic))
      time.values.push_back(1e-9 *
                            static_cast<double>(static_cast<std::uint64_t>(t) - static_cast<std::uint64_t>(first_ns)));
    contents.arrays.push_back(std::move(time));
    for (const std::string& field : topic.names) {
      const std::vector<double>& values = topic.values.at(field);
      const std::string whole = name + "/" + field;
      if (values.size() == count)
        contents.arrays.push_back({whole, {count}, values});
      else
        contents.refused.push_back({whole, "is not in every message of its topic"});
    }
  }
  for (const auto& [topic, left_out] : left_out_) {
    contents.refused.push_back({topic, "has messages that " + left_out.why});
    if (topics_.count(topic) != 0)
      contents.losses.push_back(
          fmt::format("{} messages of {} are left out: they {}", left_out.messages, topic, left_out.why));
  }
  for (const auto& [topic, why] : refused_) contents.refused.push_back({topic, why});
  if (contents.arrays.empty() && contents.refused.empty()) contents.failure = "holds no message";
  return contents;
}

}  // namespace flexspline::data
