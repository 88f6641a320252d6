// Layouts: ROS wiki "msg" and "Bags/Format/2.0"; OMG's DDS-XTypes 7.4 for CDR, of which ROS 2 uses version 1.
#include "host/input/data/ros_message.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "host/input/data/byte_reader.hpp"

namespace flexspline::data {
namespace {

constexpr int kDeepestMessage = 12;
// A longer array is an image or a point cloud.
constexpr std::size_t kMostElementsOfMessage = 64;

struct RosPrimitive {
  std::string_view name;
  std::size_t size;
  double (*read)(ByteReader&);
};

template <class T>
double read_number(ByteReader& bytes) {
  return static_cast<double>(bytes.number<T>());
}

constexpr auto kRosPrimitives = std::to_array<RosPrimitive>({
    {"float64", 8, read_number<double>},
    {"float32", 4, read_number<float>},
    {"double", 8, read_number<double>},
    {"float", 4, read_number<float>},
    {"int8", 1, read_number<std::int8_t>},
    {"uint8", 1, read_number<std::uint8_t>},
    {"byte", 1, read_number<std::uint8_t>},
    {"char", 1, read_number<std::uint8_t>},
    {"bool", 1, read_number<std::uint8_t>},
    {"boolean", 1, read_number<std::uint8_t>},
    {"octet", 1, read_number<std::uint8_t>},
    {"int16", 2, read_number<std::int16_t>},
    {"uint16", 2, read_number<std::uint16_t>},
    {"int32", 4, read_number<std::int32_t>},
    {"uint32", 4, read_number<std::uint32_t>},
    {"int64", 8, read_number<std::int64_t>},
    {"uint64", 8, read_number<std::uint64_t>},
});

const RosPrimitive* primitive_of(std::string_view type) {
  for (const RosPrimitive& primitive : kRosPrimitives)
    if (primitive.name == type) return &primitive;
  return nullptr;
}

bool is_ros_time(std::string_view type) {
  return type == "time" || type == "duration";
}

// "JointState" of "sensor_msgs/msg/JointState".
std::string_view last_part(std::string_view type) {
  const std::size_t slash = type.rfind('/');
  return slash == std::string_view::npos ? type : type.substr(slash + 1);
}

std::string_view next_line(std::string_view& text) {
  const std::size_t end = std::min(text.find('\n'), text.size());
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return line;
}

std::string_view next_word(std::string_view& line) {
  const std::size_t begin = std::min(line.find_first_not_of(" \t\r"), line.size());
  line.remove_prefix(begin);
  const std::size_t end = std::min(line.find_first_of(" \t\r"), line.size());
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(end);
  return word;
}

}  // namespace

// What is read of one message.
class RosMessageType::Walk {
 public:
  Walk(const RosMessageType& type, std::string_view message) : type_(type), bytes_(message) {}

  MessageFields read() {
    of(type_.root_, "", 0);
    return std::move(found_);
  }

 private:
  void align(std::size_t size) {
    if (type_.wire_ == RosWire::cdr) bytes_.align(size);
  }
  std::uint32_t count() {
    align(4);
    return bytes_.u32();
  }

  void of(const Struct& of_struct, const std::string& prefix, int depth) {
    if (depth > kDeepestMessage) throw DamagedFile();
    for (const Field& field : of_struct.fields) {
      const std::string name = prefix + field.name;
      if (!field.is_array) {
        one(field.type, name, depth, true);
        continue;
      }
      const std::size_t elements = field.fixed > 0 ? field.fixed : count();
      const bool wanted = elements <= kMostElementsOfMessage;
      if (elements > bytes_.left() + 1) throw DamagedFile();
      for (std::size_t k = 0; k < elements; ++k)
        one(field.type, wanted ? fmt::format("{}[{}]", name, k) : std::string(), depth, wanted);
    }
  }

  void one(const std::string& type, const std::string& name, int depth, bool wanted) {
    if (const RosPrimitive* primitive = primitive_of(type)) {
      align(primitive->size);
      const double value = primitive->read(bytes_);
      if (wanted) found_.numbers.emplace_back(name, value);
    } else if (type.starts_with("string") || type.starts_with("wstring")) {
      const std::uint32_t length = count();
      bytes_.take(std::uint64_t{type.starts_with('w') ? 4U : 1U} * length);
    } else if (is_ros_time(type)) {
      const std::int64_t seconds = bytes_.u32();
      take_time(name, seconds, bytes_.u32());
    } else if (last_part(type) == "Time" || last_part(type) == "Duration") {
      align(4);
      const std::int64_t seconds = bytes_.number<std::int32_t>();
      take_time(name, seconds, bytes_.u32());
    } else if (const Struct* inner = type_.find(type)) {
      of(*inner, wanted ? name + "/" : "", depth + 1);
    } else {
      throw DamagedFile();
    }
  }

