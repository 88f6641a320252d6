// The report page: its structure, that no text in it can act, and that its numbers are those of the comparison.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/engine/comparison/compare.hpp"
#include "host/engine/estimation/identify.hpp"
#include "host/output/answers/comparison.hpp"
#include "host/output/report/document.hpp"
#include "host/output/report/page.hpp"
#include "host/output/report/trace.hpp"
#include "tests/unit/comparison_test_drive.hpp"

namespace flexspline::report::report_page_test {
namespace {

using nlohmann::json;
using plant::Mode;
using plant::Waveform;

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}
std::size_t count(std::string_view text, std::string_view part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string_view::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

// What stands between the element that holds the document and its end, as a browser finds it.
json document_in(const std::string& page) {
  const std::string open = "<script type=\"application/json\" id=\"document\">";
  const std::size_t start = page.find(open);
  EXPECT_NE(start, std::string::npos);
  const std::size_t end = page.find("</script", start);
  return json::parse(page.substr(start + open.size(), end - start - open.size()));
}

// A free motion to fit and a locked one held out, of a drive whose model lacks one effect.
struct Case {
  data::Dataset dataset;
  model::Model model;

  Case() {
    plant::Drive drive = plant::demo_plant().drive;
    plant::hide(drive, "stribeck_gaussian");
    dataset = comparison::record(drive,
                                 {comparison::plan("free <b>", Mode::velocity, Waveform::sine, 40.0, 1.0, 4.0),
                                  comparison::plan("locked", Mode::current, Waveform::sine, 2.0, 1.0, 3.0, true)},
                                 3);
    dataset.experiments[1].role = data::Role::holdout;
    model = comparison::known_model(drive);
    model.name = "a </script><script>alert(1)</script> model";
  }
};

const Case& the_case() {
  static const Case one;
  return one;
}

Subject subject_of(const Case& c) {
  return {.command = "compare",
          .data_name = "folder & <img src=x onerror=alert(1)>",
          .model_name = "model.toml",
          .dataset = &c.dataset,
          .model = c.model,
          .baselines = {blackbox::parse_specification("arx:2,2,1")}};
}

// Made once: it takes some seconds under sanitizers.
const json& the_document() {
  static const json one = document(subject_of(the_case()));
  return one;
}

TEST(ReportPage, HoldsItsPartsOnceAndTheDocumentParses) {
  const std::string html = page(the_document());
  EXPECT_TRUE(html.starts_with("<!DOCTYPE html>\n<html lang=\"en\">"));
  for (const char* part : {"<title>", "<h1>", "<main id=\"sections\">", "id=\"verdict\"", "</html>"})
    EXPECT_EQ(count(html, part), 1u) << part;
  EXPECT_FALSE(contains(html, "{{")) << "a part of the template was not filled";
  const json inside = document_in(html);
  EXPECT_EQ(inside, the_document());
  EXPECT_EQ(inside["format"], "flexspline-report/1");
}

TEST(ReportPage, KeepsTheLicenceOfUplot) {
  const std::string html = page(the_document());
  EXPECT_TRUE(contains(html, "The MIT License (MIT)"));
  EXPECT_TRUE(contains(html, "Leon Sorokin"));
  EXPECT_TRUE(contains(html, "var uPlot="));
}

TEST(ReportPage, NamesFromFilesStayText) {
  const std::string html = page(the_document());
  // Three scripts and their three ends: the document, uPlot, ours.
  EXPECT_EQ(count(html, "<script"), 3u);
  EXPECT_EQ(count(html, "</script"), 3u);
  EXPECT_FALSE(contains(html, "<script>alert"));
  EXPECT_FALSE(contains(html, "<img"));
  EXPECT_TRUE(contains(html, "a &lt;/script&gt;&lt;script&gt;alert(1)&lt;/script&gt; model"));
  EXPECT_EQ(document_in(html)["data_set"], "folder & <img src=x onerror=alert(1)>");
  EXPECT_EQ(document_in(html)["traces"][0]["experiment"], "free <b>");
}

TEST(ReportPage, LoadsNothingFromElsewhere) {
  // What names say is text; they are left out.
  const std::string html = page({{"title", "t"}, {"verdict", "v"}});
  for (const char* loads : {" src=", "<link", "@import", "url(", "fetch(", "XMLHttpRequest", "import("})
    EXPECT_FALSE(contains(html, loads)) << loads;
  EXPECT_TRUE(contains(html, "default-src 'none'"));
}

TEST(ReportPage, TextThatIsNoUtf8DoesNoHarm) {
  json document = the_document();
  document["title"] = "drive \xff\xfe";
  const std::string html = page(document);
  EXPECT_TRUE(contains(html, "<title>drive \xEF\xBF\xBD"));
  EXPECT_NO_THROW(document_in(html));
}

TEST(ReportPage, StaysSmall) {
  EXPECT_LT(page(the_document()).size(), 600'000u);  // two experiments
}

TEST(ReportDocument, NumbersAreThoseOfTheComparison) {
  const comparison::Comparison truth =
      comparison::compare(the_case().dataset, the_case().model, {}, subject_of(the_case()).baselines);
  json expected = output::comparison_json(truth);
  expected.erase("regions");
  EXPECT_EQ(the_document()["comparison"], expected);
  EXPECT_EQ(the_document()["experiments"], 2);
  EXPECT_EQ(the_document()["held_out"], 1);
}

double decoded(const json& trace, std::size_t at) {
  static const std::string kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  const std::string codes = trace["codes"];
  const auto byte = [&](std::size_t k) {
    std::uint32_t word = 0;
    for (std::size_t c = 0; c < 4; ++c) {
      const std::size_t letter = kLetters.find(codes[k / 3 * 4 + c]);
      word = word << 6U | static_cast<std::uint32_t>(letter == std::string::npos ? 0 : letter);
    }
    return word >> (16U - 8U * (k % 3)) & 255U;
  };
  const std::uint32_t code = byte(2 * at) | byte(2 * at + 1) << 8U;
  return code == 65535 ? std::nan("") : trace["offset"].get<double>() + trace["scale"].get<double>() * code;
}

TEST(ReportDocument, ErrorOverTimeIsMeasuredLessModel) {
  const json& trace = the_document()["traces"][0]["balances"][0];
  EXPECT_EQ(trace["signal"], "motor_balance");
  const std::size_t points = trace["residual"]["count"];
  EXPECT_LE(points, 2001u);
  EXPECT_EQ(trace["time"]["count"], points);
  // Root mean square of what is drawn: that of the comparison, but for the extremes that thinning prefers.
  double sum = 0.0, number = 0.0;
  for (std::size_t k = 0; k < points; ++k)
    if (const double r = decoded(trace["residual"], k); std::isfinite(r)) {
      sum += r * r;
      number += 1.0;
    }
  const double rmse = the_document()["comparison"]["experiments"][0]["signals"][0]["rmse"];
  EXPECT_NEAR(std::sqrt(sum / number), rmse, 0.15 * rmse);
}

TEST(ReportDocument, TheMissingStribeckFrictionShowsAtLowSpeedByDirection) {
  const json& maps = the_document()["maps"][0]["maps"];
  // Most telling first.
  double before = 100.0;
  for (const json& map : maps) {
    const double share =
        std::max(map["share_percent"].get<double>(), map["share_with_direction_percent"].get<double>());
    EXPECT_LE(share, before);
    before = share;
  }
  const auto speed = std::find_if(maps.begin(), maps.end(), [](const json& m) { return m["variable"] == "speed"; });
  ASSERT_NE(speed, maps.end());
  const json& mean = (*speed)["with_direction"]["mean"];
  const json& error = (*speed)["with_direction"]["standard_error"];
  ASSERT_EQ(mean.size(), (*speed)["x"].size());
  // Friction is missing there: what was measured is larger than the model in the direction of motion.
  EXPECT_GT(mean.front().get<double>(), 2.0 * error.front().get<double>());
  EXPECT_GT(mean.front().get<double>(), 5.0 * std::abs(mean.back().get<double>()));
}

TEST(ReportDocument, FrictionIsTheSumOfItsPartsAndLeavesOutWhatIsNone) {
  const json& friction = the_document()["friction"];
  std::vector<std::string> names;
  for (const json& part : friction["parts"]) names.push_back(part["effect"]);
  for (const char* name : {"viscous_friction", "coulomb_friction", "viscous_asymmetry"})
    EXPECT_NE(std::find(names.begin(), names.end(), name), names.end()) << name;
  for (const char* name : {"inertia", "current_offset"})
    EXPECT_EQ(std::find(names.begin(), names.end(), name), names.end()) << name;
  for (std::size_t b = 0; b < friction["velocity"].size(); ++b) {
    if (friction["velocity"][b].is_null()) continue;
    double sum = 0.0;
    for (const json& part : friction["parts"]) sum += part["torque"][b].get<double>();
    EXPECT_NEAR(sum, friction["model"][b].get<double>(), 1e-12);
    EXPECT_GT(friction["velocity"][b].get<double>() * friction["measured"][b].get<double>(), 0.0);
  }
}

TEST(ReportDocument, EveryExperimentHasItsFreeRunBesideTheMeasurement) {
  ASSERT_EQ(the_document()["traces"].size(), 2u);
  for (std::size_t e = 0; e < 2; ++e) {
    const json& trace = the_document()["traces"][e];
    std::vector<std::string> names;
    for (const json& run : trace["free_runs"]) {
      names.push_back(run["signal"]);
      const std::size_t points = run["time"]["count"];
      EXPECT_GT(points, 300u);
      EXPECT_LE(points, 1001u);
      EXPECT_EQ(run["measured"]["count"], points);
      EXPECT_EQ(run["model"]["count"], points);
      if (run["signal"] != "motor_velocity") continue;  // hardly any noise, which thinning would favour
      // What is drawn has the error that is stated.
      double error = 0.0;
      for (std::size_t k = 0; k < points; ++k)
        error += std::pow(decoded(run["measured"], k) - decoded(run["model"], k), 2.0) / static_cast<double>(points);
      const json& signals = the_document()["comparison"]["experiments"][e]["signals"];
      const auto stated =
          std::find_if(signals.begin(), signals.end(), [](const json& x) { return x["signal"] == "motor_velocity"; });
      ASSERT_NE(stated, signals.end());
      EXPECT_NEAR(std::sqrt(error), (*stated)["rmse"].get<double>(), 0.1 * (*stated)["rmse"].get<double>());
    }
    for (const char* signal : {"motor_velocity", "torque"})
      EXPECT_NE(std::find(names.begin(), names.end(), signal), names.end()) << trace["experiment"] << signal;
  }
}

TEST(ReportDocument, BlackBoxesStandBesideTheModel) {
  const json& beside = the_document()["comparison"]["beside"];
  ASSERT_FALSE(beside.empty());
  EXPECT_EQ(beside[0]["black_box"], "arx:2,2,1");
  EXPECT_EQ(beside[0]["signal"], "motor_balance");
  Subject without = subject_of(the_case());
  without.baselines.clear();
  EXPECT_TRUE(document(without)["comparison"]["beside"].empty());
}

TEST(ReportPage, DrawsFreeRunsAndBlackBoxesBeforeWhatExplainsThem) {
  // Functions of the page, and where they are called.
  const std::string html = page(the_document());
  EXPECT_EQ(count(html, "function freeRunGallery("), 1u);
  EXPECT_EQ(count(html, "function baselineTable("), 1u);
  const std::size_t good = html.find("section(\"How good is the model?\"");
  const std::size_t beside = html.find("baselineTable()", good), runs = html.find("freeRunGallery(traces)", good);
  const std::size_t fails = html.find("\"Where does it fail?\"", good);
  EXPECT_LT(good, beside);
  EXPECT_LT(beside, runs);
  EXPECT_LT(runs, fails);
  EXPECT_NE(fails, std::string::npos);
}

TEST(ReportDocument, LoadedRecordsDrawALoop) {
  const json& loops = the_document()["loops"];
  ASSERT_FALSE(loops.empty());
  EXPECT_EQ(loops[0]["experiment"], "locked");
  EXPECT_EQ(loops[0]["torsion"]["count"], loops[0]["measured"]["count"]);
}

TEST(ReportDocument, ShowsTheChangeOfEachExperimentAfterAnAddition) {
  const Case& c = the_case();
  Subject subject = subject_of(c);
  selection::Addition addition;
  addition.effect = "stribeck_gaussian";
  addition.signal = "motor_balance";
  addition.unit = "N*m";
  addition.before = {2.0, 4.0};
  addition.after = {1.0, 1.0};
  addition.noise_floor = 0.9;
  subject.command = "add";
  subject.addition = addition;
  // Fewer experiments are enough here.
  data::Dataset locked = c.dataset;
  locked.experiments.erase(locked.experiments.begin());
  subject.dataset = &locked;
  subject.before = subject.model;
  for (model::Effect& effect : subject.before->effects)
    if (effect.type == "coulomb_friction") *effect.find("torque")->value *= 2.0;
  const json made = document(subject);
  EXPECT_TRUE(contains(made["verdict"].get<std::string>(),
                       "on motions that the fit never saw decreases from 4 N\u00b7m to 1 N\u00b7m (-75.0 %)"))
      << made["verdict"];
  EXPECT_EQ(made["headline"]["error_before"], 4.0);
  ASSERT_EQ(made["addition"]["experiments"].size(), 1u);
  const json& bar = made["addition"]["experiments"][0];
  EXPECT_EQ(bar["role"], "holdout");
  EXPECT_GT(bar["before"].get<double>(), bar["after"].get<double>());
  EXPECT_EQ(bar["after"], made["comparison"]["experiments"][0]["signals"][0]["rmse"]);
  EXPECT_EQ(bar["before"], made["comparison_before"]["experiments"][0]["signals"][0]["rmse"]);
}

TEST(ReportPlace, AMissingFolderIsNamedWithWhatToDo) {
  try {
    require_place("no/such/folder/report.html");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_TRUE(contains(error.what(), "there is no folder no/such/folder; make it"));
  }
  EXPECT_THROW(require_place(std::filesystem::temp_directory_path()), std::runtime_error);
  EXPECT_NO_THROW(require_place("report.html"));
}

TEST(Thinning, KeepsEverySampleOfAShortRecord) {
  const std::vector<double> x{3.0, 1.0, 2.0, 5.0};
  const Thinning thinning({{0, 4}}, 100);
  EXPECT_EQ(thinning.values(x), x);
}

TEST(Thinning, KeepsWhatStandsOutAndTheSlopeOfALine) {
  std::vector<double> time(10'000), line(10'000), spike(10'000, 0.0);
  for (std::size_t k = 0; k < time.size(); ++k) time[k] = line[k] = static_cast<double>(k);
  spike[5'003] = 7.0;
  spike[5'777] = -4.0;
  const Thinning thinning({{0, 10'000}}, 500);
  const std::vector<double> drawn = thinning.values(spike);
  EXPECT_LE(drawn.size(), 502u);
  EXPECT_EQ(*std::max_element(drawn.begin(), drawn.end()), 7.0);
  EXPECT_EQ(*std::min_element(drawn.begin(), drawn.end()), -4.0);
  EXPECT_EQ(thinning.values(line), thinning.times(time));
}

TEST(Thinning, PartsStretchesWithAGapAndLeavesOutWhatDoesNotCount) {
  const std::vector<double> x{1.0, 2.0, 3.0, 4.0, 5.0};
  const std::vector<std::uint8_t> valid{1, 0, 1, 1, 1};
  const std::vector<double> drawn = Thinning({{0, 2}, {3, 5}}, 100).values(x, valid);
  ASSERT_EQ(drawn.size(), 5u);
  EXPECT_EQ(drawn[0], 1.0);
  EXPECT_TRUE(std::isnan(drawn[1]));
  EXPECT_TRUE(std::isnan(drawn[2]));
  EXPECT_EQ(drawn[3], 4.0);
  EXPECT_EQ(drawn[4], 5.0);
}

TEST(Packed, ComesBackWithinOneCode) {
  const std::vector<double> values{-1.0, 0.25, std::nan(""), 3.0};
  const json trace = packed(values);
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (std::isnan(values[k])) {
      EXPECT_TRUE(std::isnan(decoded(trace, k)));
    } else {
      EXPECT_NEAR(decoded(trace, k), values[k], 4.0 / 65534.0);
    }
  }
}

}  // namespace
}  // namespace flexspline::report::report_page_test
