// Recordings of messages: bags of ROS 1 and ROS 2, MCAP, and the telemetry logs of mjlib (moteus).
#pragma once

#include <filesystem>

#include "host/input/data/file_contents.hpp"

namespace flexspline::data {

// Columns go by topic and field, "/joint_states/effort[2]", each topic with a time of its own, "/joint_states/time".
// What is damaged is a `failure`; topics whose messages cannot be read are refused.
FileContents read_ros1_bag(const std::filesystem::path& path);
FileContents read_ros2_bag(const std::filesystem::path& path);
FileContents read_mcap(const std::filesystem::path& path);
FileContents read_mjlib_log(const std::filesystem::path& path);

}  // namespace flexspline::data