  void take_time(const std::string& name, std::int64_t seconds, std::uint32_t nanoseconds) {
    const std::int64_t ns = seconds * 1'000'000'000 + nanoseconds;
    if (name == "header/stamp" || name == "stamp") found_.stamp_ns = ns;
  }

  const RosMessageType& type_;
  ByteReader bytes_;
  MessageFields found_;
};

RosMessageType::RosMessageType(std::string_view definition, RosWire wire) : wire_(wire) {
  Struct* into = &root_;
  std::string part;
  const auto finish = [&] {
    parse(part, *into);
    part.clear();
  };
  while (!definition.empty()) {
    const std::string_view line = next_line(definition);
    if (line.starts_with("====")) continue;
    if (line.starts_with("MSG: ")) {
      finish();
      std::string_view rest = line.substr(5);
      into = &types_[std::string(last_part(next_word(rest)))];
      continue;
    }
    part += std::string(line) + "\n";
  }
  finish();
}

void RosMessageType::parse(std::string_view text, Struct& into) {
  while (!text.empty()) {
    std::string_view line = next_line(text);
    line = line.substr(0, line.find('#'));
    std::string_view type = next_word(line);
    const std::string_view name = next_word(line);
    // Constants are no fields; "string<=5" is a string.
    if (type.empty() || name.empty() || name.find('=') != std::string_view::npos) continue;
    std::string_view rest = line;
    if (next_word(rest).starts_with("=")) continue;
    Field field;
    field.name = name;
    const std::size_t bracket = type.find('[');
    if (bracket != std::string_view::npos) {
      field.is_array = true;
      const std::string_view length = type.substr(bracket + 1);
      std::from_chars(length.data(), length.data() + length.size(), field.fixed);
      type = type.substr(0, bracket);
    }
    field.type = type;
    into.fields.push_back(std::move(field));
  }
}

const RosMessageType::Struct* RosMessageType::find(const std::string& type) const {
  const auto at = types_.find(std::string(last_part(type)));
  return at == types_.end() ? nullptr : &at->second;
}

MessageFields RosMessageType::read(std::string_view message) const {
  if (wire_ == RosWire::cdr) {
    // Four bytes give the encoding; a one in the second, the least significant byte first, as all do.
    if (message.size() < 4 || message[1] != 1) throw DamagedFile();
    message.remove_prefix(4);
  }
  return Walk(*this, message).read();
}

std::string_view usual_ros_definition(std::string_view type) {
  static constexpr std::pair<std::string_view, std::string_view> kUsual[] = {
      {"sensor_msgs/msg/JointState",
       "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"
       "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"},
      {"std_msgs/msg/Float64", "float64 data\n"},
      {"std_msgs/msg/Float32", "float32 data\n"},
      {"std_msgs/msg/Int32", "int32 data\n"},
      {"std_msgs/msg/Float64MultiArray",
       "MultiArrayLayout layout\nfloat64[] data\nMSG: std_msgs/MultiArrayLayout\nMultiArrayDimension[] dim\nuint32 "
       "data_offset\nMSG: std_msgs/MultiArrayDimension\nstring label\nuint32 size\nuint32 stride\n"},
      {"sensor_msgs/msg/Temperature",
       "std_msgs/Header header\nfloat64 temperature\nfloat64 variance\nMSG: std_msgs/Header\nbuiltin_interfaces/Time "
       "stamp\nstring frame_id\n"},
      {"geometry_msgs/msg/WrenchStamped",
       "std_msgs/Header header\nWrench wrench\nMSG: geometry_msgs/Wrench\nVector3 force\nVector3 torque\nMSG: "
       "geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\nMSG: std_msgs/Header\nbuiltin_interfaces/Time "
       "stamp\nstring frame_id\n"},
  };
  for (const auto& [name, definition] : kUsual)
    if (name == type) return definition;
  return {};
}

}  // namespace flexspline::data
