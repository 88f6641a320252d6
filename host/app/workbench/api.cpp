#include "host/app/workbench/api.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "host/app/workbench/access_control.hpp"
#include "host/app/workbench/stored_tabs.hpp"
#include "host/app/workbench/work.hpp"
#include "host/engine/estimation/cancellation.hpp"
#include "host/output/answers/identification.hpp"

namespace flexspline::workbench {
namespace {

using nlohmann::json;

constexpr std::size_t kMostTabs = 24;
constexpr const char* kTabsFile = "tabs.json";
// Wait at the end of the server, so it is short.
constexpr auto kLongestWait = std::chrono::milliseconds(1500);

// An unknown path: 404.
class NotFound : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A request that ended a worker process before: 500.
class DeadlyError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// An invalid character would end the message there.
void require_text(std::string_view value, std::string_view what) {
  if (value.find('\0') != value.npos) throw UnknownNameError(fmt::format("{} holds a byte that is not text", what));
}

// Names of experiments may be of files whose names are no UTF-8.
std::string text_of(const json& answer) {
  return answer.dump(-1, ' ', false, json::error_handler_t::replace);
}

const std::string& text(const Request& request, const std::string& key) {
  const auto found = request.query.find(key);
  if (found == request.query.end()) throw UnknownNameError(fmt::format("\"{}\" is missing in the request", key));
  require_text(found->second, key);
  return found->second;
}

double number(const Request& request, const std::string& key) {
  const std::string& value = text(request, key);
  double parsed = 0.0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), parsed);
  if (error != std::errc() || end != value.data() + value.size() || parsed != parsed)
    throw UnknownNameError(fmt::format("\"{}\" is not a number, in {}", value, key));
  return parsed;
}

std::size_t whole(const Request& request, const std::string& key, double most = 1e9) {
  const double value = number(request, key);
  if (!(value >= 0.0 && value <= most)) throw UnknownNameError(fmt::format("{} is out of range", key));
  return static_cast<std::size_t>(value);
}

std::string field(const json& body, const char* key) {
  if (!body.contains(key) || !body[key].is_string())
    throw UnknownNameError(fmt::format("\"{}\" is missing in the request", key));
  const auto value = body[key].get<std::string>();
  require_text(value, key);
  return value;
}

std::string ending_of(const std::string& what) {
  if (what == "model" || what == "dataset") return ".toml";
  if (what == "report") return ".html";
  if (what == "block") return ".block";
  throw UnknownNameError(fmt::format("there is no \"{}\" to save; model, report and block are", what));
}

json reply_of(const std::string& what) {
  return {{"what", what}};
}

}  // namespace

Api::Api(Setup setup)
    : setup_(std::move(setup)),
      own_folder_(setup_.scratch.empty() ? std::make_unique<const system::TemporaryFolder>() : nullptr),
      dropped_(own_folder_ ? own_folder_->path() : setup_.scratch),
      drive_(setup_.drive, {.signer = setup_.signer}) {
  restore_tabs();
}

Api::~Api() {
  tabs_.clear();  // work ends before the objects that it uses
}

void Api::store_all_tabs() {
  const std::lock_guard lock(mutex_);
  if (!setup_.scratch.empty()) store_tabs(setup_.scratch / kTabsFile, tabs_);
}

// With the tabs of the worker before; those whose work ended it, or ended with it, get a message.
void Api::restore_tabs() {
  if (setup_.failures.empty()) return;
  tabs_ = load_tabs(setup_.scratch / kTabsFile, setup_.first, setup_.pipeline, setup_.jobs, setup_.limits);
  for (std::error_code error; std::filesystem::exists(dropped_ / std::to_string(drops_), error);) ++drops_;
  for (const Failure& failure : setup_.failures)
    if (failure.is_known && !failure.jobs.front().key.empty()) deadly_[failure.jobs.front().key] = failure.why;
  const Failure& last = setup_.failures.back();
  for (std::size_t k = 0; k < last.jobs.size(); ++k) {
    const Job& job = last.jobs[k];
    if (!job.is_work && !(last.is_known && k == 0)) continue;  // the page asks again by itself
    for (const auto& tab : tabs_)
      if (tab->id() == job.tab)
        tab->set_problem(job.what, last.is_known && k > 0
                                       ? fmt::format("it was ended by {}, which failed; start it again. A drive has to "
                                                     "be connected again",
                                                     last.jobs.front().what)
                                       : fmt::format("{}. Your steps are as they were before; a drive has to be "
                                                     "connected again",
                                                     last.why));
  }
}

