// Motions of a free shaft that every drive can make, and their recordings without torque sensor.
#pragma once

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test {

// Slow and fast strokes of a free shaft, as a plan.
inline std::string free_motions() {
  const auto run = [](const char* name, const char* waveform, const char* amplitude, const char* hz, const char* s) {
    return std::string("[[run]]\nname = \"") + name + "\"\nmode = \"velocity\"\nwaveform = \"" + waveform +
           "\"\namplitude = " + amplitude + "\nfrequency_hz = " + hz + "\nduration_s = " + s + "\n";
  };
  return "format = \"flexspline-plan/1\"\nsample_s = 0.001\n[limits]\nvelocity_rad_s = 150\n" +
         run("slow", "triangle", "6", "0.1", "20") + run("slower", "triangle", "12", "0.2", "20") +
         run("sine", "sine", "100", "1", "8") + run("middle", "triangle", "60", "0.1", "20") +
         run("fast", "triangle", "120", "0.2", "15");
}

// A recording without one of its columns.
inline std::string without(const std::string& csv, const std::string& column) {
  std::istringstream lines(csv);
  std::string out;
  std::size_t at = std::string::npos;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with('#')) {
      std::vector<std::string> cells;
      std::istringstream row(line);
      for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
      if (at == std::string::npos)
        at = static_cast<std::size_t>(std::find(cells.begin(), cells.end(), column) - cells.begin());
      cells.erase(cells.begin() + static_cast<std::ptrdiff_t>(at));
      line.clear();
      for (const std::string& cell : cells) line += (line.empty() ? "" : ",") + cell;
    }
    out += line + "\n";
  }
  return out;
}

inline void leave_out_torque(const Shell& shell, const std::string& folder) {
  for (const char* run : {"slow", "slower", "sine", "middle", "fast"}) {
    const std::string file = folder + "/" + run + ".csv";
    shell.write(file, without(shell.file(file), "torque_nm"));
  }
}

}  // namespace flexspline::cli_test
