// Messages of ROS 1 and ROS 2: their definitions as .msg files have them, and what is in one.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "host/input/data/message_columns.hpp"

namespace flexspline::data {

enum class RosWire { ros1, cdr };  // how a message is written: packed, or OMG's Common Data Representation

class RosMessageType {
 public:
  // `definition`: the text of the message's .msg, followed by those of the types that it uses, each after a line of
  // equals signs and "MSG: package/Type". Throws std::runtime_error where it cannot be understood.
  RosMessageType(std::string_view definition, RosWire wire);

  // Throws DamagedFile where the message is shorter than its type.
  MessageFields read(std::string_view message) const;

 private:
  struct Field;
  struct Struct {
    std::vector<Field> fields;
  };
  struct Field {
    std::string type;  // of one element
    std::string name;
    bool is_array = false;
    std::size_t fixed = 0;  // elements of an array of fixed length; 0: its length is in the message
  };
  class Walk;

  void parse(std::string_view text, Struct& into);
  const Struct* find(const std::string& type) const;

  RosWire wire_;
  Struct root_;
  std::map<std::string, Struct> types_;
};

// The definition of a message that recordings of ROS 2 use without stating it ("sensor_msgs/msg/JointState"); empty
// where it is not known.
std::string_view usual_ros_definition(std::string_view type);

}  // namespace flexspline::data
