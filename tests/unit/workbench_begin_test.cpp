// host/app/workbench without a model: recordings are dropped, columns chosen, and there is a first step.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "host/app/workbench/api.hpp"
#include "host/app/workbench/work.hpp"
#include "tests/unit/comparison_test_drive.hpp"

namespace flexspline::workbench::workbench_begin_test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using plant::Mode;
using plant::Waveform;

class WorkbenchBegin : public ::testing::Test {
 protected:
  WorkbenchBegin() {
    std::string name = (fs::temp_directory_path() / "flexspline-begin-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
    folder_ = name;
    fs::create_directories(folder_ / "scratch");
    start({});
  }
  ~WorkbenchBegin() override {
    api_.reset();
    fs::remove_all(folder_);
  }

  void start(std::vector<Failure> failures) {
    struct Setup setup;
    setup.folder = folder_;
    setup.scratch = folder_ / "scratch";
    setup.failures = std::move(failures);
    setup.projects.propose = [this](const std::vector<fs::path>& files, const Choices& choices) {
      files_ = files;
      choices_ = choices;
      if (files.front().filename() == "broken.csv") throw std::runtime_error("it is broken");
      return json{
          {"can_begin", !choices.map.empty()},
          {"columns", {{{"column", "time_s"}, {"source", "t"}}, {{"column", "current_a"}, {"source", nullptr}}}}};
    };
    setup.projects.make = [this](const std::vector<fs::path>&, const Choices& choices, const fs::path& place) {
      choices_ = choices;
      std::ofstream(place / "dataset.toml") << "format = \"flexspline-dataset/1\"\n[drive]\ngear_ratio = 100\n"
                                               "torque_constant_nm_a = 0.1\n[columns.time_s]\nsource = \"t\"\n"
                                               "[columns.current_a]\nsource = \"i\"\n"
                                               "[columns.motor_position_rad]\nsource = \"q\"\n";
      return Project{std::make_shared<data::Dataset>(data::load({place / "dataset.toml"})), kModel, "kept = 1\n"};
    };
    api_ = std::make_unique<Api>(std::move(setup));
  }

  json ask(const std::string& method, const std::string& path, std::map<std::string, std::string> query = {},
           const json& body = nullptr, int status = 200) {
    const Answer answer = api_->answer({method, path, std::move(query), body.is_null() ? "" : body.dump(), {}});
    EXPECT_EQ(answer.status, status) << path << ": " << answer.body;
    return json::parse(answer.body);
  }
  std::string new_tab() { return ask("POST", "/api/tab")["tab"].get<std::string>(); }
  void act(const std::string& tab, const json& what, int status = 200) {
    ask("POST", "/api/do", {{"tab", tab}}, what, status);
  }
  int drop(const std::string& tab, const std::string& name, const std::string& content) {
    return api_->answer({"POST", "/api/drop", {{"tab", tab}}, "", {{name, content}}}).status;
  }
  json state_after_work(const std::string& tab) {
    for (std::uint64_t seen = 0;;) {
      json state = ask("GET", "/api/state", {{"tab", tab}, {"seen", std::to_string(seen)}});
      if (state.contains("work") && state["work"].is_null()) return state;
      seen = state["changes"].get<std::uint64_t>();
    }
  }

  static std::string log() {
    std::string text = "t,i,q\n";
    for (int k = 0; k < 1000; ++k) {
      const double t = 0.004 * k, speed = 60.0 * std::cos(2.0 * t), acceleration = -120.0 * std::sin(2.0 * t);
      text += std::to_string(t) + "," + std::to_string(2e-3 * acceleration + 0.01 * speed) + "," +
              std::to_string(30.0 * std::sin(2.0 * t)) + "\n";
    }
    return text;
  }

  static constexpr const char* kModel =
      "format = \"flexspline-model/1\"\n[drive]\ngear_ratio = 100\ntorque_constant_nm_a = 0.1\nrated_current_a = 2\n"
      "rated_velocity_rad_s = 200\n[[effect]]\ntype = \"inertia\"\n[[effect]]\ntype = \"viscous_friction\"\n";
  fs::path folder_;
  std::vector<fs::path> files_;
  Choices choices_;
  std::unique_ptr<Api> api_;
};

TEST_F(WorkbenchBegin, WithoutAModelThereIsNothingToDoButToBegin) {
  const std::string tab = new_tab();
  const json state = state_after_work(tab);
  EXPECT_TRUE(state["steps"].empty());
  for (const char* what : {"undo", "diagnose", "refit", "pack", "flash", "preview-flash"})
    act(tab, {{"do", what}}, 400);
  act(tab, {{"do", "add"}, {"effect", "inertia"}}, 400);
  act(tab, {{"do", "begin"}}, 400);
  act(tab, {{"do", "propose"}}, 400);
  ask("GET", "/api/maps", {{"tab", tab}}, nullptr, 404);
  ask("GET", "/api/file", {{"tab", tab}, {"what", "model"}}, nullptr, 400);
}

TEST_F(WorkbenchBegin, ARecordingIsDroppedColumnsAreChosenAndAModelIsThere) {
  const std::string tab = new_tab();
  ASSERT_EQ(drop(tab, "log.csv", log()), 200);
  EXPECT_FALSE(state_after_work(tab)["proposal"]["can_begin"].get<bool>());
  const json choices = {
      {"map", {"current_a=i"}}, {"gear_ratio", 100}, {"tolerate", {"jitter"}}, {"joint", 2}, {"position_side", "link"}};
  act(tab, {{"do", "propose"}, {"choices", choices}});
  EXPECT_TRUE(state_after_work(tab)["proposal"]["can_begin"].get<bool>());
  EXPECT_EQ(choices_.map, std::vector<std::string>{"current_a=i"});
  EXPECT_EQ(choices_.gear_ratio, 100.0);
  EXPECT_EQ(choices_.joint, 2);
  EXPECT_EQ(choices_.position_side, "link");
  ASSERT_EQ(files_.size(), 1u);
  act(tab, {{"do", "begin"}, {"choices", choices}});
  const json state = state_after_work(tab);
  ASSERT_EQ(state["steps"].size(), 1u) << state.dump();
  EXPECT_FALSE(state.contains("proposal"));
  EXPECT_EQ(state["data_name"], "log.csv");
  EXPECT_NEAR(state["parameters"].at(0)["value"].get<double>(), 2e-4, 4e-6);
  EXPECT_EQ(api_->answer({"GET", "/api/file", {{"tab", tab}, {"what", "dataset"}}, "", {}}).body, "kept = 1\n");
  // Another process goes on with it.
  api_.reset();
  start({{"it crashed", {{tab, "Identifying", "", true}}, true}});
  const json again = state_after_work(tab);
  ASSERT_EQ(again["steps"].size(), 1u) << again.dump();
  EXPECT_EQ(again["data_name"], "log.csv");
  EXPECT_TRUE(again.contains("problem"));
}

TEST_F(WorkbenchBegin, ThePitchOfALinearAxisIsAChoice) {
  const std::string tab = new_tab();
  ASSERT_EQ(drop(tab, "log.csv", log()), 200);
  state_after_work(tab);
  act(tab, {{"do", "propose"}, {"choices", {{"axis", "linear"}, {"pitch_m", 0.005}}}});
  state_after_work(tab);
  EXPECT_EQ(choices_.pitch_m, 0.005);
  act(tab, {{"do", "propose"}, {"choices", {{"pitch_m", 0}}}}, 400);
}

TEST_F(WorkbenchBegin, ForeignRecordingsInATabWithAModelAreAskedForAndAdded) {
  const std::string tab = new_tab();
  ASSERT_EQ(drop(tab, "log.csv", log()), 200);
  state_after_work(tab);
  act(tab, {{"do", "begin"}});
  const std::size_t before = state_after_work(tab)["experiments"].size();
  ASSERT_EQ(drop(tab, "more.csv", log()), 200);
  const json asked = state_after_work(tab);
  EXPECT_TRUE(asked["proposal"]["adds"].get<bool>()) << asked.dump();
  EXPECT_EQ(choices_.torque_constant_nm_a, 0.1) << "the drive is known by now";
  // Also where the user has chosen a column: only what is stated takes the place of the drive's facts.
  act(tab, {{"do", "propose"}, {"choices", {{"map", {"current_a=i"}}, {"torque_constant_nm_a", 0.2}}}});
  state_after_work(tab);
  EXPECT_EQ(choices_.gear_ratio, 100.0);
  EXPECT_EQ(choices_.torque_constant_nm_a, 0.2);
  act(tab, {{"do", "begin"}});
  const json state = state_after_work(tab);
  EXPECT_EQ(choices_.gear_ratio, 100.0);
  EXPECT_EQ(state["steps"].size(), 2u) << state.dump();
  EXPECT_EQ(state["experiments"].size(), before + 1);
  // Those that are left out are forgotten.
  ASSERT_EQ(drop(tab, "third.csv", log()), 200);
  EXPECT_TRUE(state_after_work(tab).contains("proposal"));
  // One that comes while columns are chosen joins those that wait for them; one that cannot be read does not.
  ASSERT_EQ(drop(tab, "fourth.csv", log()), 200);
  EXPECT_TRUE(state_after_work(tab).contains("proposal"));
  EXPECT_EQ(files_.size(), 2u);
  ASSERT_EQ(drop(tab, "broken.csv", "?"), 200);
  EXPECT_TRUE(state_after_work(tab).contains("problem"));
  act(tab, {{"do", "propose"}});
  state_after_work(tab);
  EXPECT_EQ(files_.size(), 2u);
  act(tab, {{"do", "forget"}});
  EXPECT_FALSE(state_after_work(tab).contains("proposal"));
  act(tab, {{"do", "begin"}}, 400);
}

TEST_F(WorkbenchBegin, AFileThatCannotBeReadIsNotInTheWayOfTheNext) {
  const std::string tab = new_tab();
  ASSERT_EQ(drop(tab, "log.csv", log()), 200);
  state_after_work(tab);
  ASSERT_EQ(drop(tab, "broken.csv", "?"), 200);
  EXPECT_EQ(state_after_work(tab)["problem"]["what"], "it is broken");
  act(tab, {{"do", "propose"}});
  state_after_work(tab);
  EXPECT_EQ(files_.size(), 1u);
  EXPECT_EQ(drop(tab, "run.sh", "#!"), 400);
  EXPECT_EQ(drop(tab, "dataset.toml", ""), 400);
}

TEST_F(WorkbenchBegin, ASecondFileOfTheSameNameDoesNotReplaceTheFirst) {
  const std::string tab = new_tab();
  ASSERT_EQ(drop(tab, "log.csv", log()), 200);
  state_after_work(tab);
  ASSERT_EQ(drop(tab, "log.csv", "t,i,q\n0,1,2\n"), 200);
  state_after_work(tab);
  ASSERT_EQ(files_.size(), 2u);
  EXPECT_EQ(files_[0].filename(), "log-2.csv");
  EXPECT_EQ(files_[1].filename(), "log.csv");
  EXPECT_EQ(fs::file_size(files_[1]), log().size());
  const Answer both = api_->answer({"POST", "/api/drop", {{"tab", tab}}, "", {{"a.csv.gz", "1"}, {"a.csv.gz", "2"}}});
  ASSERT_EQ(both.status, 200) << both.body;
  state_after_work(tab);
  ASSERT_EQ(files_.size(), 4u);
  EXPECT_EQ(files_[0].filename(), "a-2.csv.gz");
}

TEST_F(WorkbenchBegin, AProposalHoldsTheChoicesForAPageThatIsLoadedAgain) {
  const std::string tab = new_tab();
  ASSERT_EQ(drop(tab, "log.csv", log()), 200);
  state_after_work(tab);
  const json choices = {{"map", {"current_a=i"}}, {"page", {{"facts", {{"gear_ratio", "100"}}}}}};
  act(tab, {{"do", "propose"}, {"choices", choices}});
  EXPECT_EQ(state_after_work(tab)["proposal"]["choices"], choices);
}

TEST_F(WorkbenchBegin, ChoicesOfTheWrongKindAreRefused) {
  const std::string tab = new_tab();
  ASSERT_EQ(drop(tab, "log.csv", log()), 200);
  state_after_work(tab);
  const json wrong[] = {{{"gear_ratio", -1}},  {{"gear_ratio", "x"}}, {{"joint", 1.5}},    {{"map", "a=b"}},
                        {{"map", {1}}},        {{"axis", "round"}},   {{"pole_pairs", 0}}, {{"tolerate", {{"a", 1}}}},
                        {{"position_side", 3}}};
  for (const json& choices : wrong) act(tab, {{"do", "propose"}, {"choices", choices}}, 400);
  act(tab, {{"do", "propose"}, {"choices", 3}}, 400);
}

}  // namespace
}  // namespace flexspline::workbench::workbench_begin_test