void Api::refuse_deadly_job(const std::string& key) const {
  if (const auto found = deadly_.find(key); found != deadly_.end())
    throw DeadlyError(fmt::format("this was tried before, and {}; it is not tried again", found->second));
}

Answer Api::answer(const Request& request) {
  Answer answer;
  const estimation::CancellationCheck nobody;
  const estimation::CancellationScope known_by(&nobody);
  std::string key = request.path;
  for (const auto& [name, value] : request.query)
    if (name != "tab") key += fmt::format(" {}={}", name, value);
  const auto tab = request.query.find("tab");
  const bool computes = request.path != "/api/state" && request.method == "GET";
  const JobTable::Entry entry(
      setup_.jobs,
      {tab == request.query.end() ? "" : tab->second, "Showing " + request.path, computes ? key : "", false},
      setup_.limits.request, &nobody);
  try {
    if (computes) refuse_deadly_job(key);
    if (request.method == "GET" && request.path == "/api/file") return file(request);
    if (request.method == "GET")
      answer.body = text_of(get(request));
    else if (request.method == "POST")
      answer.body = text_of(post(request));
    else
      throw NotFound("only GET and POST are known");
  } catch (const NotFound& error) {
    answer.status = 404;
    answer.body = reply_of(error.what()).dump();
  } catch (const BusyError& error) {
    answer.status = 409;
    answer.body = reply_of(error.what()).dump();
  } catch (const DeadlyError& error) {
    answer.status = 500;
    answer.body = reply_of(error.what()).dump();
  } catch (const std::bad_alloc&) {
    answer.status = 500;
    answer.body = reply_of("there is not enough memory for it; take shorter records, or fewer").dump();
  } catch (const std::exception& error) {
    answer.status = 400;
    answer.body = text_of(reply_of(error.what()));
  }
  return answer;
}

std::shared_ptr<Session> Api::open_tab(const std::string& like) {
  const std::lock_guard lock(mutex_);
  std::shared_ptr<Session> made = std::make_shared<Session>(new_token(), setup_.first, setup_.jobs, setup_.limits);
  for (const auto& s : tabs_)
    if (s->id() == like) {
      const History<std::shared_ptr<Step>> history = s->history();
      made->change([&](History<std::shared_ptr<Step>>& own) { own = history; });
    }
  tabs_.push_front(made);
  if (tabs_.size() > kMostTabs) tabs_.pop_back();
  if (!made->has_model() && !setup_.data.empty()) start_proposal(made, json::object());
  return made;
}

std::shared_ptr<Session> Api::session_of(const Request& request) {
  const std::string& id = text(request, "tab");
  const std::lock_guard lock(mutex_);
  for (auto s = tabs_.begin(); s != tabs_.end(); ++s)
    if ((*s)->id() == id) {
      tabs_.splice(tabs_.begin(), tabs_, s);
      return tabs_.front();
    }
  throw NotFound("this tab is not known; load the page again");
}

