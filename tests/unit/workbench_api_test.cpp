// host/app/workbench: what the page asks for, without a socket.
#include "host/app/workbench/api.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <thread>

#include "host/app/workbench/work.hpp"
#include "host/engine/selection/add.hpp"
#include "tests/unit/comparison_test_drive.hpp"

namespace flexspline::workbench::workbench_api_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using plant::Mode;
using plant::Waveform;

// Small data of the twin, and a folder to save into that is gone afterwards.
class WorkbenchApi : public ::testing::Test {
 protected:
  static std::shared_ptr<Step> first() {
    static const std::shared_ptr<Step> step = [] {
      const plant::Drive drive = plant::demo_plant().drive;
      auto dataset = std::make_shared<data::Dataset>(
          comparison::record(drive,
                             {comparison::plan("free", Mode::velocity, Waveform::sine, 60.0, 1.0, 3.0),
                              comparison::plan("locked", Mode::current, Waveform::sine, 2.0, 0.5, 4.0, true)},
                             1));
      dataset->experiments[1].role = data::Role::holdout;
      model::ModelFile file{comparison::known_model(drive), ""};
      file.text = model::write(file.model);
      return open(dataset, file, {}, [](std::string_view) {});
    }();
    return step;
  }

  WorkbenchApi() {
    std::string name = (fs::temp_directory_path() / "flexspline-api-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
    folder_ = name;
    struct Setup setup;
    setup.first = first();
    setup.data_name = "data";
    setup.folder = folder_;
    setup.run = [this](const std::vector<closed_loop::Job>& jobs) { return run_(jobs); };
    api_ = std::make_unique<Api>(std::move(setup));
  }
  ~WorkbenchApi() override {
    api_.reset();
    fs::remove_all(folder_);
  }

  json ask(const std::string& method, const std::string& path, std::map<std::string, std::string> query = {},
           const json& body = nullptr, int status = 200) {
    const Answer answer = api_->answer({method, path, std::move(query), body.is_null() ? "" : body.dump(), {}});
    EXPECT_EQ(answer.status, status) << path << ": " << answer.body;
    return json::parse(answer.body);
  }
  std::string new_tab() { return ask("POST", "/api/tab")["tab"].get<std::string>(); }
  json act(const std::string& tab, const json& what, int status = 200) {
    return ask("POST", "/api/do", {{"tab", tab}}, what, status);
  }
  // The state once no work runs any more.
  json state_after_work(const std::string& tab) {
    for (std::uint64_t seen = 0;;) {
      json state = ask("GET", "/api/state", {{"tab", tab}, {"seen", std::to_string(seen)}});
      if (state.contains("work") && state["work"].is_null()) return state;
      seen = state["changes"].get<std::uint64_t>();
    }
  }

  fs::path folder_;
  closed_loop::Runner run_;  // what closed loops of this test are run by
  std::unique_ptr<Api> api_;
};

TEST_F(WorkbenchApi, SaysHowGoodTheModelIsByExperiment) {
  const json state = state_after_work(new_tab());
  ASSERT_EQ(state["experiments"].size(), 2u);
  EXPECT_EQ(state["experiments"][1]["role"], "holdout");
  EXPECT_EQ(state["steps"].size(), 1u);
  const json& motor = state["experiments"][0]["signals"][0];
  EXPECT_EQ(motor["signal"], "motor_balance");
  // The model is the twin's truth: what is left is noise.
  EXPECT_LT(motor["excess"].get<double>(), 1.6);
  EXPECT_EQ(state["experiments"][0]["signals"][0]["free_run"], false);
}

// A file's name in Latin-1 is the name of its experiment.
TEST_F(WorkbenchApi, ShowsAnExperimentWhoseNameIsNoUtf8) {
  auto dataset = std::make_shared<data::Dataset>(*first()->dataset);
  dataset->experiments[0].name = "fr\xE4sen";
  model::ModelFile file{first()->model, first()->model_text};
  struct Setup setup;
  setup.first = open(dataset, file, {}, [](std::string_view) {});
  setup.folder = folder_;
  api_ = std::make_unique<Api>(std::move(setup));
  EXPECT_EQ(state_after_work(new_tab())["experiments"][0]["name"], "fr\xEF\xBF\xBDsen");
}

// A page that hears of a work only when it is over still learns that there was one.
TEST_F(WorkbenchApi, CountsTheWorksThatWereStarted) {
  const std::string tab = new_tab();
  const auto before = state_after_work(tab)["works_started"].get<int>();
  act(tab, {{"do", "refit"}});
  EXPECT_EQ(state_after_work(tab)["works_started"].get<int>(), before + 1);
}

TEST_F(WorkbenchApi, GivesCurvesAndWhereTheRowsOfARegionLieInTime) {
  const std::string tab = new_tab();
  const json trace = ask("GET", "/api/trace",
                         {{"tab", tab},
                          {"experiment", "free"},
                          {"signal", "motor_balance"},
                          {"from", "1"},
                          {"to", "2"},
                          {"points", "200"}});
  EXPECT_GT(trace["measured"]["count"].get<int>(), 150);
  EXPECT_EQ(trace["measured"]["count"], trace["residual"]["count"]);
  const json velocity = ask("GET", "/api/trace",
                            {{"tab", tab},
                             {"experiment", "free"},
                             {"signal", "motor_velocity"},
                             {"from", "0"},
                             {"to", "3"},
                             {"points", "200"}});
  EXPECT_EQ(velocity["unit"], "rad/s");
  // Above 50 of a sine of 60 rad/s at 1 Hz: once around each crest.
  const json fast =
      ask("GET", "/api/stretches",
          {{"tab", tab}, {"signal", "motor_balance"}, {"variable", "velocity"}, {"low", "50"}, {"high", "1000"}});
  ASSERT_EQ(fast.size(), 1u);
  EXPECT_EQ(fast[0]["experiment"], "free");
  EXPECT_GE(fast[0]["stretches"].size(), 2u);
  EXPECT_LE(fast[0]["stretches"].size(), 4u);
  EXPECT_FALSE(ask("GET", "/api/maps", {{"tab", tab}})["maps"].empty());
}

TEST_F(WorkbenchApi, AnswersWhatCannotBeWithWordsNotWithAnEnd) {
  const std::string tab = new_tab();
  ask("GET", "/api/state", {{"tab", "no-such-tab"}, {"seen", "0"}}, nullptr, 404);
  ask("GET", "/api/state", {{"seen", "0"}}, nullptr, 400);
  ask("GET", "/../../etc/passwd", {{"tab", tab}}, nullptr, 404);
  ask("GET", "/api/maps", {{"tab", tab}, {"step", "99"}}, nullptr, 400);
  ask("GET", "/api/maps", {{"tab", tab}, {"step", "-1"}}, nullptr, 400);
  for (const char* points : {"x", "", "nan", "-5", "1e300"})
    ask("GET", "/api/trace",
        {{"tab", tab},
         {"experiment", "free"},
         {"signal", "motor_balance"},
         {"from", "0"},
         {"to", "1"},
         {"points", points}},
        nullptr, 400);
  ask("GET", "/api/trace",
      {{"tab", tab}, {"experiment", "none"}, {"signal", "x"}, {"from", "0"}, {"to", "1"}, {"points", "10"}}, nullptr,
      400);
  act(tab, {{"do", "format the disk"}}, 400);
  act(tab, {{"do", 7}}, 400);
  act(tab, json::array(), 400);
  EXPECT_EQ(api_->answer({"POST", "/api/do", {{"tab", tab}}, "{", {}}).status, 400);
  EXPECT_EQ(api_->answer({"DELETE", "/api/do", {{"tab", tab}}, "", {}}).status, 404);
}

TEST_F(WorkbenchApi, RemovesAnEffectTakesThatBackAndLeavesTheOtherTabAlone) {
  const std::string tab = new_tab(), other = new_tab();
  act(tab, {{"do", "remove"}, {"effect", "coulomb_friction"}});
  json state = state_after_work(tab);
  ASSERT_FALSE(state.contains("problem")) << state["problem"];
  ASSERT_EQ(state["steps"].size(), 2u);
  EXPECT_EQ(state["at"], 1);
  const auto fit = [](const json& step) { return step["balances"][0]["fit"].get<double>(); };
  EXPECT_GT(fit(state["steps"][1]), 3.0 * fit(state["steps"][0]));
  act(tab, {{"do", "undo"}});
  EXPECT_EQ(state_after_work(tab)["at"], 0);
  act(tab, {{"do", "redo"}});
  EXPECT_EQ(state_after_work(tab)["at"], 1);
  act(tab, {{"do", "go"}, {"step", 5}}, 400);
  EXPECT_EQ(state_after_work(other)["steps"].size(), 1u);
  // A tab that was duplicated begins where the first one stands.
  const std::string copy = ask("POST", "/api/tab", {{"like", tab}})["tab"].get<std::string>();
  EXPECT_EQ(state_after_work(copy)["steps"].size(), 2u);
}

TEST_F(WorkbenchApi, SaysWhyAnEffectCannotBeAdded) {
  const std::string tab = new_tab();
  act(tab, {{"do", "add"}, {"effect", "no_such_effect"}});
  const json state = state_after_work(tab);
  ASSERT_TRUE(state.contains("problem"));
  EXPECT_NE(state["problem"]["what"].get<std::string>().find("no_such_effect"), std::string::npos);
  EXPECT_EQ(state["steps"].size(), 1u);
}

TEST_F(WorkbenchApi, SavesIntoItsFolderAloneAndReplacesOnlyWhenTold) {
  const std::string tab = new_tab();
  act(tab, {{"do", "save"}, {"what", "model"}, {"name", "mine.toml"}});
  EXPECT_EQ(state_after_work(tab)["saved"]["file"], (folder_ / "mine.toml").string());
  const auto& known = catalogue::known_effects();
  EXPECT_EQ(model::read(folder_ / "mine.toml", known).model.effects.size(), first()->model.effects.size());
  act(tab, {{"do", "save"}, {"what", "model"}, {"name", "mine.toml"}}, 400);
  act(tab, {{"do", "save"}, {"what", "model"}, {"name", "mine.toml"}, {"replace", true}});
  state_after_work(tab);
  for (const char* name : {"../x.toml", "/tmp/x.toml", "x.sh", ".x.toml", "a/b.toml"})
    act(tab, {{"do", "save"}, {"what", "model"}, {"name", name}}, 400);
  act(tab, {{"do", "save"}, {"what", "passwd"}, {"name", "x.toml"}}, 400);
  // Another model is not the one that was saved.
  act(tab, {{"do", "refit"}});
  EXPECT_FALSE(state_after_work(tab).contains("saved"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(WorkbenchApi, SaysWhatIsWrongWithADroppedFile) {
  const std::string tab = new_tab();
  const auto drop = [&](const std::string& name, const std::string& content) {
    return api_->answer({"POST", "/api/drop", {{"tab", tab}}, "", {{name, content}}}).status;
  };
  ASSERT_EQ(drop("bad.csv", "time_s,current_a,motor_position_rad\n0,1,2\n0.001,oops,2\n"), 200);
  const json state = state_after_work(tab);
  ASSERT_TRUE(state.contains("problem"));
  const json& finding = state["problem"]["findings"].at(0);
  EXPECT_EQ(finding["file"], "bad.csv");
  EXPECT_EQ(finding["line"], 3);
  EXPECT_EQ(finding["column"], "current_a");
  EXPECT_FALSE(finding["remedy"].get<std::string>().empty());
  EXPECT_EQ(state["experiments"].size(), 2u);
  // The search that begins by itself does not take the message away.
  act(tab, {{"do", "diagnose"}});
  act(tab, {{"do", "cancel"}});
  EXPECT_TRUE(state_after_work(tab).contains("problem"));
  EXPECT_EQ(drop("dataset.toml", "format = \"flexspline-dataset/1\"\n"), 400);
  EXPECT_EQ(drop("../evil.csv", "time_s\n"), 400);
  EXPECT_EQ(drop("run.sh", "#!/bin/sh\n"), 400);
}

TEST_F(WorkbenchApi, ARefusalHasAReasonWhateverTheNamesInTheRequest) {
  using namespace std::string_literals;
  const std::string tab = new_tab();
  const auto reason = [&](Request request) {
    request.query["tab"] = tab;
    const Answer answer = api_->answer(request);
    EXPECT_EQ(answer.status, 400) << answer.body;
    return json::parse(answer.body)["what"].get<std::string>();
  };
  // A text in C ends at its first zero, and a message that begins with such a name is empty.
  EXPECT_EQ(reason({"POST", "/api/drop", {}, "", {{"\0\0../a.csv(x"s, "time_s\n"}}}),
            "the name of a file holds a byte that is not text");
  EXPECT_EQ(reason({"GET", "/api/live", {{"since", "\0"s}}, "", {}}), "since holds a byte that is not text");
  EXPECT_EQ(reason({"POST", "/api/do", {}, R"({"do": "\u0000"})", {}}), "do holds a byte that is not text");
  EXPECT_FALSE(reason({"POST", "/api/do", {}, "{\"do\": \"\xE7\xE7", {}}).empty());
}

TEST_F(WorkbenchApi, RunsTheClosedLoopWithoutCompensationWithTheModelAsOpenedAndWithThePresentOne) {
  std::vector<closed_loop::Job> ran;
  run_ = [&](const std::vector<closed_loop::Job>& jobs) {
    std::vector<closed_loop::Outcome> outcomes;
    for (const closed_loop::Job& job : jobs) {
      ran.push_back(job);
      closed_loop::Outcome o;
      o.what = "made up";
      o.seconds = 2.0;
      o.tick_hz = closed_loop::kTwinTickHz;
      // Worse without compensation than with; the block distinguishes the two models.
      o.rms_error_rad = !job.compensation ? 1e-3 : job.block == ran.front().block ? 4e-4 : 2e-4;
      o.trace.time_s = {0.0, 1.0, 2.0};
      o.trace.error_rad = {0.0, o.rms_error_rad, -o.rms_error_rad};
      o.trace.position_command_rad = o.trace.output_position_rad = o.trace.motor_velocity_rad_s = o.trace.current_a =
          o.trace.temperature_c = {0.0, 0.0, 0.0};
      outcomes.push_back(std::move(o));
    }
    return outcomes;
  };
  const std::string tab = new_tab();
  ask("GET", "/api/closed_loop", {{"tab", tab}}, nullptr, 404);
  act(tab, {{"do", "remove"}, {"effect", "viscous_friction"}});
  state_after_work(tab);
  act(tab, {{"do", "try"}, {"scenario", "sine"}});
  const json state = state_after_work(tab);
  ASSERT_FALSE(state.contains("problem")) << state["problem"];
  const json& found = state["closed_loop"];
  ASSERT_EQ(found["runs"].size(), 3u);
  EXPECT_EQ(found["runs"][0]["compensation"], "none");
  EXPECT_EQ(found["runs"][1]["compensation"], "base");
  EXPECT_EQ(found["runs"][2]["compensation"], "now");
  EXPECT_DOUBLE_EQ(found["runs"][1]["ratio_to_none"].get<double>(), 0.4);
  EXPECT_DOUBLE_EQ(found["runs"][2]["ratio_to_none"].get<double>(), 0.2);
  EXPECT_EQ(found["step"]["what"], "viscous_friction");
  // No true drive is known: it is the present model, and that is said.
  EXPECT_EQ(found["is_model"], true);
  ASSERT_EQ(ran.size(), 3u);
  for (const closed_loop::Job& job : ran) {
    EXPECT_EQ(job.plant.find("\"viscous_friction\""), std::string::npos);
    EXPECT_NE(job.plant.find("\"coulomb_friction\""), std::string::npos);
    EXPECT_EQ(job.scenario, "sine");
  }
  EXPECT_NE(ran[1].block, ran[2].block);
  const json traces = ask("GET", "/api/closed_loop", {{"tab", tab}});
  ASSERT_EQ(traces.size(), 3u);
  EXPECT_EQ(traces[0]["error"]["count"], 3);
  // A scenario may be a file, which no request may name.
  act(tab, {{"do", "try"}, {"scenario", "/etc/passwd"}}, 400);
  EXPECT_EQ(ran.size(), 3u);
}

TEST_F(WorkbenchApi, AClosedLoopThatIsCancelledMidwayLeavesNothingBehind) {
  std::promise<void> began, go;
  // A copy of its own: the closed loop may end after this test's body.
  run_ = [&began, released = go.get_future().share()](const std::vector<closed_loop::Job>& jobs) {
    began.set_value();  // a second group would throw
    released.wait();
    closed_loop::Outcome o;
    o.rms_error_rad = 1.0;
    return std::vector<closed_loop::Outcome>(jobs.size(), o);
  };
  const std::string tab = new_tab();
  act(tab, {{"do", "try"}, {"scenario", "sine"}});
  began.get_future().wait();
  act(tab, {{"do", "undo"}}, 409);
  act(tab, {{"do", "cancel"}});
  EXPECT_TRUE(state_after_work(tab)["work"].is_null());
  go.set_value();
  // Work after it is not disturbed by what comes of it late.
  act(tab, {{"do", "refit"}});
  const json state = state_after_work(tab);
  EXPECT_EQ(state["at"], 1);
  EXPECT_FALSE(state.contains("closed_loop"));
  EXPECT_FALSE(state.contains("problem"));
}

TEST_F(WorkbenchApi, ADriveThatIsNotInReachIsNotOpened) {
  const std::string tab = new_tab();
  act(tab, {{"do", "connect"}, {"drive", "tcp:192.0.2.1:4711"}});
  const json state = state_after_work(tab);
  ASSERT_TRUE(state.contains("problem"));
  EXPECT_EQ(ask("GET", "/api/drive")["status"]["connected"], false);
  act(tab, {{"do", "preview-flash"}});
  EXPECT_TRUE(state_after_work(tab).contains("problem"));
  act(tab, {{"do", "flash"}}, 400);  // nothing was shown
  act(tab, {{"do", "flash"}, {"before", "a"}, {"after", "b"}});
  EXPECT_TRUE(state_after_work(tab).contains("problem"));
}

TEST(WorkbenchSession, WorkThatIsCancelledChangesNothingAndIsNotInTheWay) {
  // The session waits for its threads when it ends: what they use must outlive it.
  std::promise<void> go, began, ran;
  bool changed = false;
  {
    Session session("tab", std::make_shared<Step>());
    session.start("slow", [&](const Progress& say) {
      began.set_value();
      go.get_future().wait();
      say("");  // throws: it was cancelled
      changed = true;
    });
    began.get_future().wait();
    EXPECT_TRUE(session.works());
    EXPECT_THROW(session.start("second", [](const Progress&) {}), BusyError);
    session.cancel();
    EXPECT_FALSE(session.works());
    session.start("third", [&](const Progress&) { ran.set_value(); });
    EXPECT_EQ(ran.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
    go.set_value();
    session.cancel();
  }
  EXPECT_FALSE(changed);
}

TEST_F(WorkbenchApi, StepsOfOneDataSetShareItsRecordsAndFitAsWithoutThem) {
  const Step& opened = *first();
  const auto say = [](std::string_view) {};
  ASSERT_NE(opened.pipeline.ready, nullptr);
  EXPECT_EQ(opened.pipeline.ready->records.size(), 2u);
  const std::shared_ptr<Step> shared = without_effect(opened, "viscous_friction", {}, say);
  EXPECT_EQ(shared->pipeline.ready, opened.pipeline.ready);
  const selection::Addition alone = selection::remove(*opened.dataset, opened.model, "viscous_friction", {});
  ASSERT_EQ(shared->model.effects.size(), alone.model.effects.size());
  for (std::size_t e = 0; e < alone.model.effects.size(); ++e)
    for (std::size_t p = 0; p < alone.model.effects[e].parameters.size(); ++p)
      EXPECT_EQ(shared->model.effects[e].parameters[p].value, alone.model.effects[e].parameters[p].value);
  EXPECT_DOUBLE_EQ((*shared->errors)["balances"][0]["holdout"].get<double>(), *alone.after.rmse_holdout);
}

TEST(WorkbenchStep, WhatIsMissingIsSearchedOnceForAllTabsAndAgainWhereASearchGaveUp) {
  Step step;
  struct GaveUp {};
  std::promise<void> began, go;
  std::atomic<int> searches{0}, waited{0};
  std::thread first([&] {
    EXPECT_THROW(step.diagnose(
                     [&]() -> selection::Diagnosis {
                       ++searches;
                       began.set_value();
                       go.get_future().wait();
                       throw GaveUp{};
                     },
                     [] {}),
                 GaveUp);
  });
  began.get_future().wait();
  // Who waits may go away.
  EXPECT_THROW(step.diagnose([] { return selection::Diagnosis{}; }, [] { throw GaveUp{}; }), GaveUp);
  EXPECT_EQ(step.diagnosed(), nullptr);
  const auto search = [&] {
    ++searches;
    return selection::Diagnosis{};
  };
  std::thread second([&] { step.diagnose(search, [&] { ++waited; }); });
  while (waited == 0) std::this_thread::yield();
  EXPECT_EQ(searches, 1);
  go.set_value();
  first.join();
  second.join();
  EXPECT_EQ(searches, 2);
  EXPECT_NE(step.diagnosed(), nullptr);
  step.diagnose(search, [] {});
  EXPECT_EQ(searches, 2) << "it is known";
}

TEST_F(WorkbenchApi, TheNextProcessHasTheTabsOfTheOneThatEndedAndSaysWhatEndedIt) {
  struct Setup setup;
  setup.first = first();
  setup.folder = setup.scratch = folder_;
  api_ = std::make_unique<Api>(setup);
  const std::string tab = new_tab(), other = new_tab();
  act(tab, {{"do", "remove"}, {"effect", "viscous_friction"}});
  const json before = state_after_work(tab);
  act(tab, {{"do", "undo"}});
  act(tab, {{"do", "redo"}});
  api_.reset();

  const std::string diagnosis = [&] {
    std::ifstream in(folder_ / "tabs.json");
    const json all = json::parse(in);
    for (const json& kept : all.at("tabs"))
      if (kept.at("id") == tab) return "diagnose " + kept.at("steps").back().get<std::string>();
    return std::string();
  }();
  setup.failures.push_back({"it crashed",
                            {{tab, "Searching for what is missing", diagnosis, true},
                             {other, "Identifying", "", true},
                             {other, "Showing /api/maps", "", false}},
                            true});
  api_ = std::make_unique<Api>(setup);
  const json after = state_after_work(tab);
  ASSERT_EQ(after["steps"].size(), 2U);
  EXPECT_EQ(after["at"], 1);
  EXPECT_EQ(after["steps"][1]["what"], "viscous_friction");
  EXPECT_EQ(after["parameters"], before["parameters"]);
  // The model comes from its file, which has six digits and more.
  const double error = before["steps"][1]["balances"][0]["fit"].get<double>();
  EXPECT_NEAR(after["steps"][1]["balances"][0]["fit"].get<double>(), error, 1e-6 * error);
  EXPECT_GT(after["changes"].get<std::uint64_t>(), before["changes"].get<std::uint64_t>());
  EXPECT_EQ(after["problem"]["during"], "Searching for what is missing");
  EXPECT_EQ(after["problem"]["what"].get<std::string>().find("it crashed"), 0U);
  EXPECT_NE(
      state_after_work(other)["problem"]["what"].get<std::string>().find("Searching for what is missing, which failed"),
      std::string::npos);
  // What the page begins by itself is not begun again; all else may be tried.
  act(tab, {{"do", "diagnose"}}, 500);
  act(tab, {{"do", "refit"}});
  EXPECT_EQ(state_after_work(tab)["steps"].size(), 3U);
}

TEST_F(WorkbenchApi, ARefitThatIsCancelledEndsWithinTheFit) {
  std::promise<void> go, began, ran;
  std::atomic<bool> fitted{false};
  Session session("tab", first());
  session.start("slow", [&](const Progress& say) {
    began.set_value();
    go.get_future().wait();
    const std::shared_ptr<Step> next = refitted(*session.history().current(), {}, [](std::string_view) {});
    fitted = true;
    say("");
  });
  began.get_future().wait();
  session.cancel();
  go.set_value();
  session.start("next", [&](const Progress&) { ran.set_value(); });
  ran.get_future().wait();
  session.join();
  EXPECT_FALSE(fitted) << "it was done to its end for nobody";
  EXPECT_EQ(session.history().size(), 1u);
}

}  // namespace
}  // namespace flexspline::workbench::workbench_api_test
