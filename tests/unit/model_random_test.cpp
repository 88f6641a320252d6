// Random models against random texts of other random models, in all the forms that a parameter can have.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "host/physics/model/model.hpp"
#include "tests/unit/model_some_effects.hpp"

namespace flexspline::model::model_random_test {
namespace {

const std::string kHead = "format = \"flexspline-model/1\"\n";

ModelFile file_of(const std::string& text) {
  return parse(text, "m.toml", SomeEffects());
}

class RandomModels {
 public:
  explicit RandomModels(unsigned seed) : random_(seed) {}

  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(random_); }
  bool coin() { return below(2) == 0; }
  std::optional<double> maybe(double low, double high) {
    if (below(4) == 0) return std::nullopt;
    return std::uniform_real_distribution<double>(low, high)(random_) * std::pow(10.0, -below(6));
  }

  Model model() {
    Model result;
    if (coin()) result.name = "model " + std::to_string(below(5));
    if (coin()) result.drive.gear_ratio = {maybe(1.0, 200.0), coin() ? "a sheet" : ""};
    if (coin()) result.drive.rated_torque_nm.value = maybe(1.0, 50.0);
    for (const char* type : {"viscous_friction", "coulomb_friction", "power_law_friction", "torque_ripple"})
      for (const char* id : {"", "a", "b"})
        if (below(3) == 0) result.effects.push_back(effect(type, id));
    std::shuffle(result.effects.begin(), result.effects.end(), random_);
    for (int i = below(3); i > 0; --i) result.history.push_back(history());
    return result;
  }

  History history() { return {coin() ? "add" : "remove", "x", maybe(0.0, 1.0), maybe(0.0, 1.0)}; }

  Effect effect(const std::string& type, const std::string& id) {
    Effect result = effect_of(type, id.empty() ? id : type + id);
    for (Parameter& parameter : result.parameters) {
      parameter.value = parameter.name == "order" ? 1 + below(8) : maybe(0.0, 1.0);
      if (parameter.name == "exponent" && parameter.value) parameter.value = 0.1 + 0.5 * *parameter.value;
      parameter.std = maybe(0.0, 1.0);
      parameter.spread_percent = maybe(-10.0, 100.0);
      parameter.fixed = parameter.value && below(4) == 0;
    }
    return result;
  }

  // A file of the model with comments after which a rewrite can be judged; each comment stands once.
  std::string text(const Model& model) {
    std::string result = kHead + comment();
    if (!model.name.empty()) result += "name = \"" + model.name + "\"" + comment();
    if (coin()) result += "[drive]" + comment();
    for (const Effect& effect : model.effects) {
      result += "\n[[effect]]\ntype = \"" + effect.type + "\"\nid = \"" + effect.id + "\"\n";
      std::string prefix = "parameters.";
      const int form = below(4);
      if (form == 0) result += "[effect.parameters]\n";
      if (form == 1) result += "parameters = {";
      bool first = true;
      for (const Parameter& p : effect.parameters) {
        if (!p.value) continue;
        const std::string value = std::to_string(*p.value);
        const std::string table = "{value=" + value + (p.std ? ", std = 0.5" : "") + "}";
        if (form == 0) result += "\t" + p.name + " = " + (coin() ? value : table) + "\n";
        if (form == 1) result += (first ? "" : ",") + p.name + "=" + (coin() ? value : table);
        if (form == 2) result += "parameters." + p.name + (coin() ? " = " + table : ".value = " + value) + "\n";
        if (form == 3) result += "[effect.parameters." + p.name + "]\n  value = " + value + "\n";
        first = false;
      }
      if (form == 1) result += "}\n";
    }
    for (const History& history : model.history)
      result += "\n[[history]]\naction = \"" + history.action + "\"\neffect = \"" + history.effect + "\"\n";
    if (coin()) result.pop_back();
    return result;
  }

 private:
  std::string comment() { return "  # remark " + std::to_string(++comments_) + "\n"; }

  std::mt19937 random_;
  int comments_ = 0;
};

bool near(const std::optional<double>& a, const std::optional<double>& b, double relative) {
  if (!a || !b) return a.has_value() == b.has_value();
  return std::abs(*a - *b) <= relative * std::abs(*b);
}

void expect_same(const Model& read, const Model& meant) {
  EXPECT_EQ(read.name, meant.name);
  EXPECT_EQ(read.drive.gear_ratio.value, meant.drive.gear_ratio.value);
  EXPECT_EQ(read.drive.gear_ratio.source, meant.drive.gear_ratio.source);
  EXPECT_EQ(read.drive.rated_torque_nm.value, meant.drive.rated_torque_nm.value);
  ASSERT_EQ(read.effects.size(), meant.effects.size());
  for (const Effect& effect : meant.effects) {
    const Effect* other = read.find(effect.id);
    ASSERT_NE(other, nullptr) << effect.id;
    EXPECT_EQ(other->type, effect.type);
    for (const Parameter& p : effect.parameters) {
      const Parameter* q = other->find(p.name);
      ASSERT_NE(q, nullptr);
      EXPECT_TRUE(near(q->value, p.value, p.fixed ? 0.0 : 5.1e-6)) << effect.id << "." << p.name;
      EXPECT_TRUE(near(q->std, p.std, 5.1e-3)) << effect.id << "." << p.name;
      EXPECT_TRUE(near(q->spread_percent, p.spread_percent, 5.1e-3)) << effect.id << "." << p.name;
      EXPECT_EQ(q->fixed, p.fixed);
    }
  }
  ASSERT_EQ(read.history.size(), meant.history.size());
  for (std::size_t i = 0; i < meant.history.size(); ++i) {
    EXPECT_EQ(read.history[i].action, meant.history[i].action);
    EXPECT_TRUE(near(read.history[i].rmse_after, meant.history[i].rmse_after, 5.1e-6));
  }
}

TEST(ModelRewrite, AnyModelComesBackFromAnyFileAndASecondRewriteChangesNothing) {
  RandomModels random(20240314);
  for (int i = 0; i < 100; ++i) {
    const ModelFile file = file_of(random.text(random.model()));
    Model changed = random.model();
    changed.history.insert(changed.history.begin(), file.model.history.begin(), file.model.history.end());
    std::string text;
    ASSERT_NO_THROW(text = rewrite(file, changed)) << file.text;
    const ModelFile again = file_of(text);
    expect_same(again.model, changed);
    EXPECT_EQ(rewrite(again, again.model), text);
    EXPECT_EQ(rewrite(again, changed), text);
    // A remark on the name's line goes with the name.
    const bool all_stay = !changed.name.empty() || file.model.name.empty();
    for (int remark = 1; all_stay; ++remark) {
      const std::string line_end = "# remark " + std::to_string(remark) + "\n";
      if (file.text.find(line_end) == std::string::npos) break;
      EXPECT_NE(text.find(line_end), std::string::npos) << line_end;
    }
    if (HasFailure()) {
      ADD_FAILURE() << "in round " << i << ", from\n" << file.text << "\nto\n" << text;
      return;
    }
  }
}

TEST(ModelWrite, AnyModelComesBackFromItsOwnNewFile) {
  RandomModels random(7);
  for (int i = 0; i < 100 && !HasFailure(); ++i) {
    const Model model = random.model();
    expect_same(file_of(write(model)).model, model);
  }
}

}  // namespace
}  // namespace flexspline::model::model_random_test