json Api::get(const Request& request) {
  if (request.path == "/api/drive") return {{"status", drive_.status()}, {"in_reach", drive_.in_reach()}};
  if (request.path == "/api/map") return drive_.residual_map();
  if (request.path == "/api/live") return drive_.live(whole(request, "since", 1e15));
  const std::shared_ptr<Session> session = session_of(request);
  if (request.path == "/api/state") {
    const std::uint64_t seen = whole(request, "seen", 1e15);
    if (session->wait(seen, kLongestWait) <= seen) return {{"changes", seen}};
    json state = session->state();
    const std::shared_ptr<Step> opened = session->history()[0];
    state["data_name"] = opened && !opened->data_name.empty() ? opened->data_name : setup_.data_name;
    state["model_file"] = setup_.model_name;
    state["folder"] = setup_.folder.string();
    state["scenarios"] = setup_.run ? closed_loop_scenarios() : std::vector<std::string>();
    state["rig"] = setup_.plant_setup.what;
    return state;
  }
  if (request.path == "/api/closed_loop") {
    const auto traces = session->stored("closed_loop");
    if (!traces) throw NotFound("no closed loop was run in this tab");
    return *traces;
  }
  const History<std::shared_ptr<Step>> history = session->history();
  if (!session->has_model()) throw NotFound("there is no model yet");
  const std::size_t at = request.query.contains("step") ? whole(request, "step") : history.at();
  if (at >= history.size()) throw UnknownNameError("there is no such step");
  const std::shared_ptr<ResultView> view = history[at]->view();
  if (request.path == "/api/trace")
    return view->trace({.experiment = text(request, "experiment"),
                        .signal = text(request, "signal"),
                        .from_s = number(request, "from"),
                        .to_s = number(request, "to"),
                        .points = whole(request, "points")});
  if (request.path == "/api/maps") return {{"maps", view->maps()}, {"loops", view->loops()}};
  if (request.path == "/api/stretches")
    return view->intervals_of(text(request, "signal"), text(request, "variable"), number(request, "low"),
                              number(request, "high"));
  throw NotFound("there is nothing under this address");
}

json Api::post(const Request& request) {
  if (request.path == "/api/tab") {
    const auto like = request.query.find("like");
    const std::string id = open_tab(like == request.query.end() ? "" : like->second)->id();
    store_all_tabs();
    return {{"tab", id}};
  }
  const std::shared_ptr<Session> session = session_of(request);
  if (request.path == "/api/drop") {
    start_drop(session, request.files);
    return json::object();
  }
  if (request.path == "/api/do") return act(session, json::parse(request.body));
  throw NotFound("there is nothing under this address");
}

json Api::act(const std::shared_ptr<Session>& session, const json& body) {
  const std::string what = field(body, "do");
  constexpr std::string_view kWithoutModel[] = {"cancel", "dismiss", "propose", "begin", "forget"};
  if (!session->has_model() && std::ranges::find(kWithoutModel, what) == std::end(kWithoutModel))
    throw UnknownNameError("there is no model yet; drop recordings on the page and begin with them");
  if (!act_on_project(session, what, body) && !act_on_model(session, what, body) && !act_on_drive(session, what, body))
    throw UnknownNameError(fmt::format("\"{}\" cannot be done", what));
  return json::object();
}

bool Api::act_on_project(const std::shared_ptr<Session>& session, const std::string& what, const json& body) {
  if (what == "propose") {
    start_proposal(session, body);
  } else if (what == "begin") {
    start_project(session, choices_of(body));
  } else if (what == "forget") {
    session->store("recordings", nullptr);
    session->set("proposal", nullptr);
  } else if (what == "cancel") {
    session->cancel();
  } else if (what == "dismiss") {
    session->set("problem", nullptr);
  } else {
    return false;
  }
  return true;
}

