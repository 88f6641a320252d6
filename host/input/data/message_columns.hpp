// Columns from a log of messages: of each topic a table, with a row for each message.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/input/data/file_contents.hpp"

namespace flexspline::data {

// The numbers in one message, by their names: "position[2]", "header/stamp" ... in the order of the message.
struct MessageFields {
  std::vector<std::pair<std::string, double>> numbers;
  std::optional<std::int64_t> stamp_ns;  // of its header
};

class MessageColumns {
 public:
  void add(const std::string& topic, std::int64_t logged_ns, const MessageFields& fields);
  void refuse(const std::string& topic, std::string why);
  // A message that cannot be read; of its topic the others are.
  void leave_out(const std::string& topic, std::string why);
  // "/joint_states/time" in seconds since the first message of all, "/joint_states/effort[2]" ... A field that some
  // messages of its topic lack is refused.
  FileContents contents() const;

 private:
  struct Topic {
    std::vector<std::int64_t> logged_ns, stamp_ns;
    std::vector<std::string> names;  // in the order in which they came
    std::map<std::string, std::vector<double>> values;
  };

  std::vector<std::string> order_;
  std::map<std::string, Topic> topics_;
  struct LeftOut {
    std::string why;
    std::size_t messages = 0;
  };

  std::map<std::string, std::string> refused_;
  std::map<std::string, LeftOut> left_out_;
};

}  // namespace flexspline::data
