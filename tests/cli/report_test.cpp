// The option --report: a page from each command that has it, and errors that say what to do.
#include <gtest/gtest.h>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::report_test {
namespace {

nlohmann::json document_in(const std::string& page) {
  const std::string open = "<script type=\"application/json\" id=\"document\">";
  const std::size_t start = page.find(open), end = page.find("</script", start);
  if (start == std::string::npos || end == std::string::npos) return nullptr;
  return nlohmann::json::parse(page.substr(start + open.size(), end - start - open.size()), nullptr, false);
}

// Attributes and rules with which a browser loads something; the licence and comments may name addresses.
void expect_loads_nothing(const std::string& page) {
  const std::size_t start = page.find("id=\"document\">"), end = page.find("</script", start);
  const std::string markup = page.substr(0, start) + page.substr(end);
  for (const char* loads : {" src=", "<link", "<iframe", "<object", "@import", "url(", "fetch(", "XMLHttpRequest"})
    EXPECT_FALSE(contains(markup, loads)) << loads;
  EXPECT_TRUE(contains(markup, "default-src 'none'"));
}

// Short motions of a drive whose base model lacks an asymmetry.
constexpr const char* kData = "demo-out/free-sine-1hz.csv demo-out/locked-sine-0.5hz.csv demo-out/rest.csv";
constexpr const char* kHeldOut = " --holdout demo-out/holdout-sine-1.4hz.csv";

class Report : public ::testing::Test {
 protected:
  Report() {
    shell_.record();
    shell_.must(std::string("flexspline identify ") + kData +
                " --model demo-out/base-model.toml --out fitted.toml --report 'the page.html'" + kHeldOut);
  }
  nlohmann::json page_of(const std::string& line, const std::string& file) const {
    const std::string said = shell_.must(line + " --report " + file);
    EXPECT_TRUE(contains(said, file)) << said;
    const std::string page = shell_.file(file);
    expect_loads_nothing(page);
    EXPECT_LT(page.size(), 2'000'000u);
    const nlohmann::json document = document_in(page);
    EXPECT_TRUE(document.is_object()) << line;
    return document;
  }
  Shell shell_;
};

TEST_F(Report, OfIdentifyHoldsParametersWithSpreads) {
  const nlohmann::json document = document_in(shell_.file("the page.html"));
  EXPECT_EQ(document["command"], "identify");
  EXPECT_EQ(document["held_out"], 1);
  bool spread = false;
  for (const nlohmann::json& p : document["parameters"]) spread = spread || !p["spread_percent"].is_null();
  EXPECT_TRUE(spread);
  EXPECT_TRUE(document["rounds"].empty());
}

TEST_F(Report, OfAnOpenedModelHasTheIntervalsThatIdentifyFound) {
  shell_.must(std::string("flexspline identify ") + kData +
              " --model demo-out/base-model.toml --out again.toml --json found.json" + kHeldOut);
  const nlohmann::json found = nlohmann::json::parse(shell_.file("found.json"))["parameters"];
  const nlohmann::json opened =
      page_of(std::string("flexspline compare --model again.toml ") + kData, "opened.html")["parameters"];
  std::size_t compared = 0;
  for (const nlohmann::json& p : found)
    for (const nlohmann::json& q : opened) {
      if (p["id"] != q["id"] || p["parameter"] != q["parameter"] || p["interval"][0].is_null()) continue;
      const auto width = [](const nlohmann::json& one) {
        return one["interval"][1].get<double>() - one["interval"][0].get<double>();
      };
      // The file has three digits of it.
      EXPECT_NEAR(width(q) / width(p), 1.0, 0.006) << p;
      ++compared;
    }
  EXPECT_GT(compared, 5u);
}

TEST_F(Report, OfCompareHasTheNumbersOfItsJson) {
  const nlohmann::json document =
      page_of(std::string("flexspline compare --model fitted.toml ") + kData + " --json c.json", "c.html");
  const nlohmann::json compared = nlohmann::json::parse(shell_.file("c.json"));
  EXPECT_EQ(document["comparison"]["overall"], compared["overall"]);
  EXPECT_EQ(document["comparison"]["experiments"], compared["experiments"]);
}

TEST_F(Report, OfCompareShowsSixteenFreeRunsAndBlackBoxesOnOnePage) {
  shell_.must("flexspline compare --model fitted.toml demo-out --baseline arx:4,4,1 --report all.html --json all.json");
  const std::string page = shell_.file("all.html");
  expect_loads_nothing(page);
  EXPECT_LT(page.size(), 3'000'000u);
  const nlohmann::json document = document_in(page);
  ASSERT_EQ(document["traces"].size(), 16u);
  for (const nlohmann::json& trace : document["traces"])
    EXPECT_EQ(trace["free_runs"].size(), contains(trace["experiment"].get<std::string>(), "locked") ? 3u : 4u)
        << trace["experiment"];
  EXPECT_EQ(document["comparison"]["beside"].size(), 7u);
  EXPECT_EQ(document["comparison"]["beside"], nlohmann::json::parse(shell_.file("all.json"))["beside"]);
}

TEST_F(Report, OfDiagnoseHoldsTheCandidates) {
  const nlohmann::json document =
      page_of(std::string("flexspline diagnose --model demo-out/base-model.toml --json d.json ") + kData, "d.html");
  const nlohmann::json found = nlohmann::json::parse(shell_.file("d.json"));
  ASSERT_EQ(document["rounds"].size(), 1u);
  EXPECT_EQ(document["rounds"][0]["named"], found["named"]);
  EXPECT_EQ(document["rounds"][0]["candidates"].size(), found["candidates"].size());
  EXPECT_TRUE(contains(document["verdict"].get<std::string>(), "viscous_asymmetry"));
}

TEST_F(Report, OfDiagnoseHasTheSentencesOfTheTerminal) {
  const std::string line = std::string("flexspline diagnose --model demo-out/base-model.toml ") + kData;
  const nlohmann::json round = page_of(line, "d.html")["rounds"][0];
  std::string terminal = shell_.must(line);
  for (std::size_t at = 0; (at = terminal.find("\n  ", at)) != std::string::npos;) terminal.replace(at, 3, " ");
  EXPECT_TRUE(contains(terminal, round["error_in_words"].get<std::string>())) << terminal;
  ASSERT_FALSE(round["sizes"].empty());
  ASSERT_FALSE(round["certainty"].empty());
  for (const char* sentences : {"sizes", "certainty", "possible_in_words"})
    for (const nlohmann::json& sentence : round[sentences])
      EXPECT_TRUE(contains(terminal, sentence.get<std::string>())) << sentence << "\n" << terminal;
}

TEST_F(Report, OfAddShowsTheErrorBeforeAndAfter) {
  const nlohmann::json document = page_of(
      std::string("flexspline add viscous_asymmetry --model fitted.toml ") + kData + " --out better.toml --json a.json",
      "a.html");
  const nlohmann::json added = nlohmann::json::parse(shell_.file("a.json"));
  EXPECT_EQ(document["addition"]["before"], added["before"]);
  EXPECT_EQ(document["addition"]["after"], added["after"]);
  EXPECT_EQ(document["addition"]["experiments"].size(), 3u);
}

TEST_F(Report, OfTheDemoStandsBesideItsModels) {
  const std::string example = "flexspline demo --hidden stribeck_gaussian --seed 7 --out demo-out";
  ASSERT_TRUE(contains(shell_.must("flexspline demo --help"), example));
  const Shell shell;
  const nlohmann::json answer = shell.json(example);
  EXPECT_EQ(answer["report"], "demo-out/report.html");
  const std::string page = shell.file("demo-out/report.html");
  expect_loads_nothing(page);
  EXPECT_LT(page.size(), 3'000'000u);
  const nlohmann::json document = document_in(page);
  EXPECT_EQ(document["addition"]["effect"], "stribeck_gaussian");
  EXPECT_EQ(document["headline"]["error"], answer["error_after"]);
}

TEST_F(Report, WhereItCannotStandIsSaidBeforeTheWork) {
  const std::string line = std::string("flexspline compare --model fitted.toml ") + kData + " --report ";
  const Answer missing = shell_.run(line + "no/such/report.html");
  EXPECT_EQ(missing.code, 2);
  EXPECT_TRUE(contains(missing.err, "there is no folder no/such; make it")) << missing.err;
  EXPECT_TRUE(missing.out.empty()) << missing.out;
  const Answer folder = shell_.run(line + "demo-out");
  EXPECT_EQ(folder.code, 2);
  EXPECT_TRUE(contains(folder.err, "this is a folder")) << folder.err;
}

TEST(EffectsCommand, SaysWhatTheReferenceVelocityIs) {
  const Shell shell;
  const std::string said = shell.must("flexspline effects power_law_friction");
  EXPECT_TRUE(contains(said, "wref: rated_velocity_rad_s of the model's [drive], without it 1 rad/s")) << said;
  EXPECT_TRUE(contains(said, "wref = 200 rad/s")) << said;
  EXPECT_FALSE(contains(shell.must("flexspline effects viscous_friction"), "wref"));
}

TEST(EffectsCommand, DrawsACurveAndGivesItsPoints) {
  const Shell shell;
  const nlohmann::json answer = shell.json("flexspline effects viscous_friction");
  const nlohmann::json& curve = answer["effects"][0]["curve"];
  EXPECT_EQ(curve["x"].size(), curve["y"].size());
  EXPECT_EQ(curve["x_label"], "motor velocity (rad/s)");
  // Braille where the terminal has it, else ASCII alone.
  EXPECT_TRUE(contains(shell.must("LC_ALL=C.UTF-8 TERM=xterm flexspline effects viscous_friction"), "\u2502"));
  for (const char* plain : {"LC_ALL=C TERM=xterm", "LC_ALL=C.UTF-8 TERM=dumb"}) {
    const std::string text = shell.must(std::string(plain) + " flexspline effects viscous_friction");
    EXPECT_TRUE(contains(text, "motor velocity (rad/s)"));
    for (const char c : text) ASSERT_LT(static_cast<unsigned char>(c), 0x80U) << text;
  }
}

}  // namespace
}  // namespace flexspline::cli_test::report_test