bool Api::act_on_model(const std::shared_ptr<Session>& session, const std::string& what, const json& body) {
  const auto pipeline = setup_.pipeline;
  if (what == "undo" || what == "redo" || what == "go") {
    if (session->works()) throw BusyError("something is still running; wait, or cancel it");
    session->change([&](auto& history) {
      if (what == "undo") history.undo();
      if (what == "redo") history.redo();
      if (what == "go") history.go(body.at("step").get<std::size_t>());
    });
    store_all_tabs();
  } else if (what == "diagnose") {
    start_diagnosis(session);
  } else if (what == "add") {
    start_step(session, fmt::format("Adding {}", field(body, "effect")),
               [pipeline, effect = field(body, "effect")](const Step& now, const Progress& progress) {
                 return with_effect(now, effect, pipeline, progress);
               });
  } else if (what == "remove") {
    start_step(session, fmt::format("Removing {}", field(body, "effect")),
               [pipeline, id = field(body, "effect")](const Step& now, const Progress& progress) {
                 return without_effect(now, id, pipeline, progress);
               });
  } else if (what == "refit") {
    start_step(session, "Identifying",
               [pipeline](const Step& now, const Progress& progress) { return refitted(now, pipeline, progress); });
  } else if (what == "pack") {
    start_pack(session);
  } else if (what == "try") {
    start_trial(session, field(body, "scenario"));
  } else if (what == "save") {
    start_save(session, body);
  } else {
    return false;
  }
  return true;
}

bool Api::act_on_drive(const std::shared_ptr<Session>& session, const std::string& what, const json& body) {
  if (what == "connect") {
    const std::string drive = field(body, "drive");
    session->start("Connecting", [this, drive, session = session.get()](const Progress& progress) {
      progress(drive);
      session->set("flash", nullptr);  // of the drive before
      session->set("flash_preview", nullptr);
      drive_.connect(drive);
    });
  } else if (what == "disconnect") {
    drive_.disconnect();
    session->set("flash", nullptr);
    session->set("flash_preview", nullptr);
  } else if (what == "preview-flash" || what == "preview-restore") {
    session->start("Comparing with the drive", [this, what, session = session.get()](const Progress& progress) {
      if (what == "preview-restore") return session->set("flash_preview", drive_.preview_restore());
      const std::shared_ptr<Step> step = session->history().current();
      ComparedBlocks blocks;
      json preview = drive_.preview_flash(step->model, progress, &blocks);
      session->set("flash_preview", preview);
      if (!setup_.run || blocks.made == blocks.active) return;
      preview["predicted"] = predicted_gain(step->model, blocks, setup_.run, progress);
      progress("");
      session->set("flash_preview", std::move(preview));
    });
  } else if (what == "dismiss-preview") {
    session->set("flash_preview", nullptr);
  } else if (what == "flash" || what == "restore") {
    // A drive is changed only as shown in the preview.
    const PreviewedBlocks shown{field(body, "before"), field(body, "after")};
    session->start(what == "flash" ? "Flashing" : "Restoring",
                   [this, what, shown, session = session.get()](const Progress& progress) {
                     const std::shared_ptr<Step> step = session->history().current();
                     session->set("flash", nullptr);  // it stays so where this fails
                     if (what == "restore") return static_cast<void>(drive_.restore(shown));
                     session->set("flash", drive_.flash(step->model, progress, shown));
                   });
    session->set("flash_preview", nullptr);
  } else if (what == "move") {
    session->start("Moving the twin", [this](const Progress& progress) { drive_.move(progress); });
  } else if (what == "empty-map") {
    drive_.reset_residual_map();
  } else {
    return false;
  }
  return true;
}

void Api::start_step(const std::shared_ptr<Session>& session, const std::string& what,
                     std::function<std::shared_ptr<Step>(const Step&, const Progress&)> make) {
  // The thread is joined before its session ends.
  session->start(what, [this, session = session.get(), make = std::move(make)](const Progress& progress) {
    const std::shared_ptr<Step> now = session->history().current();
    const std::shared_ptr<Step> next = make(*now, progress);
    session->change([&](auto& history) { history.take(next); });
    store_all_tabs();
  });
}

