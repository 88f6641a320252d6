// The protocol as a C header: a C compiler's offsets are the header's, and a program in Python that knows nothing else
// reads a drive.
#if defined(__GNUC__) && !defined(__clang__)
// g++ 12 warns of its own <regex> when it is inlined (bug 105562).
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>
#include <sstream>

#include "tests/cli/tool.hpp"
#include "tests/cli/twin_process.hpp"

namespace flexspline::cli_test::protocol_header_test {
namespace {

TEST(ProtocolHeader, ACompilerForCPlacesEachFieldWhereTheHeaderSays) {
  const Shell shell;
  const std::string header = shell.must("flexspline export --protocol-header");
  shell.write("flexspline_protocol.h", header);
  // Each struct with each of its fields, from the header's own text.
  std::string checks;
  int fields = 0;
  const std::regex begin("typedef struct FLEXSPLINE_PACKED \\{"), member("  u?int\\d+_t (\\w+)(\\[\\d+\\])?;"),
      end("\\} flexspline_(\\w+)_t;");
  std::vector<std::string> members;
  std::istringstream lines(header);
  for (std::string line; std::getline(lines, line);) {
    std::smatch found;
    if (std::regex_match(line, begin)) {
      members.clear();
    } else if (std::regex_match(line, found, member)) {
      members.push_back(found[1]);
    } else if (std::regex_match(line, found, end)) {
      std::string upper = found[1];
      std::transform(upper.begin(), upper.end(), upper.begin(), [](unsigned char c) { return std::toupper(c); });
      for (const std::string& name : members) {
        std::string field = name;
        std::transform(field.begin(), field.end(), field.begin(), [](unsigned char c) { return std::toupper(c); });
        checks += "_Static_assert(offsetof(flexspline_" + found.str(1) + "_t, " + name + ") == FLEXSPLINE_" + upper +
                  "_" + field + "_AT, \"" + name + "\");\n";
        ++fields;
      }
      checks += "_Static_assert(sizeof(flexspline_" + found.str(1) + "_t) == FLEXSPLINE_" + upper + "_BYTES, \"\");\n";
    }
  }
  EXPECT_GT(fields, 60);
  shell.write("check.c",
              "#include <stddef.h>\n#include \"flexspline_protocol.h\"\n" + checks + "int main(void) { return 0; }\n");
  const Answer c = shell.run("cc -std=c11 -Wall -Wextra -Wpedantic -Werror -fsyntax-only check.c");
  EXPECT_EQ(c.code, 0) << c.err;
  const Answer c99 = shell.run("cc -std=c99 -Wall -Wextra -Wpedantic -Werror -x c -fsyntax-only flexspline_protocol.h");
  EXPECT_EQ(c99.code, 0) << c99.err;
  const Answer cpp = shell.run("c++ -std=c++11 -Wall -Wextra -x c++ -fsyntax-only flexspline_protocol.h");
  EXPECT_EQ(cpp.code, 0) << cpp.err;
}

TEST(ProtocolHeader, IsWrittenWithoutAModelAndRefusesOne) {
  const Shell shell;
  const nlohmann::json answer = shell.json("flexspline export --protocol-header --out p.h");
  EXPECT_EQ(answer["files"][0], "p.h");
  EXPECT_TRUE(contains(shell.file("p.h"), "#define FLEXSPLINE_KIND_IDENTIFY "));
  EXPECT_EQ(shell.run("flexspline export --protocol-header --model m.toml").code, 2);
  const Answer neither = shell.run("flexspline export");
  EXPECT_EQ(neither.code, 2);
  EXPECT_TRUE(contains(neither.err, "--protocol-header")) << neither.err;
}

TEST(ProtocolHeader, APythonProgramReadsTelemetryOfADriveByIt) {
  const Shell shell;
  shell.must("flexspline export --protocol-header --out flexspline_protocol.h");
  const TwinProcess twin({"--serve", "0"});
  const std::string where = twin.name().substr(std::string("tcp:").size());
  const std::string program =
      std::string("/usr/bin/python3 '") + FLEXSPLINE_SOURCE_DIR + "/host/drive_link/drive/examples/read_telemetry.py'";
  const Answer answer = shell.run(program + " --header flexspline_protocol.h --tcp " + where +
                                  " --channels velocity,current,temperature,motor_turns --frames 50 --every 40");
  ASSERT_EQ(answer.code, 0) << answer.err;
  EXPECT_TRUE(contains(answer.err, "# drive TWIN, ")) << answer.err;
  std::istringstream lines(answer.out);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "time_s,velocity [rad/s],current [A],temperature [degC],motor_turns [turns]");
  int rows = 0;
  double last = -1.0;
  while (std::getline(lines, line)) {
    double time_s = 0.0, velocity = 0.0, current = 0.0, temperature = 0.0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &time_s, &velocity, &current, &temperature), 4) << line;
    EXPECT_GT(time_s, last);
    last = time_s;
    // An idle drive at room temperature: the noise of its sensors, in SI.
    EXPECT_LT(std::abs(velocity), 5.0) << line;
    EXPECT_LT(std::abs(current), 0.5) << line;
    EXPECT_GT(temperature, 5.0) << line;
    EXPECT_LT(temperature, 60.0) << line;
    ++rows;
  }
  EXPECT_EQ(rows, 50);
  const Answer wrong = shell.run(program + " --header flexspline_protocol.h --tcp " + where + " --channels speed");
  EXPECT_NE(wrong.code, 0);
  EXPECT_TRUE(contains(wrong.err, "there is no channel speed")) << wrong.err;
}

}  // namespace
}  // namespace flexspline::cli_test::protocol_header_test
