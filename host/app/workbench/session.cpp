#include "host/app/workbench/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <new>
#include <nlohmann/json.hpp>

#include "host/engine/estimation/cancellation.hpp"
#include "host/output/answers/diagnosis.hpp"
#include "host/output/answers/diagnosis_sentences.hpp"
#include "host/output/answers/json.hpp"

namespace flexspline::workbench {
namespace {

using nlohmann::json;
using output::json_number;

json diagnosis_json(const selection::Diagnosis& found) {
  json answer = output::diagnosis_json(found);
  answer["verdict_in_words"] = output::verdict_in_words(found);
  for (json& candidate : answer["candidates"]) {
    const catalogue::Entry* entry = catalogue::find(candidate["effect"].get<std::string>());
    candidate["equation"] = entry ? json(entry->info->equation) : json(nullptr);
  }
  return answer;
}

json step_json(const Step& step) {
  return {{"id", step.id},
          {"action", step.action},
          {"what", step.what},
          {"balances", (*step.errors)["balances"]},
          {"effects", [&] {
             json ids = json::array();
             for (const model::Effect& e : step.model.effects) ids.push_back(e.id);
             return ids;
           }()}};
}

json state_of(const History<std::shared_ptr<Step>>& history) {
  const Step& now = *history.current();
  json steps = json::array();
  for (std::size_t k = 0; k < history.size(); ++k) steps.push_back(step_json(*history[k]));
  const auto found = now.diagnosed();
  json answer = *now.errors;
  json warnings = answer["warnings"];
  for (const data::Finding& f : now.dataset->findings)
    if (f.severity == data::Severity::warning) warnings.push_back(f.text());
  for (const std::string& w : now.warnings) warnings.push_back(w);
  answer["warnings"] = std::move(warnings);
  answer["model_name"] = now.model.name;
  answer["steps"] = std::move(steps);
  answer["at"] = history.at();
  answer["parameters"] = now.view()->parameters();
  answer["diagnosis"] = found ? diagnosis_json(*found) : json(nullptr);
  json before = json::array();
  if (history.at() > 0)
    for (const model::Effect& e : history[history.at() - 1]->model.effects)
      for (const model::Parameter& p : e.parameters)
        before.push_back(
            {{"id", e.id}, {"parameter", p.name}, {"value", p.value ? json_number(*p.value) : json(nullptr)}});
  answer["parameters_before"] = std::move(before);
  answer["has_dataset_text"] = !history[0]->dataset_text.empty();
  return answer;
}

}  // namespace

json problem_json(const std::string& during, const std::exception_ptr& error) {
  json findings = json::array();
  std::string what = "something unexpected went wrong";
  try {
    std::rethrow_exception(error);
  } catch (const data::DataError& unusable) {
    for (const data::Finding& f : unusable.findings())
      if (f.severity == data::Severity::error)
        findings.push_back({{"file", std::filesystem::path(f.file).filename().string()},
                            {"line", f.line},
                            {"column", f.column},
                            {"what", f.what},
                            {"remedy", f.remedy}});
    what = findings.size() == 1 ? "the data cannot be used"
                                : fmt::format("{} things make the data unusable", findings.size());
  } catch (const std::bad_alloc&) {
    what = "there is not enough memory for it; take shorter records, or fewer";
  } catch (const std::exception& e) {
    what = e.what();
  } catch (...) {
  }
  return {{"during", during}, {"what", what}, {"findings", std::move(findings)}};
}

Step::Step() = default;
Step::~Step() = default;

std::shared_ptr<ResultView> Step::view() const {
  const std::lock_guard lock(mutex_);
  if (!view_) view_ = std::make_shared<ResultView>(dataset, model, pipeline, estimates);
  return view_;
}
void Step::discard_view() const {
  const std::lock_guard lock(mutex_);
  view_.reset();
}

std::shared_ptr<const selection::Diagnosis> Step::diagnosed() const {
  const std::lock_guard lock(mutex_);
  return diagnosis_;
}
void Step::diagnose(const std::function<selection::Diagnosis()>& search, const std::function<void()>& wait) {
  std::unique_lock lock(mutex_);
  while (searching_ && !diagnosis_) {
    searched_.wait_for(lock, std::chrono::milliseconds(50));
    lock.unlock();
    wait();
    lock.lock();
  }
  if (diagnosis_) return;
  searching_ = true;
  lock.unlock();
  std::shared_ptr<const selection::Diagnosis> found;
  std::exception_ptr failure;
  try {
    found = std::make_shared<const selection::Diagnosis>(search());
  } catch (...) {
    failure = std::current_exception();
  }
  lock.lock();
  diagnosis_ = std::move(found);
  searching_ = false;
  searched_.notify_all();
  lock.unlock();
  if (failure) std::rethrow_exception(failure);
}

Session::Session(std::string id, std::shared_ptr<Step> first, JobTable* jobs, JobLimits limits)
    : id_(std::move(id)),
      jobs_(jobs),
      limits_(limits),
      history_(std::move(first)),
      parts_(std::make_unique<json>(json::object())) {}

Session::~Session() {
  cancel();
  join();
}

void Session::join() {
  std::vector<std::shared_ptr<Work>> all;
  {
    const std::lock_guard lock(mutex_);
    all = ended_;
    if (work_) all.push_back(work_);
  }
  // A thread is joined once, here or by start().
  for (const auto& work : all) {
    while (!work->done) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const std::lock_guard lock(mutex_);
  std::erase_if(ended_, [](const std::shared_ptr<Work>& w) {
    if (!w->done) return false;
    w->thread.join();
    return true;
  });
}

void Session::changed() {
  ++changes_;
  changed_.notify_all();
}

History<std::shared_ptr<Step>> Session::history() const {
  const std::lock_guard lock(mutex_);
  return history_;
}

bool Session::has_model() const {
  const std::lock_guard lock(mutex_);
  return history_.current() != nullptr;
}

void Session::change(const std::function<void(History<std::shared_ptr<Step>>&)>& change) {
  const std::lock_guard lock(mutex_);
  change(history_);
  // The previous step is shown for comparison with the present one; others are rarely shown.
  for (std::size_t k = 0; k < history_.size(); ++k)
    if (history_[k] && (k > history_.at() || k + 1 < history_.at())) history_[k]->discard_view();
  parts_->erase("pack");
  parts_->erase("saved");
  parts_->erase("proposal");
  stored_.erase("recordings");
  parts_->erase("flash_preview");
  parts_->erase("problem");
  changed();
}

void Session::restore(History<std::shared_ptr<Step>> history, std::uint64_t changes) {
  const std::lock_guard lock(mutex_);
  history_ = std::move(history);
  changes_ = std::max(changes_, changes);
  changed();
}

void Session::set(const std::string& part, json value) {
  const std::lock_guard lock(mutex_);
  if (value.is_null())
    parts_->erase(part);
  else
    (*parts_)[part] = std::move(value);
  changed();
}

void Session::store(const std::string& part, json value) {
  auto stored = std::make_shared<const json>(std::move(value));
  const std::lock_guard lock(mutex_);
  stored_[part] = std::move(stored);
}
std::shared_ptr<const json> Session::stored(const std::string& part) const {
  const std::lock_guard lock(mutex_);
  const auto found = stored_.find(part);
  return found == stored_.end() ? nullptr : found->second;
}

void Session::set_problem(const std::string& during, const std::exception_ptr& error) {
  set("problem", problem_json(during, error));
}

void Session::set_problem(const std::string& during, const std::string& what) {
  set("problem", {{"during", during}, {"what", what}, {"findings", json::array()}});
}

void Session::start(const std::string& what, std::function<void(const Progress&)> run, bool by_itself,
                    const std::string& key) {
  const std::lock_guard lock(mutex_);
  if (work_) throw BusyError(fmt::format("{} is still running; wait, or cancel it", work_->what));
  std::erase_if(ended_, [](const std::shared_ptr<Work>& w) {
    if (!w->done) return false;
    w->thread.join();
    return true;
  });
  auto work = std::make_shared<Work>();
  work->what = what;
  work->began = std::chrono::steady_clock::now();
  work_ = work;
  ++works_started_;
  if (!by_itself) parts_->erase("problem");
  changed();
  work->thread = std::thread([this, work, run = std::move(run), key] {
    const Progress progress = [&](std::string_view stage) {
      const std::lock_guard inner(mutex_);
      if (work->cancelled) throw Cancelled{};
      work->stage = stage;
      changed();
    };
    std::exception_ptr error;
    const estimation::CancellationCheck ask = [&work = *work] {
      if (work.cancelled) throw Cancelled{};
    };
    const estimation::CancellationScope scope(&ask);
    JobTable::Entry entry(jobs_, {id_, work->what, key, true}, limits_.work, &ask);
    {
      const std::lock_guard inner(mutex_);
      work->entry = &entry;
      if (work->cancelled) entry.hurry(limits_.cancelled);
    }
    try {
      run(progress);
    } catch (const Cancelled&) {
    } catch (...) {
      error = std::current_exception();
    }
    const std::lock_guard inner(mutex_);
    work->entry = nullptr;
    if (work_ == work) {
      work_.reset();
      ended_.push_back(work);
      if (error) (*parts_)["problem"] = problem_json(work->what, error);
    }
    changed();
    work->done = true;
  });
}

void Session::cancel() {
  const std::lock_guard lock(mutex_);
  if (!work_) return;
  work_->cancelled = true;
  if (work_->entry) work_->entry->hurry(limits_.cancelled);
  ended_.push_back(std::move(work_));
  work_.reset();
  changed();
}

bool Session::works() const {
  const std::lock_guard lock(mutex_);
  return work_ != nullptr;
}

std::uint64_t Session::wait(std::uint64_t seen, std::chrono::milliseconds limit) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, limit, [&] { return changes_ > seen; });
  return changes_;
}

json Session::state() const {
  const std::lock_guard lock(mutex_);
  json answer = history_.current() ? state_of(history_) : json{{"steps", json::array()}, {"at", 0}};
  answer["changes"] = changes_;
  answer["works_started"] = works_started_;
  answer["work"] = nullptr;
  if (work_)
    answer["work"] = {
        {"what", work_->what},
        {"stage", work_->stage},
        {"seconds", std::chrono::duration<double>(std::chrono::steady_clock::now() - work_->began).count()}};
  for (const auto& [part, value] : parts_->items()) answer[part] = value;
  return answer;
}

}  // namespace flexspline::workbench