void Api::start_diagnosis(const std::shared_ptr<Session>& session) {
  const std::string key = "diagnose " + session->history().current()->id;
  refuse_deadly_job(key);  // it begins by itself
  session->start(
      "Searching for what is missing",
      [session = session.get()](const Progress& progress) {
        const std::shared_ptr<Step> step = session->history().current();
        step->diagnose(
            [&] {
              selection::Options how;
              how.pipeline = step->pipeline;
              how.progress = progress;
              return selection::diagnose(*step->dataset, step->model, how);
            },
            [&, is_reported = false]() mutable {
              estimation::throw_if_cancelled();
              if (!std::exchange(is_reported, true)) progress("another tab is at it");
            });
      },
      true, key);
}

void Api::start_pack(const std::shared_ptr<Session>& session) {
  session->start("Packing", [session = session.get()](const Progress& progress) {
    progress("proving the block and comparing it with double");
    const model::Model model = session->history().current()->model;
    json packed = pack_json(deployment::pack(model));
    packed["unit"] = output::torque_unit(model.drive.axis);
    progress("");
    session->set("pack", std::move(packed));
  });
}

std::string Api::content(const Session& session, const std::string& what) const {
  const auto history = session.history();
  const Step& step = *history.current();
  if (what == "model") return model_file(step);
  if (what == "dataset") return history[0]->dataset_text;
  if (what == "report")
    return report_page(step, history.at() > 0 ? history[history.at() - 1].get() : nullptr,
                       history[0]->data_name.empty() ? setup_.data_name : history[0]->data_name, setup_.pipeline);
  const auto bytes = deployment::pack(step.model).bytes;
  return {bytes.begin(), bytes.end()};
}

void Api::start_trial(const std::shared_ptr<Session>& session, const std::string& scenario) {
  if (!setup_.run) throw UnknownNameError("there is nothing here to run a closed loop on");
  // Names alone: a scenario may be a file, and requests name no paths.
  if (std::ranges::find(closed_loop_scenarios(), scenario) == closed_loop_scenarios().end())
    throw UnknownNameError(
        fmt::format("there is no scenario \"{}\"; there are {}", scenario, fmt::join(closed_loop_scenarios(), ", ")));
  session->start("Running the closed loop", [this, scenario, session = session.get()](const Progress& progress) {
    const auto history = session->history();
    SimulatedPlant plant_setup = setup_.plant_setup;
    const bool is_model = !plant_setup.is_known();
    const auto made = run_closed_loop(*history[0], *history.current(), plant_setup, scenario, setup_.run, progress);
    progress("");
    session->store("closed_loop", closed_loop::traces_json(made));
    json drive_status = closed_loop_json(made, plant_setup, is_model);
    drive_status["step"] = {
        {"at", history.at()}, {"action", history.current()->action}, {"what", history.current()->what}};
    session->set("closed_loop", std::move(drive_status));
  });
}

void Api::start_save(const std::shared_ptr<Session>& session, const json& body) {
  const std::string what = field(body, "what");
  const std::filesystem::path path = inside(setup_.folder, field(body, "name"), ending_of(what));
  std::error_code error;
  if (std::filesystem::exists(path, error) && !body.value("replace", false))
    throw NameError(fmt::format("{} is there already; take another name, or replace it", path.filename().string()));
  session->start("Saving", [this, what, path, session = session.get()](const Progress& progress) {
    progress(path.filename().string());
    const std::string text = content(*session, what);
    progress("");
    model::save(path, text);
    session->set("saved", {{"what", what}, {"file", path.string()}});
  });
}

Answer Api::file(const Request& request) {
  const std::shared_ptr<Session> session = session_of(request);
  const std::string what = text(request, "what");
  Answer answer;
  if (!session->has_model()) throw UnknownNameError("there is no model yet");
  answer.download = what == "dataset" ? "dataset.toml" : "flexspline-" + what + ending_of(what);
  answer.body = content(*session, what);
  answer.type = ending_of(what) == ".toml" ? "application/toml"
                : what == "report"         ? "text/html; charset=utf-8"
                                           : "application/octet-stream";
  return answer;
}

}  // namespace flexspline::workbench
